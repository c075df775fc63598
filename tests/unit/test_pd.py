"""Controller `pd`: closes on slip, opens only with the release option, and is independent of the frame rate."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_plugins.controllers.pd import PAPER_TICK_M, PdController, PdOptions

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, Detection, GripEstimate, GripTask, SlipEstimate

STROKE_M = 0.05
NAN = math.nan


def controller(**options):
    return PdController(PdOptions(**options), BuildContext(VirtualClock(), 0))


def state(slip, speed=0.0, *, dt_s=0.04, held=0.023, measured=None, abstained=False):
    estimate = SlipEstimate((0.0, speed), (0.0, 0.0), 0.0, 0.0, speed, 0.0, abstained)
    return GripEstimate(
        dt_s=dt_s,
        detection=Detection(slip, 1.0, 0.5, 1.0),
        estimate=estimate,
        commanded_m=held,
        measured_m=held if measured is None else measured,
    )


def closed_by(pd, speed, **more):
    """Ticks by which the controller closes on this speed."""
    return (0.023 - pd.update(state(True, speed, **more), GripTask())) / PAPER_TICK_M


def test_it_closes_by_the_proportional_gain_on_the_first_frame_of_slip():
    assert closed_by(controller(), 0.038) == pytest.approx(3.10 * 3.8)
    assert closed_by(controller(kp=1.0), 0.05) == pytest.approx(5.0)
    assert closed_by(controller(target_m_s=0.01), 0.038) == pytest.approx(3.10 * 2.8)


def test_the_derivative_counts_from_the_second_frame_on():
    pd = controller()
    pd.update(state(True, 0.01), GripTask())
    assert closed_by(pd, 0.03) == pytest.approx(3.10 * 3.0 + 0.42 * 2.0)


def test_it_opens_with_the_sign_as_printed():
    assert closed_by(controller(literal_sign=True), 0.01) == pytest.approx(-3.10)


@pytest.mark.parametrize("slip", [False, None])
def test_it_leaves_the_gripper_alone_while_nothing_slips(slip):
    assert controller().update(state(slip, 0.05), GripTask()) is None


def test_it_leaves_the_gripper_alone_without_an_estimate():
    pd = controller()
    assert pd.update(state(True, NAN), GripTask()) is None
    assert pd.update(state(True, 0.05, abstained=True), GripTask()) is None


@pytest.mark.parametrize("between", [False, None])
def test_the_last_error_is_forgotten_when_slip_ends(between):
    pd = controller()
    pd.update(state(True, 0.05), GripTask())
    pd.update(state(between, 0.0), GripTask())
    assert closed_by(pd, 0.01) == pytest.approx(3.10)


def test_an_error_from_before_an_abstention_is_no_base_for_a_derivative():
    """Its difference would span two intervals and be divided by one."""
    pd = controller()
    pd.update(state(True, 0.01), GripTask())
    pd.update(state(True, NAN, abstained=True), GripTask())
    assert closed_by(pd, 0.03) == pytest.approx(3.10 * 3.0)


def test_reset_forgets_the_last_error():
    pd = controller()
    pd.update(state(True, 0.05), GripTask())
    pd.reset()
    assert closed_by(pd, 0.01) == pytest.approx(3.10)


@given(st.floats(0, 0.05), st.floats(0, 1.0), st.integers(1, 8))
def test_a_ramp_has_one_derivative_however_finely_it_is_cut(start, slope, parts):
    """Speed start + slope t: the command at 0.08 s is the same with two frames as with sixteen."""
    answers = []
    for n in (2, 2 * parts):
        pd, dt = controller(), 0.08 / n
        for i in range(n + 1):
            answer = pd.update(state(True, start + slope * i * dt, dt_s=dt), GripTask())
        answers.append(answer)
    assert answers[0] == pytest.approx(answers[1], abs=1e-9)


@pytest.mark.parametrize("dt_s", [NAN, 0.0])
def test_an_unknown_interval_breaks_nothing(dt_s):
    pd = controller()
    pd.update(state(True, 0.01), GripTask())
    assert 0 <= pd.update(state(True, 0.02, dt_s=dt_s), GripTask()) <= STROKE_M


def test_it_closes_from_where_the_fingers_are_and_not_again_while_a_command_is_under_way():
    pd = controller(kd=0.0)
    first = pd.update(state(True, 0.02, held=0.023, measured=0.023), GripTask())
    again = pd.update(state(True, 0.02, held=first, measured=0.023), GripTask())
    assert again == pytest.approx(first)
    assert pd.update(state(True, 0.02, held=first, measured=first), GripTask()) == pytest.approx(
        first - 6.2 * PAPER_TICK_M
    )


def test_it_uses_the_command_if_the_aperture_is_unknown():
    assert controller().update(state(True, 0.01, held=0.02, measured=NAN), GripTask()) == pytest.approx(
        0.02 - 3.1 * PAPER_TICK_M
    )


apertures = st.floats(0, STROKE_M)
steps = st.tuples(
    st.sampled_from([True, False, None]), st.floats(0, 0.3), st.sampled_from([1e-3, 0.02, 0.04, 0.2, NAN]), apertures
)
gains = st.fixed_dictionaries({"kp": st.floats(0, 50), "kd": st.floats(0, 50), "target_m_s": st.floats(0, 0.1)})


@given(gains, st.lists(steps, min_size=1, max_size=30), apertures)
def test_it_never_opens_unless_configured_to(options, sequence, start):
    pd, held = controller(**options), start
    assert not pd.may_open
    for slip, speed, dt_s, measured in sequence:
        wanted = pd.update(state(slip, speed, dt_s=dt_s, held=held, measured=measured), GripTask())
        if wanted is not None:
            assert slip
            assert 0 <= wanted <= held
            held = wanted


@given(gains, st.booleans(), st.floats(0, 0.01), st.lists(steps, min_size=1, max_size=30))
def test_it_never_asks_for_less_than_closed(options, literal, release, sequence):
    pd, held = controller(literal_sign=literal, release_m_s=release, release_after_s=0.05, **options), 0.023
    for slip, speed, dt_s, measured in sequence:
        wanted = pd.update(state(slip, speed, dt_s=dt_s, held=held, measured=measured), GripTask())
        if wanted is not None:
            assert wanted >= 0
            held = wanted


def released(pd, quiet, held=0.02, **more):
    """Run the controller over quiet frames of 0.1 s and follow its commands; return the frames that released."""
    answers = []
    for i in range(quiet):
        wanted = pd.update(state(False, 0.0, dt_s=0.1, held=held, **more), GripTask())
        if wanted is not None:
            answers.append((i, wanted - held))
            held = wanted
    return answers


def test_release_waits_for_quiet_and_is_slow():
    pd = controller(release_m_s=1e-3, release_after_s=1.05)
    assert pd.may_open
    answers = released(pd, 20)
    assert [i for i, _ in answers] == list(range(10, 20))
    assert [step for _, step in answers] == pytest.approx([1e-4] * 10)


def test_slip_ends_the_quiet_time():
    pd = controller(release_m_s=1e-3, release_after_s=1.05)
    assert len(released(pd, 12)) == 2
    pd.update(state(True, 0.01), GripTask())
    assert [i for i, _ in released(pd, 12)] == [10, 11]


def test_abstention_is_not_quiet():
    pd = controller(release_m_s=1e-3, release_after_s=0.55)
    for _ in range(30):
        assert pd.update(state(None, dt_s=0.1), GripTask()) is None
    assert [i for i, _ in released(pd, 7)] == [5, 6]


def test_steps_below_the_gripper_s_resolution_add_up():
    """Each frame requests a hundredth of a tick more; the gripper rounds, the controller integrates the requests."""
    pd, held, asked = controller(release_m_s=PAPER_TICK_M, release_after_s=0.0), 0.02, []
    for _ in range(300):
        wanted = pd.update(state(False, dt_s=0.01, held=held), GripTask())
        if wanted is not None:
            asked.append(wanted)
            held = round(wanted / PAPER_TICK_M) * PAPER_TICK_M
    assert asked == sorted(asked)
    assert held == pytest.approx(0.02 + 3 * PAPER_TICK_M, abs=1.01 * PAPER_TICK_M)


def test_without_release_nothing_is_ever_opened():
    assert released(controller(release_after_s=0.0), 100) == []


@pytest.mark.parametrize("aperture", [0.07, 0.085, 0.14])
def test_a_gripper_of_any_stroke_is_moved_by_the_gains_and_no_more(aperture):
    wanted = controller().update(state(True, 0.001, held=aperture), GripTask())
    assert wanted == pytest.approx(aperture - 3.10 * 0.1 * PAPER_TICK_M)
