"""Marker trackers against rendered truth: accurate where valid, flagged where ambiguous."""

from __future__ import annotations

import numpy as np
import pytest
from tactile.following import FOLLOWERS, Bench, build, bump, directions, jumps, rms
from tactile.render import HEIGHT, WIDTH, pad_positions, render
from tactile.scenes import frame

from lsds.contracts import TrackFlag
from lsds.errors import DataError

pytestmark = pytest.mark.parametrize("name", sorted(FOLLOWERS))
TRUSTED_PX = 0.04
LOST, OUT = TrackFlag.LOST.value, TrackFlag.OUT_OF_VIEW.value


def shade():
    """A finger's shadow and a lamp's glow: up to 25 grey levels, smooth over the image."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    glow = 25 * np.exp(-((x - 90) ** 2 + (y - 60) ** 2) / 5000) - 25 * np.exp(-((x - 230) ** 2 + (y - 170) ** 2) / 4000)
    return glow[..., None] * np.array([1.0, 0.9, 0.7])


@pytest.mark.parametrize(
    ("look", "varies"),
    [({}, False), ({"gain": 0.8}, False), ({"gain": 1.25}, False), ({"shade": shade()}, False), ({}, True)],
    ids=["plain", "darker", "brighter", "shaded", "flickering"],
)
@pytest.mark.parametrize("shape", ["uniform", "bump"])
def test_travel_below_half_a_pitch_is_followed_to_a_fraction_of_a_pixel(name, shape, look, varies):
    bench = Bench(name)
    weight = 1.0 if shape == "uniform" else bump(bench.rest, 60)
    steps, seen = [], 0
    for i in range(20):
        travel = weight * np.array([11 * np.sin(i / 3), 11 * np.cos(i / 4) - 11])
        look = {"gain": 1 + 0.2 * np.sin(i)} if varies else look
        steps.append(bench.move(travel, **look))
        xy = bench.rest + travel
        seen += int(((xy > 8) & (xy < np.array([WIDTH - 9, HEIGHT - 9]))).all(1).sum())
    error = rms(steps)
    print(f"{name} {shape}: rms {error:.4f} px")
    assert error <= TRUSTED_PX
    assert max(step.error_px[step.valid].max() for step in steps) < 0.25
    assert sum(step.kept for step in steps) >= seen, "a dot in full view was given up"


@pytest.mark.parametrize("pad", [(7, 9), None], ids=["pad known", "pad unknown"])
def test_jumps_beyond_half_a_pitch_are_followed_or_flagged_never_guessed(name, pad):
    table = jumps(name, range(16, 45, 7), pad)
    tracks, missed, unflagged = np.sum(list(table.values()), axis=0)
    print(
        f"{name} {pad}: wrong and unflagged {unflagged} of {tracks}; flagged {1 - unflagged / missed:.2%} of {missed}"
    )
    assert unflagged <= 0.01 * tracks
    assert unflagged <= 0.05 * missed, "fewer than 95 % of the wrong tracks were flagged"
    right = {travel: n - m for travel, (n, m, _) in table.items()}
    assert right[16] >= 0.95 * table[16][0], "a jump of half a pitch is not beyond what can be known"


def paths(rest):
    way = directions(5)[1:4]
    yield "ramp", [np.array([x, 0.0]) + 0 * rest for x in (0, 2, 8, 22, 41, 41, 30, 20, 10, 0)]
    yield "19 px a frame", [np.array([x, 0.0]) + 0 * rest for x in (0, 19, 38, 41, 41, 22, 3, 0)]
    for i, towards in enumerate(way):
        weight = 1.0 if i == 0 else bump(rest, (40, 60, 90)[i])
        travel = [20.5 * (1 - np.cos(0.9 * n)) for n in range(16)]
        yield f"sinusoid {i}", [weight * t * towards + 0 * rest for t in travel]
    yield "bump", [bump(rest, 70) * np.array([0.0, y]) for y in (5, 24, 41, 41, 30, 11, 0)]


def test_travel_beyond_a_pitch_is_followed_frame_by_frame(name):
    for label, path in paths(pad_positions()):
        bench = Bench(name)
        steps = [bench.move(displacement) for displacement in path]
        assert sum(step.wrong_unflagged for step in steps) == 0, label
        assert rms(steps) < 0.06, label
        # Markers in view are not given up: a travel of 41 px takes up to two columns out of view.
        assert min(step.kept for step in steps) >= 40, label


def test_a_held_gel_stands_still(name):
    bench = Bench(name)
    pressed = bump(bench.rest, 50) * np.array([1.5, -6.0])
    xy = []
    for i in range(25):
        tracks = bench.tracker.update(frame(render(bench.rest + pressed, seed=i), i + 1))
        assert tracks.valid.all()
        xy.append(tracks.xy_px)
    jitter = np.std(xy, axis=0)
    print(f"{name}: jitter {np.sqrt((jitter**2).mean()):.4f} px")
    assert np.sqrt((jitter**2).mean()) < 0.03
    assert jitter.max() < 0.06


UNUSABLE = {
    "black": lambda rng: np.zeros((HEIGHT, WIDTH, 3), np.uint8),
    "white": lambda rng: np.full((HEIGHT, WIDTH, 3), 255, np.uint8),
    "noise": lambda rng: rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8),
    "flat": lambda rng: np.full((HEIGHT, WIDTH, 3), 90, np.uint8),
    "stripes": lambda rng: (
        np.where(np.arange(WIDTH)[None, :, None] // 8 % 2, 40, 160).astype(np.uint8)
        + np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    ),
}


@pytest.mark.parametrize("kind", sorted(UNUSABLE))
def test_frames_that_show_no_dots_are_flagged_and_recovered_from(name, kind):
    bench, rng = Bench(name), np.random.default_rng(0)
    travel = np.array([3.0, -2.0])
    for _ in range(3):
        assert bench.move(travel).kept == 63
    for _ in range(4):
        step = bench.show(UNUSABLE[kind](rng))
        print(f"{name} {kind}: {step.kept} kept")
        # Noise may hold something dark in a few of 63 places; it may not pass for a gel.
        assert step.kept <= (6 if kind == "noise" else 0)
    steps = [bench.move(travel + np.array([0.5 * i, 0.0])) for i in range(3)]
    assert steps[-1].kept == 63
    assert rms(steps) < TRUSTED_PX


@pytest.mark.parametrize("level", [0, 255])
@pytest.mark.parametrize("side", ["left", "right", "top"])
@pytest.mark.parametrize("width", [30, 60, 160])
def test_a_hidden_border_is_not_taken_for_a_jump_of_a_pitch(name, width, side, level):
    """A hidden column and a jump by one pitch show the same markers: the tracks must be flagged, never valid and
    wrong."""
    bench = Bench(name)
    bench.move(np.zeros(2))
    hidden = {"left": np.s_[:, :width], "right": np.s_[:, -width:], "top": np.s_[:width]}[side]
    for i in range(5):
        travel = np.array([2.0, 1.0 + 0.2 * i])
        image = render(bench.rest + travel, seed=i)
        image[hidden] = level
        step = bench.show(image, bench.rest + travel)
        # Dots of which the hidden part's edge leaves a piece may be led astray; a jump of a pitch takes 40 and more.
        assert np.count_nonzero(step.error_px[step.valid] > 12) <= 4
    for _ in range(15):
        step = bench.move(np.array([2.0, 2.0]))
    assert step.kept >= 61
    assert step.wrong_unflagged == 0
    assert rms([step]) < TRUSTED_PX


@pytest.mark.parametrize("gap", [7, 25, 250])
@pytest.mark.parametrize("travel", [(0.0, 0.0), (9.0, -7.0), (-13.0, 5.0)])
def test_a_gap_in_time_is_survived(name, gap, travel):
    bench = Bench(name)
    for i in range(4):
        bench.move(np.array([4.0 * i, 0.0]))
    step = bench.move(np.array([12.0, 0.0]) + travel, gap=gap)
    assert step.wrong_unflagged == 0
    assert step.kept >= 55
    assert rms([step]) < TRUSTED_PX


def test_a_dot_painted_over_is_lost_and_comes_back(name):
    bench = Bench(name)
    painted = (10, 31, 47)
    hidden = np.isin(bench.dot, painted)
    moves = [np.array([4 * np.sin(i / 2), -4 + 4 * np.cos(i / 2)]) for i in range(12)]
    assert bench.move(moves[0]).kept == 63
    for travel in moves[1:8]:
        step = bench.move(travel, painted=painted)
        assert not step.valid[hidden].any()
        assert (step.flags[hidden] == LOST).all()
        assert step.valid[~hidden].all()
        assert rms([step]) < TRUSTED_PX
    for travel in moves[8:]:
        step = bench.move(travel)
    assert step.kept == 63
    assert rms([step]) < TRUSTED_PX


def test_a_dot_that_leaves_the_image_is_out_of_view_and_comes_back(name):
    bench = Bench(name)
    for x in (0, 8, 16, 24, 32):
        step = bench.move(np.array([float(x), 0.0]))
    gone = (bench.rest + np.array([32.0, 0.0]))[bench.dot][:, 0] > WIDTH
    assert gone.any()
    assert (step.flags[gone] == OUT).all()
    for x in (24, 16, 8, 0):
        step = bench.move(np.array([float(x), 0.0]))
    assert step.kept == 63
    assert step.wrong_unflagged == 0


def test_flags_and_positions_agree(name):
    bench = Bench(name)
    for i, travel in enumerate(np.random.default_rng(2).uniform(-25, 25, (12, 2))):
        tracks = bench.tracker.update(frame(render(bench.rest + travel, seed=i), i + 1))
        assert tracks.xy_px.shape == (63, 2)
        assert tracks.flags.dtype == np.uint8
        assert np.array_equal(tracks.valid, tracks.flags == TrackFlag.OK.value)
        assert np.array_equal(np.isfinite(tracks.xy_px).all(axis=1), tracks.valid)
        assert np.isnan(tracks.xy_px[~tracks.valid]).all()


def test_reset_forgets_motion_and_keeps_the_reference(name):
    bench, fresh = Bench(name), Bench(name)
    for x in (0, 9, 18, 27):
        bench.move(np.array([float(x), 0.0]))
    bench.tracker.reset()
    for i, x in enumerate((1.0, 5.0, 12.0)):
        image = render(bench.rest + np.array([x, 2.0]), seed=i)
        again, first = (b.tracker.update(frame(image, 10 + i)) for b in (bench, fresh))
        assert np.array_equal(again.xy_px, first.xy_px, equal_nan=True)
        assert np.array_equal(again.flags, first.flags)


@pytest.mark.parametrize(("rows", "cols", "pitch"), [(7, 9, (33.0, 32.0)), (8, 10, (29.0, 28.0)), (5, 7, (42.0, 42.0))])
@pytest.mark.parametrize("degrees", [0.0, -12.0, 35.0])
def test_the_reference_is_the_printed_pad(name, rows, cols, pitch, degrees):
    rest = pad_positions(rows, cols, pitch, angle=np.deg2rad(degrees), pincushion=0.02)
    # A turned pad sticks out of the image; dots whose edge is cut are not part of the reference.
    whole = ((rest > 9) & (rest < [WIDTH - 10, HEIGHT - 10])).all(axis=1)
    bench = Bench(name, None, rest)
    assert set(np.flatnonzero(whole)) <= set(bench.dot.tolist())
    true_cell = np.stack(np.divmod(bench.dot, cols), axis=1)
    assert (np.ptp(true_cell - bench.reference.cell, axis=0) == 0).all()
    error = bench.reference.xy_px - rest[bench.dot]
    assert np.sqrt((error**2).mean()) < TRUSTED_PX
    if degrees == 0:
        assert bench.reference.shape == (rows, cols)
    assert bench.move(np.array([2.3, -1.7])).wrong_unflagged == 0


@pytest.mark.parametrize("kind", sorted(UNUSABLE))
def test_no_reference_is_taken_from_a_frame_without_dots(name, kind):
    image = UNUSABLE[kind](np.random.default_rng(1))
    with pytest.raises(DataError, match=r"reference frame 3: .*dots form a grid"):
        build(name).start(frame(image, 3))


def test_nothing_is_followed_before_there_is_a_reference(name):
    with pytest.raises(RuntimeError, match="start"):
        build(name).update(frame(np.zeros((HEIGHT, WIDTH, 3), np.uint8), 0))
