"""A random sample of the project's prose, for a reader who judges whether it needs a second reading.

`python -m tests.house_rules.sample [SEED]` prints 30 docstrings, 20 messages and 10 paragraphs of the documents.
"""

from __future__ import annotations

import ast
import random
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COUNTS = {"docstring": 30, "message": 20, "paragraph": 10}


def sources() -> list[Path]:
    """Return the tracked modules outside tests, and the documents without decisions."""
    listed = subprocess.run(["git", "ls-files", "*.py", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    skipped = ("tests/", "docs/decisions/", "CHANGELOG.md")
    return [ROOT / name for name in listed.stdout.split() if not name.startswith(skipped) and (ROOT / name).exists()]


def docstrings(tree: ast.Module) -> list[tuple[int, str]]:
    """Return the line and text of every docstring."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                found.append((getattr(node, "lineno", 1), text))
    return found


def messages(tree: ast.Module) -> list[tuple[int, str]]:
    """Return the line and text of every message that an error is raised with, with placeholders as in the source."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            texts = [ast.unparse(part) for part in [*node.exc.args, *(k.value for k in node.exc.keywords)]]
            text = " | ".join(part for part in texts if " " in part)
            if len(text) > 25:
                found.append((node.lineno, text))
    return found


def paragraphs(text: str) -> list[tuple[int, str]]:
    """Return the line and text of every paragraph of a document, without tables, lists of links and code."""
    prose = re.sub(r"```.*?```", lambda block: "\n" * block.group().count("\n"), text, flags=re.DOTALL)
    found, line = [], 1
    for part in prose.split("\n\n"):
        if len(part.split()) > 15 and not part.lstrip().startswith(("|", "#", "!", "<")):
            found.append((line + part.count("\n", 0, len(part) - len(part.lstrip())), part.strip()))
        line += part.count("\n") + 2
    return found


def sample(seed: int) -> list[tuple[str, str, int, str]]:
    """Return kind, file, line and text of the drawn places."""
    places: dict[str, list[tuple[str, int, str]]] = {kind: [] for kind in COUNTS}
    for path in sources():
        name, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
        if path.suffix == ".md":
            places["paragraph"] += [(name, *each) for each in paragraphs(text)]
        else:
            tree = ast.parse(text)
            places["docstring"] += [(name, *each) for each in docstrings(tree)]
            places["message"] += [(name, *each) for each in messages(tree)]
    draw = random.Random(seed)
    return [(kind, *each) for kind, count in COUNTS.items() for each in draw.sample(places[kind], count)]


if __name__ == "__main__":
    if not all(argument.isdecimal() for argument in sys.argv[1:]):
        sys.exit("usage: python -m tests.house_rules.sample [SEED]")
    for kind, name, line, text in sample(int(sys.argv[1]) if len(sys.argv) > 1 else 0):
        print(f"--- {kind} {name}:{line}\n{text}\n")
