"""The observer's expected slide velocity, from the arm, the support and the estimator."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
from lsds_plugins.controllers.belief import BeliefController, BeliefOptions

from lsds.clock import VirtualClock
from lsds.contracts import ABSTAINED, BuildContext, ContactLoad, Detection, GripEstimate, GripTask, SlipEstimate
from lsds.grip.evidence import Evidence
from lsds.grip.observer import FALLS_M_S, ROUND_ADDS, GripObserver
from lsds.grip.options import GripOptions
from lsds.tactile.carried_load import CarriedLoad

STILL = Detection(False, 0.1, 0.75, 0.9)
FRAME_NS = 40_000_000


def slide_m_s(speeds_m_s, estimate_m_s: float, *, supported: bool) -> float:
    observer = GripObserver(GripOptions(), 0.12)
    estimate = SlipEstimate((estimate_m_s, 0.0), (0.001, 0.001), 0.0, 0.1, estimate_m_s, 0.001)
    grip = None
    for frame, speed_m_s in enumerate(speeds_m_s):
        grip = observer.update(
            GripEstimate(
                t_ns=frame * FRAME_NS, dt_s=0.04, detection=STILL, estimate=estimate, aperture_m=0.03, touch_m=0.031
            ),
            supported=supported,
            speed_m_s=speed_m_s,
        )
    assert grip is not None
    return grip.slip_m_s


def test_a_supported_object_slides_at_the_arm_s_speed_whatever_the_estimate():
    assert slide_m_s([0.01], 0.2, supported=True) == 0.01


def test_the_arm_moves_on_for_a_while_after_a_command_to_wait():
    assert slide_m_s([0.01, 0.0], 0.0, supported=True) == 0.01
    assert slide_m_s([0.01, *[0.0] * 5], 0.0, supported=True) == 0.0


@pytest.mark.parametrize(
    ("arm_m_s", "estimate_m_s", "expected"), [(0.0, 0.0, FALLS_M_S), (0.08, 0.0, 0.08), (0.0, 0.3, 0.3)]
)
def test_a_hanging_object_falls(arm_m_s, estimate_m_s, expected):
    assert slide_m_s([arm_m_s], estimate_m_s, supported=False) == pytest.approx(expected)


@pytest.mark.parametrize("supported", [True, False])
def test_an_arm_of_which_nothing_is_known_is_no_infinite_speed(supported):
    assert math.isfinite(slide_m_s([math.inf], 0.0, supported=supported))


def controlled_m(slip_m_s: float) -> float | None:
    """Return the controller's command for an object that slides in a squeeze of 2 mm."""
    controller = BeliefController(BeliefOptions(), BuildContext(VirtualClock()))
    grip = GripEstimate(
        dt_s=0.04,
        detection=STILL,
        estimate=ABSTAINED,
        commanded_m=0.030,
        touch_m=0.032,
        squeeze_m=0.002,
        load_n=0.5,
        load_n_s=0.0,
        greatest_n=0.5,
        stale=False,
        slips=0.9,
        slip_m_s=slip_m_s,
        required_m=lambda *_: 0.02,
        complete=True,
    )
    return controller.update(grip, GripTask(resolution_m=1e-4))


def test_a_slow_slide_is_answered_by_a_small_step_and_no_slide_by_more_than_its_limit():
    squeezes_m = [0.032 - controlled_m(speed_m_s) for speed_m_s in (0.0, 0.005, 0.02, 1e9)]
    assert squeezes_m == sorted(squeezes_m)
    assert squeezes_m[0] == pytest.approx(0.0021)
    assert squeezes_m[-1] == pytest.approx(0.002 * BeliefOptions().growth)


