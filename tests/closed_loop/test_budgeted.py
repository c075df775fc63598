"""A budget of time for a frame in the loop: what is left out is stated, the same each time, and replayed."""

from __future__ import annotations

from itertools import pairwise

import pytest

import lsds
from lsds.session.recording.reader import Recording

SCARCE = ["tactile.budget_ms=1.2", "task.lift_s=0.6", "task.hold_s=0.4"]


def test_frames_at_rest_keep_the_last_answers():
    cycles = []
    session = lsds.run(overrides=SCARCE, observe=cycles.append)
    assert not session.truths[-1].dropped
    fingers = [finger for cycle in cycles for finger in cycle.fingers]
    skipped = [finger.skipped for finger in fingers]
    assert session.summary["skipped_frames"] == sum(skipped) > 0.2 * len(skipped)
    for before, now in pairwise(fingers):
        if now.skipped:
            assert now.observation.imprint.known is None
            assert now.detection is before.detection
            assert now.estimate is before.estimate


def test_without_a_budget_nothing_is_left_out_and_a_wide_one_changes_nothing():
    plain, wide = (lsds.run(overrides=[*SCARCE[1:], *budget]).summary for budget in ([], ["tactile.budget_ms=100"]))
    assert plain["skipped_frames"] == wide["skipped_frames"] == 0
    assert plain["slip_distance_m"] == wide["slip_distance_m"]


def test_a_run_within_a_budget_is_the_same_again_and_when_it_is_replayed(tmp_path):
    pytest.importorskip("mcap", reason="recordings need the extra record")
    path = tmp_path / "run.mcap"
    first, second = lsds.run(overrides=SCARCE, record=path), lsds.run(overrides=SCARCE)
    assert first.record.samples == second.record.samples
    assert lsds.replay(path).identical
    left_out = sum(message.topic.endswith("/skipped") for message in Recording(path).messages())
    assert left_out == first.summary["skipped_frames"] > 0


def test_the_first_frame_after_a_new_reference_is_seen_in_full():
    with lsds.bring_up(overrides=SCARCE) as engine:
        line, renewed = engine.lines[0], False
        for cycle in engine:
            if renewed:
                assert not cycle.fingers[0].skipped
                break
            if cycle.fingers[0].skipped:
                renewed = line._retake(cycle.frame)
                assert renewed
    assert renewed


def test_a_frame_in_which_markers_are_lost_is_seen_in_full():
    """Simulated: a tracker that loses a part of the markers again and again, within a budget that leaves out others."""
    fingers = []
    loses = 'faults=[{backend = "tracker-loses", at = "lift", severity = 2}]'
    lsds.run(overrides=[*SCARCE, loses], observe=lambda cycle: fingers.extend(cycle.fingers))
    losing = [now for now in fingers if now.observation.lost_share > 0]
    assert any(now.skipped for now in fingers)
    assert losing
    assert not any(now.skipped for now in losing)


def test_the_imprint_of_a_frame_that_was_left_out_is_computed_only_if_the_next_one_moves():
    counts, full = [], []
    with lsds.bring_up(overrides=SCARCE) as engine:
        computed = engine.lines[0].imprint.durations_ns
        for cycle in engine:
            counts.append(computed.count)
            full.append(not cycle.fingers[0].skipped)
    computed_by = [after - before for before, after in pairwise(counts)]
    # At rest one motion is computed in a frame in full; where something moves again, those left out before, too.
    assert sum(computed_by) < sum(full[1:]) + 4 * sum(count > 1 for count in computed_by)
    assert max(computed_by) <= 4
    left_out = [count for count, seen in zip(computed_by, full[1:], strict=True) if not seen]
    assert not any(left_out)
    assert sum(count > 1 for count in computed_by) < 0.1 * len(computed_by)
