"""Expected errors of a device, with a message that states what came instead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lsds.errors import LsdsError


def assert_raises(call: Callable[[], Any], wanted: type[LsdsError], what: str) -> None:
    """Require that `call` raises `wanted`; `what` names the call in the message."""
    try:
        returned = call()
    except wanted:
        return
    except Exception as error:
        raise AssertionError(f"{what} raised {type(error).__name__} ({error}), not {wanted.__name__}") from error
    raise AssertionError(f"{what} did not raise {wanted.__name__} and returned {returned!r:.120}")
