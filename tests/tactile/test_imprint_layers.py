"""The residue of the markers is subtracted from a relief, and an imprint that has leapt is found, in painted scenes."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
from tactile.imprinted import HEIGHT, METRES_PER_PX, PITCH, WIDTH, Motion, bumps, dots, field, painted

from lsds.contracts import Frame
from lsds.tactile.imprint.carrying import CarriedGel
from lsds.tactile.imprint.layers import Layer
from lsds.tactile.imprint.motion import ImprintFollower
from lsds.tactile.imprint.relief import Relief, ReliefMaker
from lsds.tactile.imprint.residue import DotResidue
from lsds.tactile.imprint.search import leapt

BUMPS, NOTHING, REFERENCE = bumps(), bumps() * 0, dots()
STILL = Motion()
MAKER = ReliefMaker()


@lru_cache
def fringed(pressed: bool, gel: Motion, fringe: float, body: Motion = STILL) -> Frame:
    """Return a painted frame through a lens that separates the markers' colours: red and blue rims next to the dark."""
    plain = painted(BUMPS if pressed else NOTHING, body, gel, noise=0.5)
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    image = plain.image.astype(float)
    for colour, way in ((0, 1.0), (2, -1.0)):
        from_x, from_y = gel.undone(x - way * fringe * 4, y)
        away = np.hypot((from_x - PITCH / 2) % PITCH - PITCH / 2, (from_y - PITCH / 2) % PITCH - PITCH / 2)
        image[..., colour] *= 1 - 0.25 * (fringe > 0) * np.exp(-((away - 10.0) ** 2) / 8)
    return Frame(np.clip(np.rint(image), 0, 255).astype(np.uint8), 0, 0)


def reliefs(pressed: bool, gel: Motion, fringe: float = 1.0) -> tuple[Relief, Relief]:
    """Return a frame's relief with and without the residue of its markers."""
    residue = DotResidue(REFERENCE, MAKER.relief(fringed(False, STILL, fringe)), METRES_PER_PX)
    relief = MAKER.relief(fringed(pressed, gel, fringe))
    return relief, residue.taken_off(relief, field(gel, REFERENCE))


def strength(curvature: np.ndarray, relief: Relief) -> float:
    """Return the RMS of a curvature away from the border, where markers have neighbours to be compared with."""
    inside = relief.weight[16:-16, 16:-16]
    return math.sqrt(float((inside * curvature[16:-16, 16:-16] ** 2).sum() / inside.sum()))


@pytest.mark.parametrize("gel", [STILL, Motion(4.0, -3.0), Motion(0.0, 2.0, math.radians(3))])
def test_coloured_fringes_around_the_dots_are_carried_along_and_taken_off(gel: Motion) -> None:
    before, after = reliefs(False, gel)
    assert strength(before.curvature, before) > 0.008, "there is something to take off"
    assert strength(after.curvature, after) < 0.4 * strength(before.curvature, before)
    assert np.array_equal(after.weight, before.weight)


def test_the_object_s_own_relief_stays() -> None:
    gel = Motion(4.0, -3.0)
    clean = MAKER.relief(fringed(True, gel, 0.0))
    before, after = reliefs(True, gel)
    off = [strength(relief.curvature - clean.curvature, clean) for relief in (before, after)]
    assert off[1] < 0.5 * off[0]
    match = np.corrcoef(after.curvature[16:-16, 16:-16].ravel(), clean.curvature[16:-16, 16:-16].ravel())[0, 1]
    assert match > 0.9


def test_an_object_in_the_reference_is_no_residue_of_the_dots() -> None:
    relief = MAKER.relief(painted(BUMPS, STILL, STILL))
    after = DotResidue(REFERENCE, relief, METRES_PER_PX).taken_off(relief, field(STILL, REFERENCE))
    assert strength(after.curvature, after) > 0.8 * strength(relief.curvature, relief)


def test_dots_without_fringes_and_too_few_dots_change_nothing() -> None:
    before, after = reliefs(True, Motion(3.0, 0.0), fringe=0.0)
    assert after is before
    residue = DotResidue(REFERENCE, MAKER.relief(fringed(False, STILL, 1.0)), METRES_PER_PX)
    few = field(STILL, REFERENCE)
    few.valid[5:] = False
    assert residue.taken_off(before, few) is before


def test_with_fringes_slip_over_a_gel_that_moves_is_still_measured() -> None:
    gel, body = Motion(4.0, -3.0), Motion(9.0, -3.0)
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, fringed(False, STILL, 1.0))
    follower.follow(fringed(True, STILL, 1.0), field(STILL, REFERENCE))
    motion = follower.follow(fringed(True, gel, 1.0, body), field(gel, REFERENCE, 1))()
    assert motion is not None
    assert motion.slip_m[0] / METRES_PER_PX == pytest.approx(5.0, abs=0.5)
    assert motion.slip_m[1] / METRES_PER_PX == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("most", [300, 700, 1500])
