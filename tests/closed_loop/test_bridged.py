"""If no motion can be measured, the last estimate bridges at most three frames of the loop."""

from __future__ import annotations

import lsds
from lsds.contracts import ABSTAINED
from lsds.tactile.bridging import MOST_BRIDGED_FRAMES

SHORT = ["task.lift_s=0.6", "task.hold_s=0.4"]


def test_the_loop_bridges_three_frames_and_then_abstains():
    seen = []
    with lsds.bring_up(overrides=SHORT) as engine:
        measured = engine.rig.estimator.update
        blind = [False]
        engine.rig.estimator.update = lambda observation: ABSTAINED if blind[0] else measured(observation)
        for cycle in engine:
            if blind[0]:
                assert cycle.estimate.abstained, "what was seen is not changed"
                seen.append(cycle.grip)
            elif not cycle.estimate.abstained and cycle.acting:
                blind[0], last = True, cycle.estimate
            if len(seen) == MOST_BRIDGED_FRAMES + 2:
                break
    assert [grip.bridged for grip in seen] == [1, 2, 3, 0, 0]
    assert [grip.estimate.abstained for grip in seen] == [False] * 3 + [True] * 2
    stds = [last.speed_std_m_s, *(grip.estimate.speed_std_m_s for grip in seen[:3])]
    assert stds == sorted(stds)
    assert len(set(stds)) == 4
    assert all(grip.detection.slip is not None for grip in seen), "a detector answers for itself"
