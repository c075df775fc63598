"""The syntax tree of a script."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Node:
    """A node of the tree, with its position in the text."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Literal(Node):
    """A number, a string, True or False."""

    value: float | int | str | bool


@dataclass(frozen=True, slots=True)
class Name(Node):
    """A variable read."""

    name: str


@dataclass(frozen=True, slots=True)
class ListOf(Node):
    """`[a, b]`, or `p[a, b, c, d, e, f]` where `pose`."""

    items: tuple[Node, ...]
    pose: bool


@dataclass(frozen=True, slots=True)
class Struct(Node):
    """`struct(a=1, b=2)`."""

    fields: tuple[tuple[str, Node], ...]


@dataclass(frozen=True, slots=True)
class Member(Node):
    """`base.field`."""

    base: Node
    field: str


@dataclass(frozen=True, slots=True)
class Index(Node):
    """`base[i]` or `base[i, j]`."""

    base: Node
    indices: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Unary(Node):
    """`-a`, `not a`."""

    operator: str
    operand: Node


@dataclass(frozen=True, slots=True)
class Binary(Node):
    """`a + b`, `a and b`, `a < b`."""

    operator: str
    left: Node
    right: Node


@dataclass(frozen=True, slots=True)
class Call(Node):
    """`f(a, b=1)`; `method_of` is the value before the dot of `value.f(a)`."""

    name: str
    positional: tuple[Node, ...]
    named: tuple[tuple[str, Node], ...]
    method_of: Node | None = None


@dataclass(frozen=True, slots=True)
class Run(Node):
    """`run f(a)`: starts a thread, returns its handle."""

    call: Call


@dataclass(frozen=True, slots=True)
class Assign(Node):
    """`target = value`; `scope` is "", "global" or "local"."""

    target: Name | Index | Member
    value: Node
    scope: str


@dataclass(frozen=True, slots=True)
class Bare(Node):
    """An expression statement."""

    value: Node


@dataclass(frozen=True, slots=True)
class Word(Node):
    """A statement of one word: break, continue, halt, pause, enter_critical, exit_critical."""

    word: str


@dataclass(frozen=True, slots=True)
class Handle(Node):
    """`kill h` or `join h`."""

    word: str
    handle: Node


@dataclass(frozen=True, slots=True)
class Return(Node):
    """`return`, with a value or without."""

    value: Node | None


@dataclass(frozen=True, slots=True)
class If(Node):
    """Conditions with their bodies, and the body of else."""

    branches: tuple[tuple[Node, tuple[Node, ...]], ...]
    otherwise: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class While(Node):
    """A loop."""

    condition: Node
    body: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Function(Node):
    """`def`, `thread` or `sec`, by `kind`; the default of a parameter without one is None."""

    kind: str
    name: str
    parameters: tuple[tuple[str, Node | None], ...]
    body: tuple[Node, ...]
