"""Random programs of the mock's own language, by seed: most are well formed, few make sense, many never wait."""

from __future__ import annotations

import random

from lsds_mocks.wire.ur.functions import waiting

VARIABLES = ("a", "b", "c", "d", "l", "m", "s", "t")
LITERALS = (
    *("0", "1", "2", "-1", "3.5", "65535", "2147483647", "-2147483648", "1e300", "0xFFFFFFFF", "True", "False"),
    *('""', '"a"', '"%9d"', '"12"', '"0123456789abcdef"', "[]", "[1, 2, 3]", "[[1, 2], [3, 4]]", "make_list(500, 1)"),
    *("p[0.1, 0.2, 0.3, 0, 0, 0]", "[0, -1.5, 1.5, -1.5, -1.5, 0]", "get_actual_tcp_pose()", "struct(x=1, y=[2])"),
)
OPERATORS = ("+", "-", "*", "/", "%", "==", "!=", "<", "<=", ">", ">=", "and", "or", "xor")
METHODS = ("append({0})", "insert(0, {0})", "remove(0)", "pop()", "clear()", "length()", "slice(0, 2)")
# These end the other programs of a test, or pause this one for good.
LEFT_OUT = frozenset(("protective_stop", "popup", "rtde_set_watchdog"))


class Writer:
    """Writes one program."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._names = sorted(name for name in waiting() if name not in LEFT_OUT)
        self._depth = 0
        self._functions: list[str] = []

    def program(self) -> str:
        lines = [f"{name} = {self._random.choice(LITERALS)}" for name in VARIABLES]
        for number in range(self._random.randrange(3)):
            self._functions.append(f"own{number}")
            kind = self._random.choice(("def", "thread"))
            parameter = "x=1" if kind == "def" else ""
            lines += [f"{kind} own{number}({parameter}):", *self._block(), "end"]
        for _ in range(self._random.randrange(1, 6)):
            lines += self._statement()
        return "\n".join(["def program():", *lines, "end\n"])

    def _block(self) -> list[str]:
        self._depth += 1
        lines = [line for _ in range(self._random.randrange(1, 5)) for line in self._statement()]
        self._depth -= 1
        return lines

    def _statement(self) -> list[str]:
        pick = self._random.random()
        name = self._random.choice(VARIABLES)
        if pick < 0.4 or self._depth > 3:
            return [f"{name} = {self._expression()}"]
        if pick < 0.5:
            return [f"{name}.{self._random.choice(METHODS).format(self._expression())}"]
        if pick < 0.55:
            return [f"{name}[{self._expression()}] = {self._expression()}"]
        if pick < 0.7:
            condition = "True" if self._random.random() < 0.5 else self._expression()
            return [f"while {condition}:", *self._block(), "end"]
        if pick < 0.8:
            return [f"if {self._expression()}:", *self._block(), "else:", *self._block(), "end"]
        if pick < 0.85 and self._functions:
            return [f"run {self._random.choice(self._functions)}()"]
        if pick < 0.9:
            return ["sync()"]
        return [self._call()]

    def _expression(self, depth: int = 0) -> str:
        pick = self._random.random()
        if pick < 0.35 or depth > 3:
            return self._random.choice(VARIABLES)
        if pick < 0.5:
            return self._random.choice(LITERALS)
        if pick < 0.8:
            operator = self._random.choice(OPERATORS)
            return f"({self._expression(depth + 1)} {operator} {self._expression(depth + 1)})"
        if pick < 0.87:
            return f"{self._random.choice(VARIABLES)}[{self._expression(depth + 1)}]"
        if pick < 0.92:
            return f"[{self._expression(depth + 1)}, {self._expression(depth + 1)}]"
        if pick < 0.94:
            return f"(-{self._expression(depth + 1)})"
        return self._call(depth)

    def _call(self, depth: int = 0) -> str:
        names = [*self._names, *self._functions]
        arguments = [self._expression(depth + 1) for _ in range(self._random.choice((0, 1, 1, 1, 2, 2, 3)))]
        return f"{self._random.choice(names)}({', '.join(arguments)})"


def script(seed: int) -> str:
    """Return the program of a seed."""
    return Writer(seed).program()
