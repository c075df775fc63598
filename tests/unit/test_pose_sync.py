"""Time synchronisation and velocity of poses: pure functions, tried on anything."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lsds.contracts import Pose, PoseSample
from lsds.pose_sync import RecentSamples, around, interpolated, nearest, pairs, slerp
from lsds.pose_velocity import PoseVelocity

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


@given(TIMES, st.integers(-10, 10**6 + 10), st.integers(0, 10**5))
def test_the_two_around_leave_nothing_between(times, t_ns, slop_ns):
    found = around(samples(times), t_ns, slop_ns)
    if found is None:
        assert t_ns not in times
        return
    early, late = (sample.t_ns for sample in found)
    assert t_ns - slop_ns <= early <= t_ns <= late <= t_ns + slop_ns
    assert not [t for t in times if early < t < late]
    assert early in times
    assert late in times


@given(TIMES, TIMES, st.integers(0, 10**5))
def test_pairs_use_each_sample_once_and_keep_the_order(times, wanted, slop_ns):
    found = pairs(samples(times), wanted, slop_ns)
    assert len(found) == len(wanted)
    used = [sample.t_ns for sample in found if sample is not None]
    assert used == sorted(set(used))
    assert all(sample is None or abs(sample.t_ns - t) <= slop_ns for sample, t in zip(found, wanted, strict=True))


@given(TIMES, st.integers(0, 10**5))
def test_a_stream_pairs_with_itself(times, slop_ns):
    assert [sample.t_ns for sample in pairs(samples(times), times, slop_ns)] == times


def test_poses_at_60_hz_and_frames_at_25():
    poses = samples([round(n * 1e9 / 60) for n in range(60)])
    frames = [round(n * 4e7) + 3 * MS for n in range(24)]
    assert all(abs(p.t_ns - t) <= 9 * MS for p, t in zip(pairs(poses, frames, 9 * MS), frames, strict=True))


def test_recent_samples_forget_the_oldest_and_take_no_older():
    recent = RecentSamples(3)
    for t in (10, 20, 15, 30, 40):
        recent.add(PoseSample(t, t, {}))
    assert recent.nearest(10, 5) is None
    assert recent.nearest(16, 5).t_ns == 20
    assert [s.t_ns for s in recent.around(33, 20)] == [30, 40]


UNIT = st.lists(st.floats(-1, 1), min_size=4, max_size=4).map(np.array).filter(lambda q: np.linalg.norm(q) > 0.2)


@given(UNIT, UNIT, st.floats(0, 1))
def test_slerp_goes_the_short_way_at_constant_rate(one, other, share):
    a, b = (tuple((q / np.linalg.norm(q)).tolist()) for q in (one, other))
    cosine = abs(float(np.dot(a, b)))
    assume(cosine > 1e-3)
    mixed = slerp(a, b, share)
    assert abs(math.hypot(*mixed) - 1) < 1e-9
    whole = 2 * math.acos(min(1.0, cosine))
    part = 2 * math.acos(min(1.0, abs(float(np.dot(a, mixed)))))
    assert abs(part - share * whole) < 1e-5


def test_positions_go_straight():
    half = interpolated(Pose((0.0, 1.0, 2.0)), Pose((2.0, 1.0, 0.0)), 0.5)
    assert half.position_m == (1.0, 1.0, 1.0)
    assert half.quaternion_xyzw == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize("time_constant_s", [0.0, 0.03, 0.1])
def test_the_lag_is_the_one_told(time_constant_s):
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


def test_a_gap_begins_anew_and_an_old_sample_is_ignored():
    velocity = PoseVelocity(0.05, gap_s=0.25)
    assert velocity.update(0, (0.0, 0.0, 0.0)) is None
    assert velocity.update(10 * MS, (0.01, 0.0, 0.0)).velocity_m_s[0] == pytest.approx(1.0)
    assert velocity.update(10 * MS, (9.0, 0.0, 0.0)).velocity_m_s[0] == pytest.approx(1.0)
    assert velocity.update(500 * MS, (1.0, 0.0, 0.0)) is None
    assert velocity.update(510 * MS, (1.02, 0.0, 0.0)).velocity_m_s[0] == pytest.approx(2.0)
    velocity.reset()
    assert velocity.update(520 * MS, (0.0, 0.0, 0.0)) is None