def loads(frames: list[float | None]) -> list[GripEstimate]:
    """Return what is believed after each frame of one finger; None: it measures no load."""
    observer = GripObserver(GripOptions(), 0.12)
    believed = []
    for k, load_n in enumerate(frames):
        load = None if load_n is None else ContactLoad((0.0, load_n), 0.0, 0.01, 0.001)
        seen = SimpleNamespace(
            finger="sensor", skipped=False, observation=SimpleNamespace(t_ns=k * FRAME_NS, load=load, contact=None)
        )
        at = GripEstimate(
            t_ns=k * FRAME_NS,
            dt_s=0.04,
            detection=Detection(None, math.nan, 0.75, math.nan),
            estimate=ABSTAINED,
            aperture_m=0.030,
            touch_m=0.032,
            fingers=(seen,),
        )
        believed.append(observer.update(at, speed_m_s=0.01))
    return believed


def test_a_load_that_is_not_measured_again_is_no_new_evidence():
    known = [0.0, 0.5, 0.9, 1.0]
    grips = loads([*known, *[None] * 8])
    repeated = loads([*known, *[1.0] * 8])
    assert [grip.load_n for grip in grips] == [grip.load_n for grip in repeated]
    assert grips[-1].stale
    # Friction limits that the last load left open stay open; a load that is measured again and again settles them.
    assert grips[-1].limit_std_n > 0.9 * grips[3].limit_std_n > 0
    assert math.isfinite(grips[-1].limit_n)


def test_a_load_rises_over_the_time_since_it_was_measured():
    assert loads([0.0, 0.5, None, None, 0.8])[-1].load_n_s == pytest.approx(0.3 / 0.12)


def seen_by(name: str, t_ns: int, load: ContactLoad | None, *, skipped: bool = False) -> SimpleNamespace:
    return SimpleNamespace(
        finger=name, skipped=skipped, observation=SimpleNamespace(t_ns=t_ns, load=load, contact=None)
    )


def test_a_normal_force_without_an_aperture_leaves_the_belief_a_probability():
    observer = GripObserver(GripOptions(), 0.12)
    load = ContactLoad((0.0, 0.3), 0.0, 0.01, 0.001, 4.0)
    for k in range(8):
        finger = seen_by("finger", k * FRAME_NS, load)
        grip = observer.update(GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, fingers=(finger,)))
    assert 0 <= grip.slips <= 1


@pytest.mark.parametrize(("skipped", "known"), [(False, True), (True, False)])
def test_a_normal_force_that_stands_for_several_frames_counts_once(skipped, known):
    observer = GripObserver(GripOptions(), 0.12)
    for k in range(4):
        load = ContactLoad((0.0, 0.0), 0.0, 0.01, 0.001, 4.0)
        finger = seen_by("finger", k * FRAME_NS, load, skipped=skipped and k > 0)
        at = {"aperture_m": 0.030, "touch_m": 0.032, "fingers": (finger,)}
        observer.update(GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, **at))
    spread = GripOptions().spread
    limit_n, std_n = observer.belief.limit_n(2.0)
    assert (std_n / limit_n < 0.8 * spread) is known


def test_a_finger_without_a_zero_makes_no_load_fresh():
    carried = CarriedLoad()
    load = ContactLoad((0.0, 0.5), 0.0, 0.01, 0.001)
    carried.take(0, [seen_by("a", 0, load)])
    late_ns = 10 * FRAME_NS
    carried.take(late_ns, [seen_by("a", late_ns, None), seen_by("b", late_ns, load)])
    assert carried.stale
    assert not carried.fresh


def test_a_load_that_is_first_measured_late_has_no_zero():
    """After 2 s in which the markers were lost, the first load of the only finger counted as that of an empty grip."""
    carried = CarriedLoad()
    for k in range(50):
        carried.take(k * FRAME_NS, [seen_by("a", k * FRAME_NS, None)])
    carried.take(50 * FRAME_NS, [seen_by("a", 50 * FRAME_NS, ContactLoad((0.0, 1.0), 0.0, 0.01, 0.001))])
    assert not carried.fresh
    assert math.isnan(carried.now_n)


