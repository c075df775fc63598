"""Hooks that MkDocs calls to build the documentation site from pages that are also read in the repository.

- A paragraph that is only a link to a section of the README is replaced by that section.
- A page of docs/ that is named in code style becomes a link to it.
- The navigation's last section, "Decisions", lists every page of docs/decisions.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
README_SECTION = re.compile(r"^\[[^\]\n]+\]\(\.\./README\.md#([\w-]+)\)$", re.MULTILINE)
NAMED_PAGE = re.compile(r"(?<![`\[])`docs/([\w/-]+\.md)`(?![`\]])")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def on_config(config: Any) -> Any:
    """Append the pages of docs/decisions to the navigation, in order of their numbers."""
    pages = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    config.nav.append({"Decisions": [f"decisions/{page.name}" for page in pages]})
    return config


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return the Markdown of a page for the site."""
    here = posixpath.dirname(page.file.src_uri)
    return with_links(README_SECTION.sub(lambda found: readme_section(found[1]), markdown), here)


def readme_section(anchor: str) -> str:
    """Return a section of the README with its heading, for a page in docs/. Raises ValueError if it is missing."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for heading, body in re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL):
        if re.sub(r"[^\w-]", "", heading.lower().replace(" ", "-")) == anchor:
            return f"## {heading}\n{body}".rstrip().replace("](docs/", "](")
    raise ValueError(f"README.md has no section #{anchor}; correct the link in docs/")


def with_links(markdown: str, here: str) -> str:
    """Return the text with links to the pages that it names, outside of blocks of code."""

    def link(found: re.Match[str]) -> str:
        if not (ROOT / "docs" / found[1]).exists():
            return found[0]
        return f"[`{found[1]}`]({posixpath.relpath(found[1], here or '.')})"

    parts, end = [], 0
    for fence in FENCE.finditer(markdown):
        parts += [NAMED_PAGE.sub(link, markdown[end : fence.start()]), fence[0]]
        end = fence.end()
    return "".join([*parts, NAMED_PAGE.sub(link, markdown[end:])])
