"""The count of arm commands after the stop."""

from __future__ import annotations

from lsds_research.studies.faults.arm_log import ArmLog, arm_log
from lsds_research.studies.faults.case import Case, _has_arm, run_case
from lsds_research.studies.faults.study import _arm_note

from lsds.contracts import ArmCommand, Twist
from lsds.session.run import run

QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=0.5", "task.hold_s=0.2")
UP = ArmCommand(Twist((0.0, 0.0, 0.01), (0.0, 0.0, 0.0)), 1.0, 0)


class Arm:
    def __init__(self):
        self.sent = []

    def arm(self): ...

    def stop(self): ...

    def command(self, command):
        self.sent.append(command)
        return command


def test_a_planted_move_after_the_stop_is_counted_and_a_stop_is_no_movement():
    log = ArmLog()
    inner = Arm()
    arm = log.around(inner)
    arm.stop()
    arm.arm()
    arm.command(UP)
    assert (log.moves, log.stops, log.moves_after_stop) == (1, 0, 0)
    arm.stop()
    arm.stop()
    arm.command(ArmCommand(Twist(), 1.0, 0))
    assert (log.moves, log.stops, log.moves_after_stop) == (1, 2, 0)
    arm.command(UP)
    assert (log.moves, log.stops, log.moves_after_stop) == (2, 2, 1)
    assert len(inner.sent) == 3


def test_the_log_sees_the_moves_and_the_stop_of_a_run_and_then_is_withdrawn():
    with arm_log() as (name, log):
        session = run(None, [*QUICK, f'faults=[{{backend="camera-frozen", at="lift"}}, {{backend="{name}"}}]'])
    assert session.fault is not None
    assert log.moves > 0
    assert log.stops > 0
    assert log.moves_after_stop == 0


def test_a_case_counts_what_moves_the_arm_after_the_stop():
    row = run_case(Case("belief", "fused", 1, "camera-frozen", 0, "lift", settings=QUICK))
    assert not isinstance(row, str), row
    assert row["arm_moves"] > 0
    assert row["arm_moves_after_stop"] == 0


def test_the_study_prints_the_count_of_moves_after_the_stop():
    rows = [{"arm_moves_after_stop": 0}, {"arm_moves_after_stop": 2}, {"arm_moves_after_stop": None}]
    note = _arm_note(rows)
    assert "arm commands that move, sent after the stop: 2, in 1 of 2 runs" in note
    assert "1 runs without an arm" in note


def test_a_rig_without_an_arm_gets_no_log():
    assert _has_arm(Case("belief", "fused", 1))
    assert not _has_arm(Case("belief", "fused", 1, settings=("arm.backend=none",)))
