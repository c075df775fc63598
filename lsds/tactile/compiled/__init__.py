"""Inner loops of the frame path, compiled by numba: the same mathematics as the portable modules state, and faster.

Each module here is named after the portable one whose results it reproduces; tests hold the two to a tolerance. This
module imports nothing heavy. The others need numba, and are imported if `use_compiled` says so.
"""

from __future__ import annotations

import sys
from functools import cache
from typing import Literal

from lsds.errors import MissingExtra
from lsds.support.extras import importable, require


def use_compiled(arithmetic: Literal["auto", "compiled", "portable"]) -> bool:
    """Return whether to use the compiled functions, for the option `tactile.arithmetic`.

    Compiles them on the first use on a machine, and loads them on later ones. Raises MissingExtra.
    """
    if arithmetic == "portable" or (arithmetic == "auto" and not importable("numba")):
        return False
    require("numba", extra="fast", purpose="tactile.arithmetic = 'compiled'")
    try:
        _require_compiler()
        from lsds.tactile.compiled.prepare import prepare

        prepare()
    except Exception as error:
        reason = f"numba does not work here: {type(error).__name__}: {str(error).partition(chr(10))[0]}"
        if arithmetic == "compiled":
            remedy = "repair it, or set tactile.arithmetic = 'portable'"
            raise MissingExtra(f"tactile.arithmetic = 'compiled': {reason} ({remedy})") from error
        _notice(reason)
        return False
    return True


def _require_compiler() -> None:
    """Raise RuntimeError if numba has to interpret its functions, which takes hundreds of times as long."""
    from numba import config

    if config.DISABLE_JIT:
        raise RuntimeError("NUMBA_DISABLE_JIT is set")


@cache
def _notice(reason: str) -> None:
    print(f"the frame path is not compiled: {reason}", file=sys.stderr, flush=True)
