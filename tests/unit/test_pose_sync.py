"""Time synchronisation and velocity of poses, on random input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.collecting.pose_sync import nearest
from lsds_research.collecting.pose_velocity import PoseVelocity

from lsds.contracts import PoseSample

MS = 1_000_000
TIMES = st.lists(st.integers(0, 10**6), max_size=40, unique=True).map(sorted)


def samples(times):
    return [PoseSample(t, n, {}) for n, t in enumerate(times)]


@given(TIMES, st.integers(-10, 10**6 + 10), st.integers(0, 10**5))
def test_the_nearest_is_the_nearest(times, t_ns, slop_ns):
    found = nearest(samples(times), t_ns, slop_ns)
    best = min((abs(t - t_ns) for t in times), default=math.inf)
    if found is None:
        assert best > slop_ns
    else:
        assert abs(found.t_ns - t_ns) == best <= slop_ns


@pytest.mark.parametrize("time_constant_s", [0.0, 0.03, 0.1])
def test_the_lag_is_the_true_one(time_constant_s):
    """Under constant acceleration a lagging velocity equals the true one at an earlier time, and that time is
    reported."""
    velocity = PoseVelocity(time_constant_s)
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.010, 0.030, 120))
    for t in times:
        motion = velocity.update(round(t * 1e9), (0.0, 0.0, 0.5 * 2.0 * t * t))
    assert abs(motion.velocity_m_s[2] - 2.0 * motion.t_ns / 1e9) < 1e-6
    assert motion.t_ns == pytest.approx(times[-1] * 1e9 - motion.lag_s * 1e9, abs=2)


@given(st.floats(-1, 1), st.lists(st.floats(0.001, 0.2), min_size=2, max_size=30))
def test_a_steady_velocity_is_exact_at_any_spacing(speed, gaps):
    velocity, t_ns, motion = PoseVelocity(0.05), 0, None
    for gap in gaps:
        t_ns += round(gap * 1e9)
        motion = velocity.update(t_ns, (speed * t_ns / 1e9, 0.0, 0.0))
    assert motion.velocity_m_s[0] == pytest.approx(speed, abs=1e-6)
    assert 0 < motion.lag_s < 0.4


def test_a_gap_restarts_the_filter_and_an_old_sample_is_ignored():
    velocity = PoseVelocity(0.05, gap_s=0.25)
    assert velocity.update(0, (0.0, 0.0, 0.0)) is None
    assert velocity.update(10 * MS, (0.01, 0.0, 0.0)).velocity_m_s[0] == pytest.approx(1.0)
    assert velocity.update(10 * MS, (9.0, 0.0, 0.0)).velocity_m_s[0] == pytest.approx(1.0)
    assert velocity.update(500 * MS, (1.0, 0.0, 0.0)) is None
    assert velocity.update(510 * MS, (1.02, 0.0, 0.0)).velocity_m_s[0] == pytest.approx(2.0)
    velocity.reset()
    assert velocity.update(520 * MS, (0.0, 0.0, 0.0)) is None
