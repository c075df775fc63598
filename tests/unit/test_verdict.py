"""The verdict on a run: each outcome and each reason, on figures and truths made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from lsds import errors
from lsds.cli.signals import Terminated
from lsds.config import load_config
from lsds.contracts import CellTruth
from lsds.errors import SafetyStop
from lsds.session.verdict import EXIT_CODES, Ending, Outcome, judge

NEEDED_N = 2.8
LIFTED = Ending(done=True, released=False, grips=True, rose=True, began_ns=0)


def truth(at_s, normal_n=4.0, *, aperture_m=0.024, supported=False, dropped=False, slip_m=0.0):
    return CellTruth(
        round(at_s * 1e9), (0.0, 0.0), (0.0, 0.0), 0.0, slip_m, 1.0, normal_n, 1.4, NEEDED_N, aperture_m, 0.0,
        supported, dropped,
    )  # fmt: skip


def figures(**own):
    usual = {
        "slip_distance_m": 0.001,
        "slip_onset_s": 0.1,
        "required_normal_force_n": NEEDED_N,
        "peak_normal_force_n": 4.0,
        "steady_normal_force_n": 4.2,
        "detection": {"onset_delay_s": 0.05},
        "simulation": {"invalid": []},
    }
    return usual | own


HELD = (truth(0.0, 3.0, supported=True), truth(0.5, 3.0), truth(2.0))
WEAK = (truth(0.0, 1.5, supported=True), truth(0.5, 1.5), truth(2.0, 0.0, supported=True))


def verdict(truths, *overrides, ending=LIFTED, fault=None, **own):
    return judge(figures(**own), truths, load_config(None, overrides), ending, fault)


def test_an_object_in_the_grip_is_held_with_the_numbers_of_its_grip():
    found = verdict(HELD)
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.HELD, 0, True)
    assert found.sentence == "held: with 1.5 times the greatest force needed, after 1 mm of slip"
    assert found.grip_over_needed == pytest.approx(4.2 / NEEDED_N)
    assert found.detection_delay_s == 0.05
    assert found.slip_margin == pytest.approx(1 - 0.001 / 0.03)


@pytest.mark.parametrize(("load_n", "remarks"), [(0.01, True), (0.5, False), (math.nan, False)])
def test_a_lift_without_a_load_is_held_with_a_remark(load_n, remarks):
    """On a real cell contact remains, too, if the object stays behind and the fingers touch each other."""
    found = verdict((), ending=replace(LIFTED, contacts=(0.2, 0.2), load_n=load_n))
    assert found.outcome is Outcome.HELD
    assert ("less than 0.06 N" in found.reason) is remarks


def test_a_slip_beyond_the_limit_is_too_far():
    found = verdict(HELD, slip_distance_m=0.031)
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.SLIPPED, 9, True)
    assert found.reason == "31.0 mm of slip, the limit is 30 mm (task.max_slip_m)"
    late = verdict(HELD, slip_distance_m=0.031, detection={"onset_delay_s": 1.2})
    assert late.reason.endswith("(task.max_slip_m); slip was not detected for 1.2 s")
    assert verdict(HELD, "task.max_slip_m=0.04", slip_distance_m=0.031).outcome is Outcome.HELD


def test_a_slip_that_the_job_wants_is_not_too_far():
    wanted = Ending(done=True, released=False, grips=True, rose=True, began_ns=0, slip_wanted=True)
    found = verdict(HELD, ending=wanted, slip_distance_m=0.031)
    assert (found.outcome, found.slip_margin) == (Outcome.HELD, None)
    assert verdict(HELD, ending=wanted).reason.endswith("after 1 mm of slip that the job wanted")


def test_a_grip_far_above_the_needed_one_crushes():
    firm = (*HELD[:2], truth(1.0, 15.4), HELD[2])
    found = verdict(firm)
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.CRUSHED, 10, True)
    assert found.reason == (
        "the peak grip of 15.4 N a finger is 5.1 times the first grip of 3 N, the limit is 5 (task.max_grip_ratio)"
    )
    assert found.force_margin < 0
    assert verdict(firm, "task.max_grip_ratio=6").outcome is Outcome.HELD
    squeezed = (truth(0.0, 8.0, supported=True), truth(0.5, 8.0), truth(1.0, 44.0), HELD[2])
    assert verdict(squeezed).reason.startswith(
        "the peak grip of 44 N a finger is 5.5 times the first grip of 8 N, the l"
    )
    # A first squeeze that is firm already is the job's, and no failure of the controller.
    assert verdict((truth(0.0, 15.4, supported=True), truth(0.5, 15.4), truth(2.0, 15.4))).outcome is Outcome.HELD


def test_a_fragile_object_is_crushed_by_a_grip_above_its_own_limit():
    found = verdict(HELD, "task.fragile_n=3.5")
    assert found.sentence == (
        "crushed: the peak grip of 4 N a finger exceeds the 3.5 N that the object withstands (task.fragile_n)"
    )
    assert verdict((*HELD[:2], truth(1.0, 15.4), HELD[2]), "task.fragile_n=20").outcome is Outcome.HELD


def test_a_simulation_that_is_not_valid_holds_nothing_for_certain():
    found = verdict(HELD, simulation={"invalid": ["indentation is 31% of the thickness"]})
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.OUTSIDE, 12, True)
    assert "indentation is 31% of the thickness" in found.sentence
    lost = verdict(WEAK, simulation={"invalid": ["indentation is 31% of the thickness"]})
    assert lost.outcome is Outcome.DROPPED
    assert lost.reason.endswith("; outside the model's validity: indentation is 31% of the thickness")
    # A cell that reports no validity, or no fidelity at all, is not outside of it.
    assert verdict(HELD, simulation={"warnings": []}).outcome is verdict(HELD, simulation=None).outcome is Outcome.HELD


OPENING = (*WEAK[:2], truth(1.0, 0.5, aperture_m=0.027), WEAK[2])
STRONG = (*HELD[:2], truth(1.0, 4.0), truth(2.0, 0.0, supported=True))
BACK = Ending(done=True, released=False, grips=True, rose=True, began_ns=0, held_back=40)


@pytest.mark.parametrize(
    ("truths", "overrides", "own", "reason"),
    [
        (OPENING, (), {}, "the fingers opened by 3 mm during the lift"),
        (
            WEAK,
            ("task.fragile_n=1.5",),
            {"ending": BACK},
            "the force limit of 1.5 N (task.fragile_n) cannot hold 2.8 N; it held the fingers back in 40 frames",
        ),
        (WEAK, ("task.grip_force_n=2",), {}, "the force limit of 2 N (task.grip_force_n) cannot hold 2.8 N"),
        (
            WEAK,
            ("safety.max_grip_force_n=2",),
            {},
            "the force limit of 2 N (safety.max_grip_force_n) cannot hold 2.8 N",
        ),
        (
            WEAK,
            ("task.fragile_n=3",),
            {"ending": BACK},
            "task.fragile_n = 3 N kept the fingers from closing further in 40 frames",
        ),
        (
            WEAK,
            ("controller.enabled=false",),
            {},
            "the controller is off, and the grip reached 1.5 N of the 2.8 N needed",
        ),
        (STRONG, ("controller.enabled=false",), {}, "the controller is off"),
        (
            WEAK,
            (),
            {"detection": {"onset_delay_s": 1.2}},
            "slip was not detected for 1.2 s, and the grip reached 1.5 N of the 2.8 N needed",
        ),
        (STRONG, (), {"detection": {"onset_delay_s": 1.2}}, "slip was not detected for 1.2 s"),
        (
            STRONG,
            (),
            {"detection": {"onset_delay_s": None}},
            "slip was never detected in the 1.9 s from its onset to the end",
        ),
        (WEAK, (), {}, "the grip reached 1.5 N of the 2.8 N needed"),
        (
            STRONG,
            (),
            {"slip_distance_m": 0.06},
            "60 mm of slip before the grip of 4 N took effect; needed: 2.8 N",
        ),
    ],
)
def test_a_drop_names_its_cause(truths, overrides, own, reason):
    found = verdict(truths, *overrides, **own)
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.DROPPED, 8, False)
    assert found.reason == reason
    assert found.opened == (truths is OPENING)


def test_an_object_that_falls_in_the_grasp_is_dropped():
    fallen = (truth(0.0, supported=True), truth(1.0, 0.0, dropped=True))
    early = Ending(done=True, released=False, grips=True, rose=False, began_ns=None)
    none = {"slip_distance_m": None, "required_normal_force_n": None, "peak_normal_force_n": None}
    assert verdict(fallen, ending=early, **none).sentence == "dropped: the object fell before the lift"


def test_an_object_that_was_never_gripped_is_not_lifted():
    apart = [truth(at, 0.0, aperture_m=0.04, supported=True) for at in (0.0, 1.0)]
    found = verdict(apart)
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.NOT_LIFTED, 11, False)
    assert found.reason == "the fingers never touched the object; their aperture was 40 mm"


@pytest.mark.parametrize(
    ("contacts", "held_back", "sentence"),
    [
        ((0.2, math.nan, 0.19), 0, "held: contact remained until the end"),
        ((0.2, 0.02), 0, "dropped: contact fell to 10% of that before the lift"),
        ((0.2, 0.02), 7, "dropped: task.fragile_n = 2 N kept the fingers from closing further in 7 frames"),
        ((0.001, 0.2), 0, "not lifted: the fingers touched nothing: contact covered 0.1% of the image before the lift"),
        ((), 0, "ended: the run had no grip to judge"),
    ],
)
def test_without_a_truth_the_contact_decides(contacts, held_back, sentence):
    ending = Ending(True, False, True, rose=True, began_ns=0, contacts=contacts, held_back=held_back)
    unknown = dict.fromkeys(
        ("slip_distance_m", "required_normal_force_n", "peak_normal_force_n", "steady_normal_force_n", "simulation")
    )
    found = verdict((), "task.fragile_n=2", ending=ending, **unknown)
    assert found.sentence == sentence
    assert (found.grip_over_needed, found.slip_margin, found.force_margin) == (None, None, None)


def test_an_object_that_the_job_sets_down_is_released():
    ending = Ending(done=True, released=True, grips=True, rose=True, began_ns=0)
    found = verdict(WEAK, ending=ending)
    assert (found.outcome, found.exit_code) == (Outcome.RELEASED, 0)


@pytest.mark.parametrize(
    ("fault", "code", "sentence"),
    [
        (SafetyStop("sensor: nothing usable"), 7, "stopped: SafetyStop: sensor: nothing usable"),
        (KeyboardInterrupt(), 130, "stopped: a keyboard interrupt"),
        (Terminated(), 143, "stopped: stopped by a request to terminate (SIGTERM)"),
    ],
)
def test_a_run_that_is_stopped_has_the_code_of_what_stopped_it(fault, code, sentence):
    found = verdict(HELD, fault=fault)
    assert (found.outcome, found.exit_code, found.in_grip) == (Outcome.STOPPED, code, False)
    assert found.sentence == sentence


def test_fingers_that_touch_when_they_are_fully_open_are_around_too_wide_an_object():
    ending = Ending(False, False, True, rose=False, began_ns=None, widest_m=0.04)
    wide = [truth(1.0, 9.0, aperture_m=0.04, supported=True)]
    found = verdict(wide, ending=ending, fault=SafetyStop("task: still a touch"))
    assert found.reason == "the object is wider than the gripper opens, 40 mm; SafetyStop: task: still a touch"
    inside = [truth(1.0, 9.0, aperture_m=0.02, supported=True)]
    assert verdict(inside, ending=ending, fault=SafetyStop("late")).reason == "SafetyStop: late"


def test_each_failure_has_an_exit_code_of_its_own():
    taken = {error.exit_code for error in vars(errors).values() if hasattr(error, "exit_code")}
    failures = [code for code in EXIT_CODES.values() if code]
    assert len(failures) == len(set(failures))
    assert not taken & set(failures)
    assert EXIT_CODES.keys() | {Outcome.STOPPED} == set(Outcome)
