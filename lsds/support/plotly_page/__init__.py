"""An HTML page that opens from disk and loads nothing: the library that draws is packed into it (extra `report`)."""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any


def plotly_page(title: str, package: str, parts: Mapping[str, str], data: Any) -> str:
    """Return a page; `package` holds what is its own: page.html (the body), page.css and page.js.

    `parts`, which are HTML, replace the names in double braces in the body, as the title does. The script reads `data`,
    which is written as JSON, and calls `loadLibrary`. Raises ValueError for a number that JSON cannot hold.
    """
    from plotly.offline import get_plotlyjs  # type: ignore[import-untyped]

    safe = html.escape(title)
    shell = {
        "title": safe,
        "style": _file(__name__, "shell.css") + _file(package, "page.css"),
        "body": _filled(_file(package, "page.html"), {"title": safe, **parts}),
        # A "</script>" inside of a value would end the element that holds it.
        "data": json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        "library": base64.b64encode(gzip.compress(get_plotlyjs().encode("utf-8"), mtime=0)).decode("ascii"),
        "script": _file(__name__, "shell.js") + _file(package, "page.js"),
    }
    return _filled(_file(__name__, "shell.html"), shell)


def plotly_version() -> str:
    """Return the version of the library that draws."""
    from plotly.offline import get_plotlyjs_version

    return str(get_plotlyjs_version())


def table_rows(rows: Iterable[tuple[str, str]]) -> str:
    """Return rows of a table: a name and its value each."""
    return "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)


def _filled(template: str, parts: Mapping[str, str]) -> str:
    # One pass, so that a name in braces inside of a value stays as it is.
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], template)


def _file(package: str, name: str) -> str:
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")
