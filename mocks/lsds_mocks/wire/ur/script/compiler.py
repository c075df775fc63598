"""Compiler from a syntax tree to Python: functions that may wait become generators that yield once per control cycle.

Names resolve as in the controller: a variable that the program assigns outside functions, or declares `global`
anywhere, is global; all others are local to their function. An undefined name is an error before the program starts,
reported with line and column.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from types import CodeType
from typing import Any

from lsds_mocks.wire.ur.script import nodes
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.parser import parse
from lsds_mocks.wire.ur.script.prices import price

MAIN = ""
"""Name of the function that contains the program's top-level statements."""

LONGEST_PROGRAM = 500_000
"""Maximum number of characters in a program; chosen."""
MOST_FUNCTIONS = 4096
"""Maximum number of functions in a program; chosen."""

CHUNK = 400
"""Maximum number of work units that consecutive statements pay at once."""

_CALL = 12
"""Price of calling a function of the program, in units of work."""

_OPERATORS = {
    "+": "add",
    "-": "sub",
    "*": "mul",
    "/": "div",
    "%": "mod",
    "==": "eq",
    "!=": "ne",
    "<": "lt",
    "<=": "le",
    ">": "gt",
    ">=": "ge",
}
_TERMINALS = {
    "digital_in": ("get_digital_in", ""),
    "digital_out": ("get_digital_out", "set_digital_out"),
    "analog_in": ("get_analog_in", ""),
    "analog_out": ("get_analog_out", "set_analog_out"),
}
"""Terminals that older programs and clients access as elements of a list."""

_PARTS: dict[type, tuple[str, ...]] = {}


@dataclass(frozen=True, slots=True)
class Compiled:
    """A program ready to run: its name, whether it is secondary, and the code that defines its functions.

    `ports` are the local ports to which the program may open a socket.
    """

    name: str
    secondary: bool
    codes: tuple[CodeType, ...]
    places: Mapping[str, tuple[int, ...]]
    ports: frozenset[int] = frozenset()

    def place(self, error: BaseException) -> int:
        """Return the script's line in which an error was raised; 0 if it was raised outside the script."""
        line, traceback = 0, error.__traceback__
        while traceback is not None:
            table = self.places.get(traceback.tb_frame.f_code.co_filename)
            if table is not None:
                line = table[traceback.tb_lineno - 1]
            traceback = traceback.tb_next
        return line


def compile_script(text: str, waiting: Mapping[str, bool]) -> Compiled:
    """Return the compiled script. `waiting` lists the controller's functions, with True for those that take time.

    A single `def` or `sec` is the program; other statements form a program without a name. Raises ScriptError.
    """
    if len(text) >= LONGEST_PROGRAM:
        raise ScriptError(f"syntax_error: a program has at most {LONGEST_PROGRAM} characters", 1, 1)
    statements = parse(text)
    main = statements[0] if len(statements) == 1 else None
    if isinstance(main, nodes.Function) and main.kind in ("def", "sec"):
        return _Program(main.name, main.body, waiting).compiled(secondary=main.kind == "sec")
    return _Program("unnamed", statements, waiting).compiled(secondary=False)


class _Program:
    def __init__(self, name: str, body: tuple[nodes.Node, ...], waiting: Mapping[str, bool]) -> None:
        self.name = name
        self.builtins = waiting
        self.functions = {node.name: node for node in _functions(body)}
        self.body = body
        self.shared = set(_assigned(body)) | set(_declared_global(body))
        for function in self.functions.values():
            self.shared |= set(_declared_global(function.body))
        self.waits = self._waiting_functions()

    def compiled(self, *, secondary: bool) -> Compiled:
        main = nodes.Function(1, 1, "thread", MAIN, (), self.body)
        if len(self.functions) > MOST_FUNCTIONS:
            raise ScriptError(f"syntax_error: a program has at most {MOST_FUNCTIONS} functions", 1, 1)
        codes, places = [], {}
        # Compile each function separately, because compiling all at once would hold the interpreter's lock too long.
        for function in (*self.functions.values(), main):
            writer = _Writer(self, function)
            file = f"<{self.name}.{function.name}>"
            codes.append(compile("\n".join(writer.lines) + "\n", file, "exec"))
            places[file] = tuple(writer.places)
        return Compiled(self.name, secondary, tuple(codes), places)

    def _waiting_functions(self) -> set[str]:
        """Return the functions that wait: those that call a waiting function, up to the fixed point."""
        calls = {name: set(_calls(function.body)) for name, function in self.functions.items()}
        waits = {name for name, function in self.functions.items() if _joins(function.body)}
        while True:
            more = {
                name
                for name, called in calls.items()
                if name not in waits and any(c in waits or (c not in calls and self.builtins.get(c)) for c in called)
            }
            if not more:
                return waits
            waits |= more


