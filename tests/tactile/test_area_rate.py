"""The rate of the contact area, also if one contact patch stands for several frames."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tactile.scenes import SCALE, make_reference, tracks_of

from lsds.contracts import ContactPatch
from lsds.tactile.feature_sets import NAMES
from lsds.tactile.features import FeatureExtractor
from lsds.tactile.field import FieldBuilder

FRAME_NS = 40_000_000


def area_rates(patches: list[ContactPatch | None]) -> list[float]:
    reference = make_reference()
    builder, extractor = FieldBuilder(reference, SCALE), FeatureExtractor()
    rates = []
    for number, patch in enumerate(patches):
        tracks = tracks_of(reference, np.zeros((reference.count, 2)), number * FRAME_NS, seq=number)
        features = extractor.extract(builder.build(tracks), patch)
        rates.append(float(features.values[NAMES.index("area_rate")]))
    return rates


def patch(area: float) -> ContactPatch:
    return ContactPatch(np.zeros((2, 2), np.float32), 5e-5, area)


@given(st.lists(st.tuples(st.floats(0, 1), st.integers(1, 5)), min_size=2, max_size=6))
def test_the_area_changes_over_the_time_since_it_was_measured(measured):
    rates = area_rates([each for area, frames in measured for each in [patch(area)] * frames])
    at = 0
    for (before, frames), (now, _) in pairwise(measured):
        at += frames
        assert rates[at] == pytest.approx((now - before) / (0.04 * frames), abs=1e-9)
    assert math.isnan(rates[0])


def test_without_a_contact_there_is_no_rate_until_two_are_known():
    rates = area_rates([patch(0.1), None, patch(0.2), patch(0.3)])
    assert [math.isnan(rate) for rate in rates] == [True, True, True, False]
    assert rates[-1] == pytest.approx(0.1 / 0.04)
