from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.support.human import duration, force, length, number, speed


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (20714.2, "20700"),
        (1.03456, "1.03"),
        (0.0352, "0.035"),
        (9.999, "10"),
        (-272.4, "-272"),
        (1e-9, "0"),
        (math.nan, "-"),
    ],
)
def test_a_number_has_three_digits_and_no_exponent(value, text):
    assert number(value) == text


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12))
def test_a_number_is_within_half_a_percent_or_half_a_thousandth(value):
    assert "e" not in number(value)
    assert float(number(value)) == pytest.approx(value, rel=6e-3, abs=6e-4)


def test_quantities_have_the_unit_that_keeps_them_short():
    assert length(0.00103) == "1.03 mm"
    assert speed(0.01005) == "10.1 mm/s"
    assert force(3.822) == "3.82 N"
    assert duration(0.02071) == "20.7 ms"
    assert duration(1.25) == "1.25 s"
    assert length(None) == speed(None) == force(None) == duration(None) == "-"


def test_what_rounds_to_nothing_has_no_sign_and_what_is_unknown_no_unit():
    assert number(-1e-4) == "0"
    assert {length(math.nan), force(math.nan), speed(math.nan), duration(math.nan)} == {"-"}
