"""Tracebacks keep lines, and nothing that the functions on the way referred to."""

from __future__ import annotations

import gc
import traceback
import weakref

import pytest

from lsds.support.tracebacks import forget_locals


class Large:
    """Something whose life can be observed."""


def failed(depth, how):
    """Return an error whose functions each refer to something large, and to the error; weak references to it all."""
    large, alive = Large(), []
    alive.append(weakref.ref(large))
    kept = None
    try:
        if depth:
            kept, below = failed(depth - 1, how)
            alive += below
            raise how(kept)
        raise ValueError("the innermost")
    except Exception as error:
        kept = error
    return kept, alive


def caused(error):
    again = RuntimeError("caused")
    again.__cause__ = error
    return again


def in_context(error):
    again = RuntimeError("in its context")
    again.__context__ = error
    return again


def together(error):
    return ExceptionGroup("several", [error, KeyError("another")])


@pytest.mark.parametrize("how", [in_context, caused, together])
def test_what_an_error_passed_is_free_and_its_lines_stay(how):
    gc.collect()
    gc.disable()
    try:
        error, alive = failed(3, how)
        before = traceback.format_exception(error)
        assert sum(one() is not None for one in alive) == 4, "without this, the tracebacks hold everything"
        forget_locals(error)
        assert sum(one() is not None for one in alive) == 0
        assert traceback.format_exception(error) == before
    finally:
        gc.enable()


def test_functions_that_go_on_keep_their_variables():
    large = Large()
    try:
        raise ValueError("here")
    except ValueError as error:
        forget_locals(error)
    assert isinstance(large, Large)
    forget_locals(None)
