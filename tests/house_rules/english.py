"""Idioms and names that a reader who does not know the project would stumble over.

`python -m tests.house_rules.english` prints each place. `docs/glossary.md` has the words to use instead.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]

_PATTERNS = {
    r"\bbrains?\b": "algorithm, plugin",
    r"\b(heeds?|minds)\b": "respects, supports",
    r"\b(nobody|somebody|whomever|whoever)\b": "the subject's name",
    r"\b(is|are) none\b": "what it is",
    r"\b(tells?|told)\b": "reports, returns, estimates, commanded",
    r"\b(is|are|was|were) said\b": "raises, is reported",
    r"(^[#\s\"'*-]*|[.:;] )What (?!happens|to |is this|it does|you )\w+": "the subject's name",
    r"\bso (many|much|long|far) (of|a|as|that)\b": "the quantity",
    r"\bof (one's|its|their) own\b": "own, separate",
    r"\b(anew|ere|whereof|for ever|besides?)\b": "again, next to",
    r"\b(let|lets|letting) go\b": "release",
    r"\btwins?\b": "duplicate",
    r", where (it|that|the|there|one)\b": "if, when",
    r"\bas (true|good) as\b": "accuracy",
}
PROSE = {re.compile(pattern): better for pattern, better in _PATTERNS.items()}
NAMES = {
    "told": "commanded, reported, sent",
    "tell": "report",
    "tells": "reports",
    "said": "reported, stated, sent",
    "says": "reports, states",
    "heed": "respect",
    "heeds": "respects",
    "nobody": "no_one's name",
    "somebody": "the subject's name",
    "brain": "algorithm",
    "brains": "algorithms",
    "twin": "duplicate",
    "twins": "duplicates",
    "anew": "again",
}
MOST_SUBJECT = 72
FIRST_CHECKED = "2598b08"  # subjects of commits up to this one stay as they are


class Idiom(NamedTuple):
    """A place in a file of the tree: line, what was found there, and the better word."""

    line: int
    found: str
    better: str


def places(path: Path) -> list[Idiom]:
    """Idioms in prose (documents, docstrings, comments, messages) and names of a Markdown or Python file."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return [*_prose(enumerate(text.splitlines(), 1))]
    return [*_prose(_texts(text)), *_names(text)]


def _prose(lines: Iterator[tuple[int, str]]) -> Iterator[Idiom]:
    for number, line in lines:
        for pattern, better in PROSE.items():
            if found := pattern.search(line):
                yield Idiom(number, found.group(0).strip(), better)
                break


def _texts(source: str) -> Iterator[tuple[int, str]]:
    """Comments, and strings of more than one word, line by line."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string
        elif token.type == tokenize.STRING:
            lines = token.string.splitlines()
            yield from ((token.start[0] + k, line) for k, line in enumerate(lines) if " " in line.strip())
        elif token.type == getattr(tokenize, "FSTRING_MIDDLE", None):
            yield token.start[0], token.string


def _names(source: str) -> Iterator[Idiom]:
    """Names that a file defines: functions, classes, arguments, variables and attributes."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                pass
            case ast.arg(arg=name) | ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                pass
            case _:
                continue
        words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)
        for word in {word.lower() for word in words} & NAMES.keys():
            yield Idiom(node.lineno, name, NAMES[word])


def tree() -> dict[str, list[Idiom]]:
    """Every document and source of the tree with its idioms, also of files that are not committed yet."""
    asked = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.py", "*.md"]
    listed = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True)
    files = [ROOT / name for name in listed.stdout.split() if "house_rules/" not in name]
    found = {path.relative_to(ROOT).as_posix(): places(path) for path in files if path.exists()}
    return {name: idioms for name, idioms in found.items() if idioms}


def main(arguments: list[str]) -> None:
    """Prints the places of the whole tree, or of the files whose names start with an argument."""
    found = tree()
    for name, idioms in found.items():
        if not arguments or name.startswith(tuple(arguments)):
            for place in idioms:
                print(f"{name}:{place.line}: '{place.found}' ({place.better})")


if __name__ == "__main__":
    main(sys.argv[1:])
