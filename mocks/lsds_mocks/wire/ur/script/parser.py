"""Recursive-descent parser from tokens to a syntax tree.

Two properties of the language determine its structure. Statements need no separator, and an assignment's value may
begin on the next line, but an expression ends with its line unless a bracket is open; the next line then begins a
statement. `p[` begins a pose if six values follow; otherwise it is an element of a variable named p.
"""

from __future__ import annotations

import math

from lsds_mocks.wire.ur.script import nodes
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.lexer import Token, tokens
from lsds_mocks.wire.ur.script.operations import wrapped

_LEVELS: tuple[tuple[str, ...], ...] = (
    ("or", "xor"),
    ("and",),
    ("==", "!=", "<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "%"),
)
_WORDS = ("break", "continue", "halt", "pause", "enter_critical", "exit_critical")
POSE_SIZE = 6
"""Number of elements of a pose."""
MOST_NESTED = 64
"""Maximum nesting depth of brackets, blocks and signs, which keeps the recursive parser and Python's compiler within
their limits."""

_OPENING, _CLOSING = frozenset("([{"), frozenset(")]}")
_SIGNS = frozenset(("-", "+", "not"))
_BLOCKS = frozenset(("def", "sec", "thread", "if", "while"))
_LOWEST = "2147483648"
"""2^31, which is a valid integer only after a minus sign."""


def parse(text: str) -> tuple[nodes.Node, ...]:
    """Return the statements of a script. Raises ScriptError with line and column."""
    stream = tokens(text)
    _require_shallow(stream)
    parser = _Parser(stream)
    statements = parser.block()
    parser.expect_end()
    return statements


class _Parser:
    def __init__(self, stream: list[Token]) -> None:
        self._stream = stream
        self._at = 0
        self._open = 0

    # -- statements ---------------------------------------------------------------------------------------

    def block(self) -> tuple[nodes.Node, ...]:
        found: list[nodes.Node] = []
        while not self._is("end", "elif", "else") and self._here.kind != "end":
            if self._take(";"):
                continue
            found.append(self._statement())
        return tuple(found)

    def expect_end(self) -> None:
        if self._here.kind != "end":
            raise self._error()

    def _statement(self) -> nodes.Node:
        here = self._here
        if self._is("def", "thread", "sec"):
            return self._function()
        if self._take("if"):
            return self._if(here)
        if self._take("while"):
            condition = self._condition()
            body = self.block()
            self._expect("end")
            return nodes.While(here.line, here.column, condition, body)
        if self._take("return"):
            ends = self._here.first or self._is("end", "elif", "else") or self._here.kind == "end"
            return nodes.Return(here.line, here.column, None if ends else self._expression())
        if self._is(*_WORDS):
            return nodes.Word(here.line, here.column, self._next().text)
        if self._is("kill", "join"):
            word = self._next().text
            return nodes.Handle(here.line, here.column, word, self._expression())
        scope = self._next().text if self._is("global", "local") else ""
        value = self._expression()
        if self._take("="):
            if not isinstance(value, nodes.Name | nodes.Index | nodes.Member):
                raise ScriptError(f"syntax_error_on_line:{here.line}:", here.line, here.column)
            return nodes.Assign(here.line, here.column, value, self._expression(), scope)
        if scope:
            raise self._error()
        return nodes.Bare(here.line, here.column, value)

    def _condition(self) -> nodes.Node:
        condition = self._expression()
        self._expect(":")
        return condition

    def _if(self, here: Token) -> nodes.Node:
        branches = [(self._condition(), self.block())]
        otherwise: tuple[nodes.Node, ...] = ()
        while True:
            if self._take("elif"):
                branches.append((self._condition(), self.block()))
            elif self._take("else"):
                self._expect(":")
                otherwise = self.block()
            else:
                self._expect("end")
                return nodes.If(here.line, here.column, tuple(branches), otherwise)

    def _function(self) -> nodes.Function:
        kind = self._next()
        name = self._name()
        self._expect("(")
        parameters: list[tuple[str, nodes.Node | None]] = []
        while not self._take(")"):
            if parameters:
                self._expect(",")
            parameter = self._name().text
            parameters.append((parameter, self._expression() if self._take("=") else None))
        self._expect(":")
        body = self.block()
        self._expect("end")
        return nodes.Function(kind.line, kind.column, kind.text, name.text, tuple(parameters), body)

    # -- expressions --------------------------------------------------------------------------------------

    def _expression(self, level: int = 0) -> nodes.Node:
        if level == len(_LEVELS):
            return self._unary()
        left = self._expression(level + 1) if level != 2 or not self._is("not") else self._unary()
        while self._is(*_LEVELS[level]) and (self._open or not self._here.first):
            operator = self._next()
            # A line may break after an operator.
            right = self._expression(level + 1)
            left = nodes.Binary(operator.line, operator.column, operator.text, left, right)
        return left

    def _unary(self) -> nodes.Node:
        here = self._here
        if self._take("not"):
            return nodes.Unary(here.line, here.column, "not", self._expression(2))
        if self._take("-"):
            if self._here.text == _LOWEST:
                self._next()
                return nodes.Literal(here.line, here.column, -int(_LOWEST))
            return nodes.Unary(here.line, here.column, "-", self._unary())
        if self._take("+"):
            return self._unary()
        return self._postfix()

    def _postfix(self) -> nodes.Node:
        value = self._primary()
        while self._open or not self._here.first:
            here = self._here
            if self._take("["):
                value = nodes.Index(here.line, here.column, value, self._items("]"))
            elif self._take("."):
                field = self._name()
                if self._take("("):
                    positional, named = self._arguments()
                    value = nodes.Call(field.line, field.column, field.text, positional, named, value)
                else:
                    value = nodes.Member(here.line, here.column, value, field.text)
            else:
                break
        return value

    def _primary(self) -> nodes.Node:
        token = self._next()
        line, column = token.line, token.column
        if token.kind == "number":
            return nodes.Literal(line, column, _number(token))
        if token.kind == "string":
            return nodes.Literal(line, column, token.text[1:-1])
        if token.text in ("True", "False") and token.kind == "keyword":
            return nodes.Literal(line, column, token.text == "True")
        if token.text == "run" and token.kind == "keyword":
            call = self._postfix()
            if not isinstance(call, nodes.Call):
                raise ScriptError(f"syntax_error_on_line:{line}:", line, column)
            return nodes.Run(line, column, call)
        if token.text == "(":
            self._open += 1
            value = self._expression()
            self._open -= 1
            self._expect(")")
            return value
        if token.text == "[":
            return nodes.ListOf(line, column, self._items("]"), pose=False)
        if token.kind == "name":
            return self._named(token)
        raise self._error(token)

    def _named(self, token: Token) -> nodes.Node:
        line, column = token.line, token.column
        follows = not self._here.first or self._open > 0
        if token.text == "p" and self._is("[") and follows:
            self._next()
            items = self._items("]")
            if len(items) == POSE_SIZE:
                return nodes.ListOf(line, column, items, pose=True)
            return nodes.Index(line, column, nodes.Name(line, column, "p"), items)
        if follows and self._take("("):
            positional, named = self._arguments()
            if token.text == "struct" and not positional:
                return nodes.Struct(line, column, named)
            return nodes.Call(line, column, token.text, positional, named)
        return nodes.Name(line, column, token.text)

    def _arguments(self) -> tuple[tuple[nodes.Node, ...], tuple[tuple[str, nodes.Node], ...]]:
        positional: list[nodes.Node] = []
        named: list[tuple[str, nodes.Node]] = []
        self._open += 1
        while not self._is(")"):
            if positional or named:
                self._expect(",")
            following = self._stream[self._at + 1] if self._here.kind != "end" else self._here
            if self._here.kind == "name" and following.text == "=" and following.kind == "symbol":
                key = self._next().text
                self._next()
                named.append((key, self._expression()))
            else:
                positional.append(self._expression())
        self._open -= 1
        self._expect(")")
        return tuple(positional), tuple(named)

    def _items(self, closing: str) -> tuple[nodes.Node, ...]:
        items: list[nodes.Node] = []
        self._open += 1
        while not self._is(closing):
            if items:
                self._expect(",")
            items.append(self._expression())
        self._open -= 1
        self._expect(closing)
        return tuple(items)

    # -- tokens -------------------------------------------------------------------------------------------

    @property
    def _here(self) -> Token:
        return self._stream[self._at]

    def _next(self) -> Token:
        token = self._here
        if token.kind != "end":
            self._at += 1
        return token

    def _is(self, *texts: str) -> bool:
        return self._here.kind in ("keyword", "symbol") and self._here.text in texts

    def _take(self, text: str) -> bool:
        if self._is(text):
            self._at += 1
            return True
        return False

    def _expect(self, text: str) -> None:
        if not self._take(text):
            raise self._error()

    def _name(self) -> Token:
        if self._here.kind != "name":
            raise self._error()
        return self._next()

    def _error(self, token: Token | None = None) -> ScriptError:
        at = token or self._here
        return ScriptError(f"syntax_error_on_line:{at.line}:", at.line, at.column)


def _require_shallow(stream: list[Token]) -> None:
    """Raise ScriptError if more than `MOST_NESTED` brackets, blocks and successive signs are open anywhere."""
    brackets = blocks = signs = 0
    for token in stream:
        text = token.text
        signs = signs + 1 if text in _SIGNS else 0
        if token.kind == "symbol":
            brackets += (text in _OPENING) - (text in _CLOSING)
        elif token.kind == "keyword":
            blocks += (text in _BLOCKS) - (text == "end")
        if brackets + blocks + signs > MOST_NESTED:
            raise ScriptError(f"syntax_error: nested more than {MOST_NESTED} deep", token.line, token.column)


def _number(token: Token) -> float | int:
    """Return a literal's value. A hexadecimal pattern has 32 bits; a number that exceeds an integer is a float."""
    text = token.text
    if text[:2] in ("0x", "0X"):
        return wrapped(int(text, 16))
    number = float(text)
    if not math.isfinite(number):
        raise ScriptError(f"syntax_error_on_line:{token.line}:", token.line, token.column)
    return int(number) if text.isdigit() and number < 2**31 else number
