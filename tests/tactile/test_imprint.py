"""The imprint's motion against the gel, on painted scenes in which both are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile.imprinted import METRES_PER_PX, Motion, bumps, dots, field, painted, ridge

from lsds.tactile.imprint.motion import ImprintFollower, ImprintMotion

BUMPS, REFERENCE = bumps(), dots()
STILL = Motion()


def followed(depth: np.ndarray, body: Motion, gel: Motion, *, noise: float = 1.0) -> ImprintMotion:
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, painted(BUMPS * 0, STILL, STILL))
    follower.follow(painted(depth, STILL, STILL, noise=noise), field(STILL, REFERENCE))
    motion = follower.follow(painted(depth, body, gel, noise=noise, seq=1), field(gel, REFERENCE, 1))()
    assert motion is not None
    return motion


def in_px(motion: ImprintMotion) -> tuple[float, float, float]:
    """Slip at the image's centre: px and degrees."""
    x, y = (part / METRES_PER_PX for part in motion.slip_m)
    at_x, at_y = (part / METRES_PER_PX for part in motion.centre_m)
    # The turn is about the imprint's centre; the scenes turn about the image's.
    cos, sin = math.cos(motion.turn_rad), math.sin(motion.turn_rad)
    return x + at_x * (1 - cos) + sin * at_y, y + at_y * (1 - cos) - sin * at_x, math.degrees(motion.turn_rad)


@pytest.mark.parametrize("slip", [(0.0, 0.0), (0.5, 0.0), (3.0, -2.0), (-12.0, 9.0), (25.0, 15.0)])
def test_a_translation_against_a_gel_at_rest(slip: tuple[float, float]) -> None:
    motion = followed(BUMPS, Motion(*slip), STILL)
    assert in_px(motion)[:2] == pytest.approx(slip, abs=0.25 + 0.02 * math.hypot(*slip))
    assert motion.match > 0.85


@pytest.mark.parametrize("turn", [-20.0, -8.0, -2.0, 2.0, 8.0, 20.0])
def test_a_turn_against_a_gel_at_rest(turn: float) -> None:
    motion = followed(BUMPS, Motion(turn=math.radians(turn)), STILL)
    assert in_px(motion)[2] == pytest.approx(turn, abs=0.5 + 0.02 * abs(turn))


@settings(max_examples=25)
@given(x=st.floats(-10, 10), y=st.floats(-10, 10), turn=st.floats(-5, 5))
def test_what_moves_with_the_gel_does_not_slip(x: float, y: float, turn: float) -> None:
    together = Motion(x, y, math.radians(turn))
    slid = in_px(followed(BUMPS, together, together))
    assert math.hypot(*slid[:2]) < 0.4
    assert abs(slid[2]) < 0.5


@settings(max_examples=25)
@given(
    gel=st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
    slip=st.tuples(st.floats(-12, 12), st.floats(-12, 12)),
    turn=st.floats(-12, 12),
)
def test_slip_is_separated_from_the_motion_of_the_gel(
    gel: tuple[float, float], slip: tuple[float, float], turn: float
) -> None:
    motion = slid(gel, slip, turn)
    assert is_right(motion, slip, turn) or motion.match < 0.75, "what went astray does not match"


def slid(gel: tuple[float, float], slip: tuple[float, float], turn: float) -> ImprintMotion:
    return followed(BUMPS, Motion(gel[0] + slip[0], gel[1] + slip[1], math.radians(turn)), Motion(*gel))


def is_right(motion: ImprintMotion, slip: tuple[float, float], turn: float) -> bool:
    x, y, turned = in_px(motion)
    return abs(x - slip[0]) < 1 and abs(y - slip[1]) < 1 and abs(turned - turn) < 1.2


def test_of_fast_slips_with_a_turn_nearly_all_are_followed() -> None:
    rng = np.random.default_rng(0)
    cases = [(rng.uniform(-4, 4, 2), rng.uniform(-12, 12, 2), rng.uniform(-12, 12)) for _ in range(40)]
    assert sum(is_right(slid(tuple(gel), tuple(slip), turn), tuple(slip), turn) for gel, slip, turn in cases) >= 38


def test_a_ridge_has_no_information_along_itself() -> None:
    motion = followed(ridge(), Motion(3.0, 7.0), STILL)
    assert motion.slip_m[0] / METRES_PER_PX == pytest.approx(3.0, abs=0.3)
    across, along = motion.information[0, 0], motion.information[1, 1]
    assert along < 0.05 * across


def test_bumps_have_information_in_every_direction() -> None:
    values = np.linalg.eigvalsh(followed(BUMPS, Motion(1.0, 1.0), STILL).information[:2, :2])
    assert values[0] > 0.3 * values[1]


def test_an_imprint_that_appears_does_not_match() -> None:
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, painted(BUMPS * 0, STILL, STILL))
    follower.follow(painted(BUMPS * 0, STILL, STILL), field(STILL, REFERENCE))
    motion = follower.follow(painted(BUMPS, STILL, STILL, seq=1), field(STILL, REFERENCE, 1))()
    assert motion is None or motion.match < 0.6


def test_the_first_frame_and_too_few_dots_have_no_answer() -> None:
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, painted(BUMPS * 0, STILL, STILL))
    own = field(STILL, REFERENCE)
    assert follower.follow(painted(BUMPS, STILL, STILL), own)() is None
    lost = field(STILL, REFERENCE, 1)
    lost.valid[5:] = False
    assert follower.follow(painted(BUMPS, STILL, STILL, seq=1), lost)() is None
    follower.reset()
    assert follower.follow(painted(BUMPS, STILL, STILL, seq=2), own)() is None


def test_an_even_image_has_no_answer_or_no_information() -> None:
    grey = painted(BUMPS * 0, STILL, STILL, noise=0.0)
    flat = type(grey)(np.full_like(grey.image, 90), 0, 0)
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, painted(BUMPS * 0, STILL, STILL))
    follower.follow(flat, field(STILL, REFERENCE))
    assert follower.follow(flat, field(STILL, REFERENCE, 1))() is None
