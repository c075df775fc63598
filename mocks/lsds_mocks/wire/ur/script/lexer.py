"""Lexer of scripts. Line breaks are not tokens; each token states whether it begins a line."""

from __future__ import annotations

import re
from typing import NamedTuple

from lsds_mocks.wire.ur.script.errors import ScriptError

_WORDS = (
    "def thread sec end if elif else while return break continue global local and or not xor",
    "run kill join halt pause enter_critical exit_critical True False",
)
KEYWORDS = frozenset(word for words in _WORDS for word in words.split())
_TOKEN = re.compile(
    r"""
    (?P<space>[ \t\r]+ | \#[^\n]*)
  | (?P<newline>\n)
  | (?P<number>0[xX][0-9a-fA-F]+ | (?:\d+\.\d* | \.\d+ | \d+)(?:[eE][+-]?\d+)?)
  | (?P<name>[A-Za-z_]\w*)
  | (?P<string>"[^"\n]*")
  | (?P<symbol>==|!=|<=|>=|[-+*/%()\[\]{},:=<>.;])
    """,
    re.VERBOSE,
)
_LABEL = re.compile(r"^[ \t]*\$[^\n]*", re.MULTILINE)


class Token(NamedTuple):
    """`kind` is number, name, string, keyword, symbol or end; `first` is true if it begins a line."""

    kind: str
    text: str
    line: int
    column: int
    first: bool


def tokens(text: str) -> list[Token]:
    """Return all tokens, followed by one of kind `end`. Raises ScriptError for an invalid character."""
    # Lines that begin with a dollar sign are the pendant's labels of program nodes.
    text = _LABEL.sub("", text)
    found: list[Token] = []
    line, line_start, position, first = 1, 0, 0, True
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise ScriptError(f"syntax_error_on_line:{line}:", line, position - line_start + 1)
        kind, word = match.lastgroup or "", match.group()
        if kind == "newline":
            line, line_start, first = line + 1, match.end(), True
        elif kind != "space":
            if kind == "name" and word in KEYWORDS:
                kind = "keyword"
            found.append(Token(kind, word, line, position - line_start + 1, first))
            first = False
        position = match.end()
    found.append(Token("end", "", line, position - line_start + 1, True))
    return found
