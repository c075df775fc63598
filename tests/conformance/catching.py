"""The register of mutants: each with its kind, the check that finds it, and what that check reports."""

from __future__ import annotations

CAUGHT = {}


def caught(kind, check, match):
    """Register a class with one mistake."""

    def register(mutant):
        CAUGHT[mutant] = (kind, check, match)
        return mutant

    return register


CAUGHT_DEVICES = {}
LEFT = []
"""Calls that release what mutants have left behind."""


def caught_device(kind, check, match):
    """Register a class of devices with one mistake."""

    def register(mutant):
        CAUGHT_DEVICES[mutant] = (kind, check, match)
        return mutant

    return register


CAUGHT_FAULTS = {}
CAUGHT_WIRE_MOCKS = {}


def caught_fault(check, match):
    """Register a fault with one mistake."""

    def register(mutant):
        CAUGHT_FAULTS[mutant] = (check, match)
        return mutant

    return register


def caught_wire_mock(check, match):
    """Register a wire mock with one mistake."""

    def register(mutant):
        CAUGHT_WIRE_MOCKS[mutant] = (check, match)
        return mutant

    return register
