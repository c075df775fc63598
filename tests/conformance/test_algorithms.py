"""Every installed detector, estimator, tracker, controller and job keeps the contract of its kind."""

from __future__ import annotations

import pytest
from installed import installed_host

from lsds.testing import Bench, cases

KINDS = ("tracker", "detector", "estimator", "controller", "job")
NEEDS_DATA = frozenset({("detector", "onnx"), ("estimator", "onnx")})
"""Backends that cannot be built without a file of the user's."""

HOST = installed_host()
FOUND = [
    backend.spec
    for backend in HOST.backends
    if backend.spec.kind in KINDS and (backend.spec.kind, backend.spec.name) not in NEEDS_DATA
]
VARIANTS = [
    ("controller", "pd", {"release_m_s": 0.005, "release_after_s": 0.2}),
    ("controller", "belief", {"release_m_s": 0.0}),
    ("job", "hold", {"duration_s": 1.0}),
    ("job", "shake", {"corrects": True, "closer_mm": 0.0}),
    ("job", "slide", {"turn_rad_s": 0.5}),
]
"""Options that change what a backend may do."""
VARIED = [case for kind, name, options in VARIANTS for case in cases(Bench(kind, name, options, HOST))]
CASES = [case for spec in FOUND for case in cases(Bench(spec.kind, spec.name, host=HOST))]


def test_every_kind_is_found():
    assert {spec.kind for spec in FOUND} == set(KINDS)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_conformance(case):
    case()


@pytest.mark.parametrize("case", VARIED, ids=lambda case: case.id)
def test_conformance_with_other_options(case):
    case()
