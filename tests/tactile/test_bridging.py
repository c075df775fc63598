"""The last measured slip velocity bridges a few frames, ever less certain, and then abstains."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import ABSTAINED, SlipEstimate
from lsds.tactile.bridging import MOST_BRIDGED_FRAMES, VelocityBridge

MEASURED = SlipEstimate((0.003, -0.004), (1e-3, 2e-3), 0.2, 0.1, 0.005, 1e-3)


def bridge():
    return VelocityBridge(walk_m_s_rts=0.01, walk_rad_s_rts=0.5)


@given(st.lists(st.booleans(), max_size=40), st.floats(1e-3, 0.2))
def test_a_gap_is_bridged_for_three_frames_and_no_longer(measured, dt_s):
    carrier, gap = bridge(), math.inf
    for certain in measured:
        gap = 0 if certain else gap + 1
        estimate, frames = carrier.update(MEASURED if certain else ABSTAINED, dt_s)
        assert estimate.abstained == (gap > MOST_BRIDGED_FRAMES)
        assert frames == (gap if gap <= MOST_BRIDGED_FRAMES else 0)
        assert estimate.abstained or estimate.velocity_m_s == MEASURED.velocity_m_s


@given(st.floats(1e-3, 0.2))
def test_variance_grows_linearly_with_the_time_since_the_measurement(dt_s):
    carrier = bridge()
    carrier.update(MEASURED, dt_s)
    for frames in range(1, MOST_BRIDGED_FRAMES + 1):
        estimate, _ = carrier.update(ABSTAINED, dt_s)
        elapsed = frames * dt_s
        assert estimate.velocity_std_m_s == pytest.approx(
            [math.sqrt(std**2 + 0.01**2 * elapsed) for std in MEASURED.velocity_std_m_s]
        )
        assert estimate.angular_std_rad_s == pytest.approx(math.sqrt(0.1**2 + 0.5**2 * elapsed))
        assert estimate.speed_std_m_s == pytest.approx(math.sqrt(1e-3**2 + 0.01**2 * elapsed))


@pytest.mark.parametrize("dt_s", [math.nan, 0.0, -0.1, math.inf])
def test_an_unknown_interval_ends_the_bridge(dt_s):
    carrier = bridge()
    carrier.update(MEASURED, 0.03)
    assert carrier.update(ABSTAINED, dt_s)[0].abstained
    assert carrier.update(ABSTAINED, 0.03)[0].abstained


def test_a_reset_forgets_the_measurement():
    carrier = bridge()
    carrier.update(MEASURED, 0.03)
    carrier.reset()
    assert carrier.update(ABSTAINED, 0.03) == (ABSTAINED, 0)
