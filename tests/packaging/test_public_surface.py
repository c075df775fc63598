"""A change of the public surface fails here, so that it is intended and in the changelog."""

from __future__ import annotations

from tests.packaging.surface import STORED, surface


def test_the_public_surface_is_the_stored_one():
    now, before = surface(), STORED.read_text(encoding="utf-8").splitlines()
    gone = [line for line in before if line not in now]
    new = [line for line in now if line not in before]
    remedy = "see docs/compatibility.md, then run `python -m tests.packaging.surface` and add a line to CHANGELOG.md"
    assert (gone, new) == ([], []), remedy