@pytest.mark.parametrize("measured", [True, False])
def test_the_load_may_rise_by_all_of_the_arm_s_way_since_the_last_load(measured, monkeypatch):
    moved_mm = []
    monkeypatch.setattr(
        "lsds.grip.belief.GripBelief.update", lambda belief, *seen, faint: moved_mm.append(seen[-1]), raising=True
    )
    observer = GripObserver(GripOptions(), 0.12)
    for k in range(4):
        load = ContactLoad((0.0, 0.0 if k == 0 else 0.5), 0.0, 0.01, 0.001) if measured or k in {0, 3} else None
        at = {"aperture_m": 0.030, "touch_m": 0.032, "fingers": (seen_by("finger", k * FRAME_NS, load),)}
        grip = GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, estimate=ABSTAINED, **at)
        observer.update(grip, speed_m_s=0.01)
    assert moved_mm[-1] == pytest.approx(0.4 if measured else 1.2)


@pytest.mark.parametrize("early_mm", [0.0, 1.1])
def test_the_normal_force_shows_that_a_touch_was_noticed_too_early(early_mm):
    observer, grip, power = GripObserver(GripOptions(), 0.12), None, GripOptions().power
    for k, beyond_mm in enumerate([0.4] * 5 + [0.7] * 5 + [1.2] * 5 + [2.0] * 5):
        load = ContactLoad((0.0, 0.0), 0.0, 0.01, 0.001, 1.5 * beyond_mm**power)
        aperture_m = 0.030 - 1e-3 * beyond_mm
        at = {"aperture_m": aperture_m, "touch_m": 0.030 + 1e-3 * early_mm}
        fingers = (seen_by("finger", k * FRAME_NS, load),)
        grip = observer.update(
            GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, estimate=ABSTAINED, fingers=fingers, **at),
            speed_m_s=0.0,
        )
    assert grip.touch_m == pytest.approx(0.030, abs=2e-4)
    assert grip.squeeze_m == pytest.approx(2e-3, abs=2e-4)
    # The limit is expected near friction times the normal force, wherever the touch was noticed.
    observer.belief.update(0.5, 1e3 * grip.squeeze_m, 0.04, Evidence(-1.0, -1.0))
    assert observer.belief.limit_n(1e3 * grip.squeeze_m)[0] == pytest.approx(0.5 * 1.5 * 2**power, rel=0.35)


def pressing(normal_n):
    return ContactLoad((0.0, 0.0), 0.0, 0.01, 0.001, normal_n)


def test_a_touch_that_a_job_corrects_counts_from_then_on():
    observer, grip = GripObserver(GripOptions(), 0.12), None
    for k in range(20):
        beyond_mm = 1.0 if k < 10 else 1.6
        at = {"aperture_m": 0.030 - 1e-3 * beyond_mm, "touch_m": 0.0305 if k < 15 else 0.030}
        fingers = (seen_by("finger", k * FRAME_NS, pressing(beyond_mm**1.25)),)
        grip = observer.update(
            GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, estimate=ABSTAINED, fingers=fingers, **at)
        )
    assert grip.touch_m == pytest.approx(0.030)
    assert grip.squeeze_m == pytest.approx(1.6e-3)


