"""Named numbers of the packages: each name has one value in the whole tree, and each number a statement and a sentence.

`python -m tests.house_rules.constants` prints each place that breaks a rule; arguments are the names of the
files to look at.
"""

from __future__ import annotations

import ast
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("lsds", "plugins", "drivers", "mocks")
RULES = {
    "collisions": "a name that has another value elsewhere: say what it is the number of, or import the other",
    "several at once": "several numbers in one statement: one statement each",
    "no sentence": "no docstring below, no comment above or behind: state meaning, unit and source",
}

_NAME = re.compile(r"_*[A-Z][A-Z0-9_]*")
_Number = float | tuple["_Number", ...]


class Constant(NamedTuple):
    """A name in capitals that a module gives a number, or a tuple of numbers."""

    file: str
    line: int
    name: str
    value: _Number
    alone: bool  #: whether its statement assigns no other name
    explained: bool

    @property
    def meaning(self) -> str:
        """The name without the underscore of a private one."""
        return self.name.lstrip("_")


def constants(source: str, file: str = "") -> list[Constant]:
    """Every named number at the top level of a module, in the order of its lines."""
    lines, body = source.splitlines(), ast.parse(source).body
    known: dict[str, _Number] = {}
    found: list[Constant] = []
    for statement, after in zip(body, [*body[1:], None], strict=True):
        pairs = [*_assigned(statement)]
        explained = _is_text(after) or _has_comment(lines, statement)
        for target, value in pairs:
            number = _number(value, known)
            if number is not None and _NAME.fullmatch(target):
                known[target] = number
                found.append(Constant(file, statement.lineno, target, number, len(pairs) == 1, explained))
    return found


def _assigned(statement: ast.stmt) -> list[tuple[str, ast.expr]]:
    """Names and values of an assignment; each name with its value when a tuple is taken apart."""
    match statement:
        case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
            return [(name, value)]
        case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
            pairs = zip(targets, values, strict=False)
            return [(target.id, value) for target, value in pairs if isinstance(target, ast.Name)]
        case ast.Assign(targets=targets, value=value):
            return [(target.id, value) for target in targets if isinstance(target, ast.Name)]
    return []


def _number(node: ast.expr, known: dict[str, _Number]) -> _Number | None:
    """Value of an expression of numbers, constants of its module and functions of `math`; None for all others."""
    match node:
        case ast.Tuple(elts=[_, *_] as parts) | ast.List(elts=[_, *_] as parts):
            numbers = [_number(part, known) for part in parts]
            return None if None in numbers else tuple(number for number in numbers if number is not None)
        case ast.Constant(value=bool()):
            return None
        case ast.Constant(value=int() | float()) | ast.UnaryOp() | ast.BinOp() | ast.Call():
            pass
        case ast.Name(id=name):
            return known.get(name)
        case ast.Attribute(value=ast.Name(id="math")):
            pass
        case _:
            return None
    try:
        value = eval(compile(ast.Expression(node), "constant", "eval"), {"__builtins__": {}, "math": math, **known})
    except (NameError, TypeError, ValueError, AttributeError):
        return None
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else None


def _is_text(statement: ast.stmt | None) -> bool:
    match statement:
        case ast.Expr(value=ast.Constant(value=str())):
            return True
    return False


def _has_comment(lines: list[str], statement: ast.stmt) -> bool:
    """Whether a comment stands on the line above a statement, or behind it."""
    above = lines[statement.lineno - 2].strip() if statement.lineno > 1 else ""
    behind = lines[(statement.end_lineno or statement.lineno) - 1][statement.end_col_offset or 0 :].strip()
    return any(text.startswith("#") and "type: ignore" not in text for text in (above, behind))


def tree() -> list[Constant]:
    """Every named number of the packages, also of files that are not committed yet."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *(f"{package}/*.py" for package in PACKAGES)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    files = [ROOT / name for name in listed.stdout.split()]
    return [
        constant
        for path in files
        if path.exists()
        for constant in constants(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
    ]


def offences(found: list[Constant]) -> dict[str, list[Constant]]:
    """Constants that break a rule, by rule; a collision lists every place of the name."""
    values: dict[str, set[_Number]] = {}
    for constant in found:
        values.setdefault(constant.meaning, set()).add(constant.value)
    return {
        "collisions": [constant for constant in found if len(values[constant.meaning]) > 1],
        "several at once": [constant for constant in found if not constant.alone],
        "no sentence": [constant for constant in found if not constant.explained],
    }


def main(arguments: list[str]) -> None:
    """Prints the places of the whole tree, or of the files whose names start with an argument, and their numbers."""
    found = tree()
    for rule, broken in offences(found).items():
        order = (lambda c: (c.meaning, c.file)) if rule == "collisions" else (lambda c: (c.file, c.line))
        here = [c for c in sorted(broken, key=order) if not arguments or c.file.startswith(tuple(arguments))]
        print(f"{len(here)} of {len(found)} constants: {RULES[rule]}")
        for constant in here:
            print(f"  {constant.file}:{constant.line}: {constant.name} = {constant.value}")


if __name__ == "__main__":
    main(sys.argv[1:])