def test_the_edges_are_the_steepest_pixels_of_every_fourth(most: int) -> None:
    relief = MAKER.relief(painted(BUMPS, STILL, STILL))
    layer = Layer(relief.curvature, relief.weight, 1.0, most)
    steepness = layer.steepness.ravel()
    bound = np.sort(steepness[::4])[-(most // 4)]
    assert np.array_equal(layer.edges.squared, steepness[steepness > bound])


def test_the_gel_s_motion_is_the_same_in_pixels_of_any_size() -> None:
    position = np.array([(x, y) for x in (40.0, 160.0, 280.0) for y in (30.0, 120.0, 210.0)])
    gel = CarriedGel(position, 0.02 * position[:, ::-1] + np.sin(position), PITCH, (WIDTH, HEIGHT))
    x, y = np.array([10.0, 100.0, 300.0], np.float32), np.array([5.0, 200.0, 120.0], np.float32)
    assert gel.at(x / np.float32(4), y / np.float32(4), 4.0) * 4 == pytest.approx(gel.at(x, y), abs=1e-4)
    # An affine motion is exact at markers and elsewhere.
    even = CarriedGel(position, 0.02 * position[:, ::-1] + 1.0, PITCH, (WIDTH, HEIGHT))
    assert even.at(x, y) == pytest.approx(np.column_stack([0.02 * y + 1.0, 0.02 * x + 1.0]), abs=0.02)


# -- what has leapt ----------------------------------------------------------------------------------------

SCALE = 2.0
"""Width of a relief pixel, px of the image."""
CENTRE, RADIUS = (WIDTH / 2 / SCALE, HEIGHT / 2 / SCALE), 45 / SCALE


def coarse(frame: Frame) -> Layer:
    """Return the layer in which a leapt imprint is searched for."""
    relief = MAKER.relief(frame)
    assert relief.scale == SCALE
    return Layer(relief.curvature, relief.weight, 1.0, 1500).coarser(700)


@pytest.mark.parametrize(
    ("body", "gel"),
    [
        (STILL, STILL),
        (Motion(40.0, -20.0), STILL),
        (Motion(-60.0, 10.0), Motion(-6.0, 2.0)),
        (Motion(30.0, 20.0, math.radians(8)), STILL),
        (Motion(0.0, -30.0, math.radians(-16)), STILL),
        (Motion(70.0, 0.0), STILL),
    ],
)
def test_an_imprint_is_found_wherever_it_has_leapt(body: Motion, gel: Motion) -> None:
    first, second = (coarse(painted(BUMPS, where, under)) for where, under in ((STILL, STILL), (body, gel)))
    x, y, turn = leapt(first, second, CENTRE, RADIUS, (gel.x / SCALE, gel.y / SCALE))
    # The search is only a start for the registration: it is accurate to about a pixel of the coarser layer.
    slip = (body.x - gel.x, body.y - gel.y)
    assert (x * SCALE, y * SCALE) == pytest.approx(slip, abs=1.5 * first.step * SCALE)
    assert turn == pytest.approx(body.turn, abs=math.radians(0.1))


def test_close_to_the_edge_of_the_image_it_is_found_too_and_nothing_is_not_a_crash() -> None:
    first, second = coarse(painted(BUMPS, STILL, STILL)), coarse(painted(BUMPS, Motion(-110.0, 0.0), STILL))
    x, y, _ = leapt(first, second, CENTRE, RADIUS, (0.0, 0.0))
    assert (x * SCALE, y * SCALE) == pytest.approx((-110, 0), abs=8)
    empty = Layer(np.zeros_like(first.curvature), first.weight, first.step, 700)
    assert all(map(math.isfinite, leapt(empty, first, CENTRE, RADIUS, (0.0, 0.0))))
    assert all(map(math.isfinite, leapt(first, empty, (2.0, 118.0), RADIUS, (0.0, 0.0))))


def test_a_leap_that_gradients_cannot_follow_is_measured_by_the_follower() -> None:
    body = Motion(48.0, -24.0, math.radians(12))
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, painted(NOTHING, STILL, STILL))
    follower.follow(painted(BUMPS, STILL, STILL), field(STILL, REFERENCE))
    motion = follower.follow(painted(BUMPS, body, STILL, seq=1), field(STILL, REFERENCE, 1))()
    assert motion is not None
    assert motion.match > 0.8
    assert math.degrees(motion.turn_rad) == pytest.approx(12, abs=1)