class _Writer:
    """Writes one function."""

    def __init__(self, program: _Program, function: nodes.Function) -> None:
        self.program = program
        self.lines: list[str] = []
        self.places: list[int] = []
        self._line = function.line
        self._depth = 0
        self._loops = 0
        is_main = function.name == MAIN
        parameters = [name for name, _ in function.parameters]
        self._locals = set(parameters) | set(_declared_local(function.body))
        if not is_main:
            self._locals |= set(_assigned(function.body)) - program.shared
        self._locals -= set(_declared_global(function.body))
        self._generator = function.kind == "thread" or is_main or function.name in program.waits
        arguments = [
            f"v_{name}" + ("" if default is None else f"={self._expression(default)}")
            for name, default in function.parameters
        ]
        self._pay(_CALL + sum(_price(default) for _, default in function.parameters), function)
        self._write(f"def f_{function.name}({', '.join(arguments)}):")
        self._depth += 1
        shared = sorted((set(_assigned(function.body)) | set(_declared_global(function.body))) - self._locals)
        if shared:
            self._write("global " + ", ".join(f"v_{name}" for name in shared))
        for name in sorted(set(parameters) & set(_changed_inside(function.body))):
            self._write(f"v_{name} = copied(v_{name})")
        if self._generator and not is_main:
            self._write("work.frames += 1")
            self._write("try:")
            self._inner(function.body, _CALL, function)
            self._write("finally:")
            self._write("    work.frames -= 1")
        else:
            self._block(function.body, _CALL, function)
        if self._generator:
            self._write("return")
            self._write("yield")

    # -- statements ---------------------------------------------------------------------------------------

    def _write(self, text: str) -> None:
        self.lines.append("    " * self._depth + text)
        self.places.append(self._line)

    def _block(self, body: tuple[nodes.Node, ...], more: int, owner: nodes.Node) -> None:
        """Write statements that pay before they run; the block pays `more` units in addition at its start."""
        if not body:
            self._pay(more, owner)
        paid = 0
        for number, node in enumerate(body):
            if number >= paid:
                units, paid = more, number
                while paid < len(body) and units < CHUNK:
                    units += _price(body[paid])
                    paid += 1
                    if isinstance(body[paid - 1], _BRANCHING):
                        break
                self._line, more = node.line, 0
                self._pay(units, node)
            self._statement(node)

    def _pay(self, units: int, node: nodes.Node) -> None:
        self._write(f"work.left -= {units}")
        self._write(f"if work.left < 0: exhausted({node.line}, {node.column})")

    def _inner(self, body: tuple[nodes.Node, ...], more: int, owner: nodes.Node) -> None:
        self._depth += 1
        self._block(body, more, owner)
        self._depth -= 1

    def _statement(self, node: nodes.Node) -> None:
        if isinstance(node, nodes.Function):
            return
        self._line = node.line
        if isinstance(node, nodes.Assign):
            self._assign(node)
        elif isinstance(node, nodes.Bare):
            self._write(self._expression(node.value))
        elif isinstance(node, nodes.If):
            for number, (condition, body) in enumerate(node.branches):
                self._write(f"{'elif' if number else 'if'} {self._expression(condition)}:")
                self._inner(body, 1, node)
            if node.otherwise:
                self._write("else:")
                self._inner(node.otherwise, 1, node)
        elif isinstance(node, nodes.While):
            self._while(node)
        elif isinstance(node, nodes.Return):
            self._write("return" + ("" if node.value is None else f" {self._bound(node.value)}"))
        elif isinstance(node, nodes.Handle):
            handle = self._expression(node.handle)
            self._write(f"yield from join({handle})" if node.word == "join" else f"kill({handle})")
        elif isinstance(node, nodes.Word):
            self._word(node)
        else:
            raise ScriptError(f"syntax_error_on_line:{node.line}:", node.line, node.column)

    def _word(self, node: nodes.Word) -> None:
        if node.word in ("break", "continue"):
            if not self._loops:
                raise ScriptError(f"syntax_error_on_line:{node.line}:", node.line, node.column)
            self._write(node.word)
        elif node.word == "halt":
            self._write("halt()")
        elif node.word == "pause":
            self._write("pause()")
            self._write("yield")
        # Critical sections only prevent pre-emption, and threads here switch only when they wait.

    def _while(self, node: nodes.While) -> None:
        self._loops += 1
        self._write(f"while {self._expression(node.condition)}:")
        self._inner(node.body, 2 + _price(node.condition), node)
        self._loops -= 1

    def _assign(self, node: nodes.Assign) -> None:
        value = self._bound(node.value)
        target = node.target
        if isinstance(target, nodes.Name):
            self._write(f"v_{target.name} = {value}")
        elif isinstance(target, nodes.Member):
            self._write(f"put_field({self._expression(target.base)}, {target.field!r}, {value})")
        elif (terminal := self._terminal(target)) is not None:
            if not terminal[1]:
                raise ScriptError(f"syntax_error_on_line:{node.line}:", node.line, node.column)
            self._write(f"b_{terminal[1]}({self._expression(target.indices[0])}, {value})")
        else:
            base = self._expression(target.base)
            *before, last = map(self._expression, target.indices)
            for index in before:
                base = f"at({base}, {index})"
            self._write(f"put({base}, {last}, {value})")

    # -- expressions --------------------------------------------------------------------------------------

    def _expression(self, node: nodes.Node) -> str:
        if isinstance(node, nodes.Literal):
            return repr(node.value)
        if isinstance(node, nodes.Name):
            return self._name(node)
        if isinstance(node, nodes.ListOf):
            items = ", ".join(map(self._bound, node.items))
            return f"{'Pose' if node.pose else 'UrList'}([{items}])"
        if isinstance(node, nodes.Struct):
            return f"Struct({', '.join(f'{key}={self._bound(value)}' for key, value in node.fields)})"
        if isinstance(node, nodes.Member):
            return f"field({self._expression(node.base)}, {node.field!r})"
        if isinstance(node, nodes.Index):
            return self._indexed(node)
        if isinstance(node, nodes.Unary):
            operand = self._expression(node.operand)
            return f"neg({operand})" if node.operator == "-" else f"({node.operator} {operand})"
        if isinstance(node, nodes.Binary):
            left, right = self._expression(node.left), self._expression(node.right)
            if node.operator == "xor":
                return f"(bool({left}) != bool({right}))"
            if node.operator in _OPERATORS:
                return f"{_OPERATORS[node.operator]}({left}, {right})"
            return f"({left} {node.operator} {right})"
        if isinstance(node, nodes.Run):
            arguments = self._arguments(node.call)
            self._require_function(node.call)
            return f"run(f_{node.call.name}, {node.call.name!r}{', ' if arguments else ''}{arguments})"
        if isinstance(node, nodes.Call):
            return self._call(node)
        raise ScriptError(f"syntax_error_on_line:{node.line}:", node.line, node.column)

    def _name(self, node: nodes.Name) -> str:
        if node.name not in self._locals and node.name not in self.program.shared:
            raise ScriptError(f"compile_error_name_not_found:{node.name}:", node.line, node.column)
        return f"v_{node.name}"

    def _bound(self, node: nodes.Node) -> str:
        """Return an expression for a value that is bound to a name, with a copy if another name already owns it."""
        value = self._expression(node)
        return f"copied({value})" if isinstance(node, nodes.Name | nodes.Index | nodes.Member) else value

    def _indexed(self, node: nodes.Index) -> str:
        terminal = self._terminal(node)
        if terminal is not None:
            return f"b_{terminal[0]}({self._expression(node.indices[0])})"
        base = self._expression(node.base)
        for index in node.indices:
            base = f"at({base}, {self._expression(index)})"
        return base

    def _terminal(self, node: nodes.Index) -> tuple[str, str] | None:
        """Return the functions that read and write the terminal of an element; None for any other element."""
        if not isinstance(node.base, nodes.Name) or len(node.indices) != 1:
            return None
        name = node.base.name
        if name in self._locals or name in self.program.shared:
            return None
        return _TERMINALS.get(name)

    def _call(self, node: nodes.Call) -> str:
        arguments = self._arguments(node)
        if node.method_of is not None:
            base = self._expression(node.method_of)
            return f"method({base}, {node.name!r}{', ' if arguments else ''}{arguments})"
        if node.name in self.program.functions:
            call = f"f_{node.name}({arguments})"
            is_thread = self.program.functions[node.name].kind == "thread"
            return f"(yield from {call})" if node.name in self.program.waits or is_thread else call
        self._require_function(node)
        call = f"b_{node.name}({arguments})"
        return f"(yield from {call})" if self.program.builtins[node.name] else call

    def _require_function(self, node: nodes.Call) -> None:
        if node.name not in self.program.functions and node.name not in self.program.builtins:
            raise ScriptError(f"compile_error_name_not_found:{node.name}:", node.line, node.column)

    def _arguments(self, node: nodes.Call) -> str:
        own = node.name in self.program.functions and node.method_of is None
        named = [f"{'v_' if own else ''}{key}={self._expression(value)}" for key, value in node.named]
        return ", ".join([*map(self._expression, node.positional), *named])


