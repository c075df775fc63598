"""The documentation site builds without a warning, and its reference has every public name."""

from __future__ import annotations

import importlib.util
import os
import re
import runpy
import subprocess
import sys
import zlib
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.packaging.surface import MODULES, STORED

ROOT = Path(__file__).parents[2]
hooks = runpy.run_path(str(ROOT / "docs" / "site_hooks.py"))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site. A warning, such as a broken link or a page that is not in the navigation, fails the build."""
    for module in ("mkdocs", "material", "mkdocstrings_handlers"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed (pip install 'lsds-tactile[docs]')")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_every_page_of_docs_is_on_the_site(site):
    pages = [page.relative_to(ROOT / "docs").with_suffix("") for page in (ROOT / "docs").rglob("*.md")]
    assert len(pages) > 60
    built = [site / ("." if page.name == "index" else page) / "index.html" for page in pages]
    assert [path for path in built if not path.exists()] == []


def test_the_reference_has_every_public_name(site):
    # The inventory that other sites link by: four lines of head, then one compressed line for each name.
    inventory = zlib.decompress((site / "objects.inv").read_bytes().split(b"\n", 4)[4]).decode()
    documented = {line.split(" ")[0] for line in inventory.splitlines()}
    public = {re.split(r"[(:]", line)[0] for line in STORED.read_text(encoding="utf-8").splitlines()}
    assert len(public) > 400
    # A module without __all__, such as lsds.contracts.plant, has no names in the stored surface.
    assert [module for module in MODULES if not any(name.startswith(f"{module}.") for name in documented)] == []
    assert sorted(name for name in public - documented if not name.rpartition(".")[2].startswith("_")) == []


def test_the_first_page_shows_the_command_of_the_readme(site):
    text = re.sub(r"<[^>]+>", "", (site / "index.html").read_text(encoding="utf-8"))
    assert "pip install -q -c constraints.txt &#39;.[sim]&#39;" in text or "constraints.txt '.[sim]'" in text
    assert "../README.md" not in text


def test_nothing_is_loaded_from_other_servers(site):
    text = (site / "index.html").read_text(encoding="utf-8")
    loaded = re.findall(
        r"<(?:script|img)[^>]* src=\"?([^\" >]+)|<link[^>]* rel=\"?stylesheet\"?[^>]* href=\"?([^\" >]+)", text
    )
    assert loaded
    assert [address for pair in loaded for address in pair if re.match(r"(https?:)?//", address)] == []


@pytest.mark.parametrize(
    ("source", "markdown", "shown"),
    [
        ("grip.md", "see `docs/learning.md`.", "see [`learning.md`](learning.md)."),
        ("plugins/gripper.md", "`docs/wire.md`", "[`wire.md`](../wire.md)"),
        ("grip.md", "[`docs/wire.md`](wire.md)", "[`docs/wire.md`](wire.md)"),
        ("grip.md", "`docs/none.md`", "`docs/none.md`"),
        ("grip.md", "```text\n`docs/wire.md`\n```", "```text\n`docs/wire.md`\n```"),
    ],
)
def test_a_page_named_in_code_style_becomes_a_link(source, markdown, shown):
    page = SimpleNamespace(file=SimpleNamespace(src_uri=source))
    assert hooks["on_page_markdown"](markdown, page=page) == shown


def test_a_link_to_the_readme_becomes_its_section():
    page = SimpleNamespace(file=SimpleNamespace(src_uri="index.md"))
    shown = hooks["on_page_markdown"]("[Try it](../README.md#try-it)", page=page)
    assert shown.startswith("## Try it\n")
    assert "lsds run" in shown
    assert shown.count("\n## ") == 0
    with pytest.raises(ValueError, match="no section #try-this; correct the link"):
        hooks["on_page_markdown"]("[Try it](../README.md#try-this)", page=page)
