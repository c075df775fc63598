"""Values of the contracts survive a recording exactly; JSON is what viewers accept."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import ArmState, Contact, Grip, GripperSpec, GripperState, Pose, PoseSample, Slide, Twist, Wanted
from lsds.errors import DataError
from lsds.session.recording.codec import from_json, schema_of, to_json

numbers = st.floats(allow_nan=True, allow_infinity=True)
finite = st.floats(allow_nan=False, allow_infinity=False)
vectors = st.tuples(finite, finite, finite)
times = st.integers(0, 2**62)
VALUES = {
    GripperState: st.builds(
        GripperState, times, times, numbers, numbers, moving=st.booleans(), contact=st.sampled_from(Contact)
    ),
    ArmState: st.builds(
        ArmState,
        times,
        times,
        st.builds(Pose, vectors, st.tuples(finite, finite, finite, finite)),
        st.builds(Twist, vectors, vectors),
        st.booleans(),
    ),
    PoseSample: st.builds(PoseSample, times, times, st.dictionaries(st.text(max_size=5), st.builds(Pose, vectors))),
    Wanted: st.builds(
        Wanted,
        st.text(max_size=8),
        st.none() | st.builds(Grip, numbers, numbers, numbers),
        st.booleans(),
        st.none() | st.builds(Twist, vectors, vectors),
        touch_m=numbers,
        slide=st.none() | st.builds(Slide, finite, finite),
    ),
}


def same(one, other):
    """Equality in which NaN equals NaN."""
    return to_json(one) == to_json(other)


@pytest.mark.parametrize("kind", VALUES, ids=lambda kind: kind.__name__)
@given(st.data())
def test_a_value_is_read_as_it_was_written(kind, data):
    value = data.draw(VALUES[kind])
    text = json.dumps(to_json(value), allow_nan=False)
    again = from_json(kind, json.loads(text), "here")
    assert type(again) is kind
    assert same(again, value)


def test_what_is_unknown_or_infinite_has_a_form_that_json_allows():
    assert to_json([math.nan, math.inf, -math.inf]) == [None, "inf", "-inf"]


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (GripperState, {"t_ns": 1}),
        (GripperState, {"t_ns": 1.5, "seq": 0, "aperture_m": 0, "target_m": 0, "moving": True}),
        (GripperState, {"t_ns": 1, "seq": 0, "aperture_m": "wide", "target_m": 0, "moving": True}),
        (GripperState, {"t_ns": 1, "seq": 0, "aperture_m": 0, "target_m": 0, "moving": True, "contact": "perhaps"}),
        (ArmState, [1, 2, 3]),
        (PoseSample, {"t_ns": 1, "seq": 2, "poses": {"a": {"position_m": [1.0]}}}),
    ],
)
def test_json_of_another_form_is_refused_with_its_place(kind, value):
    with pytest.raises(DataError, match=f"there: not a {kind.__name__}"):
        from_json(kind, value, "there")


def test_a_field_that_an_older_file_does_not_have_gets_its_default():
    spec = {"stroke_m": 0.05, "resolution_m": 1e-4, "speed_m_s": [0.1, 0.2], "force_n": [1.0, 2.0]}
    assert from_json(GripperSpec, spec, "here").latency_s == GripperSpec(0.05, 1e-4, (0.1, 0.2), (1.0, 2.0)).latency_s


def test_a_schema_names_every_field():
    assert set(schema_of(GripperState)["properties"]) == {"t_ns", "seq", "aperture_m", "target_m", "moving", "contact"}
