"""The register of mutants: each with the check that finds it, and what that check reports."""

from __future__ import annotations

import pytest

from lsds.testing import cases

CAUGHT, CAUGHT_DEVICES, CAUGHT_FAULTS, CAUGHT_WIRE_MOCKS, CAUGHT_STUDIES, CAUGHT_COMMANDS = {}, {}, {}, {}, {}, {}
LEFT = []
"""Calls that release what mutants have left behind."""


def caught(kind, check, match):
    """Register an algorithm with one mistake."""
    return _registered(CAUGHT, kind, check, match)


def caught_device(kind, check, match):
    """Register a device with one mistake."""
    return _registered(CAUGHT_DEVICES, kind, check, match)


def caught_fault(check, match):
    """Register a fault with one mistake."""
    return _registered(CAUGHT_FAULTS, check, match)


def caught_wire_mock(check, match):
    """Register a wire mock with one mistake."""
    return _registered(CAUGHT_WIRE_MOCKS, check, match)


def caught_study(check, match):
    """Register a study with one mistake."""
    return _registered(CAUGHT_STUDIES, check, match)


def caught_command(check, match):
    """Register a command with one mistake."""
    return _registered(CAUGHT_COMMANDS, check, match)


def require_caught(bench, check, match, guide):
    """Fail unless a check finds the mistake of a bench's mutant, with a remedy and the section of the guide."""
    (case,) = [case for case in cases(bench) if case.check is check]
    with pytest.raises(AssertionError, match=match) as found:
        case()
    message = str(found.value)
    assert "; " in message.split("\nrule: ")[0], f"no remedy in: {message}"
    assert f"\nguide: {guide}" in message


def _registered(register, *entry):
    def add(mutant):
        register[mutant] = entry
        return mutant

    return add