def test_a_force_of_another_time_does_not_move_the_touch():
    """Finger a is the one that shows a force; in the rounds of b it is half a frame old."""
    observer, grip = GripObserver(GripOptions(), 0.12), None
    for k in range(60):
        closed_mm = 1.0 + 1.5 * min(max(k - 20, 0) / 20, 1)
        newest = {"a": k - k % 2, "b": k - (k + 1) % 2}
        before_mm = 1.0 + 1.5 * min(max(newest["a"] - 20, 0) / 20, 1)
        loads = {"a": pressing(before_mm**1.25), "b": pressing(math.nan)}
        fingers = [seen_by(name, at * FRAME_NS // 2, loads[name]) for name, at in newest.items() if at >= 0]
        fingers.sort(key=lambda finger: -finger.observation.t_ns)
        grip = observer.update(
            GripEstimate(
                t_ns=k * FRAME_NS // 2,
                dt_s=0.02,
                detection=STILL,
                estimate=ABSTAINED,
                fingers=tuple(fingers),
                aperture_m=0.030 - 1e-3 * closed_mm,
                touch_m=0.030,
            )
        )
    assert grip.touch_m == pytest.approx(0.030, abs=6e-5)


def test_a_normal_force_that_cannot_carry_the_load_is_taken_back():
    limits_n = []
    for normal_n in (0.17, math.nan):
        observer, grip = GripObserver(GripOptions(), 0.12), None
        for k in range(20):
            load = ContactLoad((0.0, 0.0 if k < 8 else 1.9), 0.0, 0.01, 0.001, normal_n)
            at = {"aperture_m": 0.030, "touch_m": 0.0312, "fingers": (seen_by("finger", k * FRAME_NS, load),)}
            grip = observer.update(
                GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, estimate=ABSTAINED, **at), speed_m_s=0.01
            )
        limits_n.append(grip.limit_n)
    assert limits_n[0] == pytest.approx(limits_n[1], rel=0.2)


@pytest.mark.parametrize(("half_length_m", "adds"), [(3e-3, ROUND_ADDS), (9e-3, 0.0), (math.nan, 0.0)])
def test_the_limit_of_a_round_contact_grows_with_a_greater_power(half_length_m, adds, monkeypatch):
    monkeypatch.setattr("lsds.grip.observer.half_length_of", lambda contact: half_length_m)
    observer = GripObserver(GripOptions(), 0.12)
    for k in range(4):
        finger = seen_by("finger", k * FRAME_NS, pressing(2.0))
        at = {"aperture_m": 0.030, "touch_m": 0.032, "fingers": (finger,)}
        observer.update(GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, **at))
    assert observer.belief.power == pytest.approx(GripOptions().power + adds)
    observer.reset()
    assert observer.belief.power == GripOptions().power


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("late_ms", [4, 38, 150])
def test_a_round_that_ends_before_the_last_one_leaves_probabilities(compiled, late_ms):
    """Two cameras: the frame that completes a round may be older than that of the round before."""
    observer = GripObserver(GripOptions(), 0.11, compiled=compiled)
    load, alarm = ContactLoad((0.0, 0.4), 0.0, 0.01, 0.001), Detection(True, 0.9, 0.5, 0.9, 0.9)

    def see(t_ms, a_ms, b_ms):
        fingers = tuple(seen_by(name, t * 1_000_000, load) for name, t in (("a", a_ms), ("b", b_ms)))
        at = {"aperture_m": 0.023, "touch_m": 0.025, "fingers": fingers}
        return observer.update(GripEstimate(t_ns=t_ms * 1_000_000, dt_s=0.04, detection=alarm, **at))

    for k in range(10):
        see(40 * k, 40 * k, 40 * k)
    see(400, 400, 399 - late_ms)
    see(440, 440, 399 - late_ms)
    grip = see(400 - late_ms, 440, 400 - late_ms)
    assert grip.complete
    assert min(observer.belief.stick.min(), observer.belief.slide.min()) >= 0
    assert 0 <= grip.slips <= 1


def test_a_load_that_is_no_number_is_none():
    grips = loads([0.0, *[0.4] * 9, math.nan, *[0.4] * 5])
    assert grips[10].stale
    assert all(math.isfinite(grip.slips) for grip in grips)
    assert math.isfinite(grips[-1].required_m(0.1, 1.08, 0.4, 1.0))
    assert not grips[-1].stale


def test_without_an_aperture_the_squeeze_does_not_change_in_every_frame():
    """A change of the squeeze moves the gel, so that alarms count less, and silence too."""

    def sliding(aperture_m):
        observer = GripObserver(GripOptions(), 0.11)
        slips = []
        for k in range(30):
            load = ContactLoad((0.0, 0.4 if k else 0.0), 0.0, 0.01, 0.001)
            finger = seen_by("finger", k * FRAME_NS, load)
            at = {"aperture_m": aperture_m, "touch_m": 0.032, "fingers": (finger,)}
            slips.append(observer.update(GripEstimate(t_ns=k * FRAME_NS, dt_s=0.04, detection=STILL, **at)).slips)
        return slips[-1]

    assert sliding(math.nan) == pytest.approx(sliding(0.030), abs=0.05)