# -- walking the tree -----------------------------------------------------------------------------------------

_BRANCHING = (nodes.If, nodes.While, nodes.Return, nodes.Word, nodes.Handle)


def _price(node: nodes.Node | None) -> int:
    """Return the price of a statement or expression, without its inner blocks, which pay separately."""
    if node is None or isinstance(node, nodes.Function):
        return 0
    if isinstance(node, nodes.If):
        return sum(1 + _price(condition) for condition, _ in node.branches)
    if isinstance(node, nodes.While):
        return 1 + _price(node.condition)
    return sum(_own_price(part) for part in _walk(node))


def _own_price(node: nodes.Node) -> int:
    if isinstance(node, nodes.Call):
        return price(node.name)
    return 4 if isinstance(node, nodes.Binary | nodes.Index | nodes.Run) else 1


def _walk(node: object, *, into_functions: bool = False) -> Iterator[nodes.Node]:
    if isinstance(node, tuple):
        for item in node:
            yield from _walk(item, into_functions=into_functions)
    elif isinstance(node, nodes.Node):
        yield node
        if isinstance(node, nodes.Function) and not into_functions:
            return
        for part in _parts(type(node)):
            value: Any = getattr(node, part)
            if isinstance(value, (nodes.Node, tuple)):
                yield from _walk(value, into_functions=into_functions)


