"""Overlap by sorted gaps: the same as by counting on the lattice."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.gel.overlap import Overlap


@given(
    seed=st.integers(0, 999),
    rows=st.integers(1, 7),
    columns=st.integers(1, 7),
    levels=st.integers(1, 40),
    indentation=st.integers(-2, 45),
)
def test_sorted_gaps_count_what_lies_under_the_object(seed, rows, columns, levels, indentation):
    # Whole numbers, so that equal gaps, and gaps that equal the indentation, are frequent.
    gap = np.random.default_rng(seed).integers(0, levels, (rows, columns)).astype(float)
    under = gap < indentation
    overlap = Overlap(gap)
    assert overlap.points(indentation) == under.sum()
    assert overlap.depth_m(indentation) == pytest.approx(np.maximum(indentation - gap, 0).sum())
    assert overlap.edges(indentation) == (under[1:] != under[:-1]).sum() + (under[:, 1:] != under[:, :-1]).sum()
    assert np.array_equal(overlap.columns_m < indentation, under.any(axis=0))
    assert np.array_equal(overlap.rows_m < indentation, under.any(axis=1))
