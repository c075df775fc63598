"""A line that loses frames: a loss costs as long as answers take, and the gripper is still watched and commanded."""

from __future__ import annotations

import pytest
from lsds_drivers.robotiq.patience import Patience

from lsds.errors import StaleData
from tests.wire.robotiq.rig import CLOCK, FACES, build, nothing_left, options_for, serving, to
from tests.wire.waiting import until

GUARD_S = 0.2
"""`safety.stale_after_s`: a state older than this ends a run."""


def test_patience_is_learned_from_answers():
    patience = Patience(0.015, 0.1)
    assert patience.wait_s == 0.1, "nothing is known yet"
    for _ in range(5):
        patience.answered(0.007)
    assert patience.wait_s == pytest.approx(0.019)
    patience.answered(0.001)
    assert patience.wait_s == pytest.approx(0.019, abs=1e-3), "one quick answer does not make a quick line"
    for _ in range(500):
        patience.answered(0.001)
    assert patience.wait_s == 0.015


def test_patience_grows_where_the_line_has_become_slow():
    patience = Patience(0.015, 0.1)
    patience.answered(0.005)
    waited = []
    for _ in range(12):
        waited.append(patience.wait_s)
        patience.silent()
    assert sum(waited[:8]) < GUARD_S, "as many losses in a row are survived"
    assert waited[-1] == 0.1
    patience.answered(0.06)
    assert patience.wait_s == 0.1
    patience = Patience(0.015, 0.1)
    patience.answered(0.005)
    patience.late()
    assert patience.wait_s > 0.03


@pytest.mark.parametrize("driver", ["hand-e", "hand-e-tcp"])
@pytest.mark.parametrize("probability", [0.05, 0.2])
def test_a_line_that_loses_frames_is_no_reason_to_stop(tmp_path, driver, probability):
    with nothing_left(), serving(tmp_path, activated=True) as mock:
        gripper = build(driver, options_for(driver, mock) | {"stale_after_ms": 1e3 * GUARD_S})
        gripper.connect()
        gripper.arm()
        mock.inject("drop", probability=probability, face=FACES[driver])
        sent = gripper.counts.sent
        until_ns = CLOCK.now() + 2_000_000_000
        step = 0
        while CLOCK.now() < until_ns:
            step += 1
            gripper.command(to(0.02 + 1e-3 * (step % 8), within_s=0.3))
            # Raises StaleData where nothing has come for too long.
            gripper.read()
            CLOCK.sleep_until(CLOCK.now() + 8_000_000)
        assert gripper.counts.timeouts > 3
        assert gripper.counts.sent - sent > 20
        assert gripper.counts.reconnects == 0
        gripper.close()


def test_a_slow_line_is_commanded_too(tmp_path):
    """Where every answer takes longer than two polls, orders still get their turn."""
    with nothing_left(), serving(tmp_path, activated=True, turnaround_ms=40.0) as mock:
        gripper = build("hand-e", options_for("hand-e", mock))
        gripper.connect()
        gripper.arm()
        assert until(lambda: _closes(gripper), 8)
        gripper.close()


def _closes(gripper):
    try:
        gripper.command(to(0.01, within_s=1.0))
        return gripper.read().aperture_m == pytest.approx(0.01, abs=5e-4)
    except StaleData:
        return False