def _parts(kind: type[nodes.Node]) -> tuple[str, ...]:
    """Return the names of a node's fields, without its position."""
    found = _PARTS.get(kind)
    if found is None:
        found = _PARTS[kind] = tuple(field.name for field in fields(kind))[2:]
    return found


def _functions(body: tuple[nodes.Node, ...]) -> list[nodes.Function]:
    return [node for node in _walk(body, into_functions=True) if isinstance(node, nodes.Function)]


def _assigned(body: tuple[nodes.Node, ...]) -> Iterator[str]:
    for node in _walk(body):
        if isinstance(node, nodes.Assign) and isinstance(node.target, nodes.Name) and node.scope != "local":
            yield node.target.name


def _declared_global(body: tuple[nodes.Node, ...]) -> Iterator[str]:
    return _declared(body, "global")


def _declared_local(body: tuple[nodes.Node, ...]) -> Iterator[str]:
    return _declared(body, "local")


def _declared(body: tuple[nodes.Node, ...], scope: str) -> Iterator[str]:
    for node in _walk(body):
        if isinstance(node, nodes.Assign) and isinstance(node.target, nodes.Name) and node.scope == scope:
            yield node.target.name


def _changed_inside(body: tuple[nodes.Node, ...]) -> Iterator[str]:
    for node in _walk(body):
        if isinstance(node, nodes.Assign) and isinstance(node.target, nodes.Index | nodes.Member):
            base: nodes.Node = node.target
            while isinstance(base, nodes.Index | nodes.Member):
                base = base.base
            if isinstance(base, nodes.Name):
                yield base.name


def _calls(body: tuple[nodes.Node, ...]) -> Iterator[str]:
    started = {id(node.call) for node in _walk(body) if isinstance(node, nodes.Run)}
    for node in _walk(body):
        if isinstance(node, nodes.Call) and node.method_of is None and id(node) not in started:
            yield node.name


def _joins(body: tuple[nodes.Node, ...]) -> bool:
    return any(isinstance(node, nodes.Handle | nodes.Word) and node.word in ("join", "pause") for node in _walk(body))
