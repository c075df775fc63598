"""No two files import each other, directly or through others: each can be read, tested and moved with what is below it.

All imports count. One inside a function or for the type checker alone still says that a file cannot be understood
without the other.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "lsds": ROOT / "lsds",
    "lsds_plugins": ROOT / "plugins" / "lsds_plugins",
    "lsds_research": ROOT / "plugins" / "lsds_research",
    "lsds_drivers": ROOT / "drivers" / "lsds_drivers",
    "lsds_mocks": ROOT / "mocks" / "lsds_mocks",
}


def modules(folder: Path) -> dict[str, str]:
    """Return the source of each module of a package, by dotted name."""
    sources = {}
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(folder.parent).with_suffix("").parts
        sources[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text(encoding="utf-8")
    return sources


def imported(source: str) -> Iterator[str]:
    """Return every dotted name that a file imports from: `from a.b import c` gives a.b.c, which may be a module."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def graph(sources: dict[str, str]) -> dict[str, set[str]]:
    """Return which modules of a package each of them imports. A name that is not a module is its parent's."""
    edges: dict[str, set[str]] = {}
    for name, source in sources.items():
        targets = {to if to in sources else to.rpartition(".")[0] for to in imported(source)}
        edges[name] = (targets & sources.keys()) - {name}
    return edges


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Return each group of modules that reach one another (Tarjan 1972: strongly connected components)."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        number[name] = lowest[name] = len(number)
        stack.append(name)
        for to in sorted(edges[name]):
            if to not in number:
                visit(to)
            if to in stack:
                lowest[name] = min(lowest[name], lowest[to])
        if lowest[name] == number[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                found.append(sorted(group))

    for name in edges:
        if name not in number:
            visit(name)
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_no_file_imports_one_that_imports_it(package):
    folder = PACKAGES[package]
    if not folder.is_dir():
        pytest.skip(f"{package} is not in this checkout")
    found = circles(graph(modules(folder)))
    assert not found, "\n".join(f"import each other: {', '.join(group)}" for group in found)


def test_a_circle_is_found_however_it_is_imported():
    sources = {
        "p": "",
        "p.a": "from p import b",
        "p.b": "def f():\n    from p.c import name",
        "p.c": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import p.a",
        "p.d": "import p.a",
    }
    assert circles(graph(sources)) == [["p.a", "p.b", "p.c"]]
