"""Checks of trackers: markers are followed, kept in order, and flagged when they are lost."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lsds.contracts import Frame, MarkerReference, MarkerTracks, TrackFlag
from lsds.errors import DataError
from lsds.testing.bench import Bench
from lsds.testing.feeding import build
from lsds.testing.gel import SPEC, draw, grid_px
from lsds.testing.stimulus import FRAME_NS, frames, rest_frame

GRID_MOTION_PX = 2.5
"""Motion of the grid from frame to frame: a tracker that is one frame late is farther off than `NEAR_PX`."""
NEAR_PX = 1.0
"""Maximum distance of a followed marker from its true position, px; chosen."""
SHIFTS = ((1, 0), (2, 1), (2, 2), (1, 3), (0, 2), (-1, 1), (-2, 0), (-1, -1), (0, 0))
"""Path of the grid in steps."""
GRID_SHARE = 0.5
"""Maximum distance of a marker of the reference from the place of its cell, in pitches; chosen."""
LEAST_FOLLOWED_SHARE = 0.5
"""Share of the markers that is followed in a clear frame."""
HIDDEN = np.isin(np.arange(63), (11, 16, 30, 40, 47, 51))
"""The markers that are hidden in some frames."""


def check_reference_is_a_grid(bench: Bench) -> None:
    """The reference's positions are those of its cells, by its pitch and its axes, in an image of its size."""
    reference = build(bench).start(rest_frame(), SPEC.pad)
    assert reference.image_size == (SPEC.width_px, SPEC.height_px), (
        f"image_size is {reference.image_size}; it is (width, height), {(SPEC.width_px, SPEC.height_px)} here"
    )
    cell = np.asarray(reference.cell)
    assert ((cell >= 0) & (cell < np.array(reference.shape))).all(), (
        f"shape is {reference.shape} and a cell is {cell.max(axis=0).tolist()}; both are (rows, columns), from zero"
    )
    assert len(np.unique(cell, axis=0)) == reference.count, "two markers have the same cell; give each its own"
    steps = cell[:, ::-1] * np.array(reference.pitch_px)
    laid_out = steps @ np.asarray(reference.axes, float)
    off = reference.xy_px - laid_out
    worst = float(np.abs(off - np.median(off, axis=0)).max())
    limit = GRID_SHARE * min(reference.pitch_px)
    assert worst < limit, (
        f"a marker is {worst:.1f} px from the place of its cell (limit {limit:.1f} px); cell is (row, column), "
        "pitch_px (along columns, along rows), and axes the directions of the grid's x and y in the image"
    )


def check_tracks_are_sound(bench: Bench) -> None:
    """Each answer has one row for each marker of the reference; valid means flag OK and inside, lost means NaN."""
    tracker = build(bench)
    reference = tracker.start(rest_frame(), SPEC.pad)
    for frame in (*frames("slides"), *frames("turns")):
        _assert_sound(reference, tracker.update(frame), frame)


def check_follows_a_shifted_grid(bench: Bench) -> None:
    """Markers of a grid that is shifted by up to 2.5 px per frame are followed to within 1 px, most of them."""
    tracker = build(bench)
    reference = tracker.start(rest_frame(), SPEC.pad)
    for frame, shift in _shifted():
        tracks = tracker.update(frame)
        _assert_sound(reference, tracks, frame)
        share = float(np.mean(tracks.valid))
        assert share >= LEAST_FOLLOWED_SHARE, (
            f"frame {frame.seq}: {share:.0%} of the markers of a clear image are followed "
            f"(limit {LEAST_FOLLOWED_SHARE:.0%})"
        )
        off = np.linalg.norm(tracks.xy_px - reference.xy_px - shift, axis=1)[tracks.valid]
        worst = int(np.argmax(off))
        assert off[worst] <= NEAR_PX, (
            f"frame {frame.seq}: marker {np.flatnonzero(tracks.valid)[worst]} is {off[worst]:.1f} px from where the "
            f"grid shifted by {shift.tolist()} px has it (limit {NEAR_PX} px); keep the order of the reference, answer "
            "for this frame, and flag what is not found"
        )


def check_flags_what_is_lost(bench: Bench) -> None:
    """Markers that are gone from the image, and all of a black one, are flagged and NaN."""
    tracker = build(bench)
    reference = tracker.start(rest_frame(), SPEC.pad)
    for frame in _hidden():
        tracks = tracker.update(frame)
        _assert_sound(reference, tracks, frame)
        # Sample points that lie between markers are followed by what is around them.
        at_marker = np.linalg.norm(reference.xy_px[:, None] - grid_px()[HIDDEN], axis=2).min(axis=1) < 2.0
        claimed = np.flatnonzero(at_marker & tracks.valid)
        assert not len(claimed), (
            f"frame {frame.seq}: markers {claimed.tolist()} are not in the image and are valid; flag them as LOST"
        )
    black = _black(len(_hidden()))
    tracks = tracker.update(black)
    _assert_sound(reference, tracks, black)
    assert not tracks.valid.any(), (
        f"a black image, and {np.count_nonzero(tracks.valid)} of {reference.count} markers are valid; flag them as LOST"
    )


def check_never_raises_on_an_image(bench: Bench) -> None:
    """Black, white, noise and stripes do not raise, and after them a clear frame is answered again."""
    tracker = build(bench)
    reference = tracker.start(rest_frame(), SPEC.pad)
    for what, frame in _odd_images().items():
        try:
            tracks = tracker.update(frame)
        except Exception as error:
            raise AssertionError(
                f"update() raised {type(error).__name__} on {what}: {error}; flag the markers as LOST instead"
            ) from error
        _assert_sound(reference, tracks, frame)


def check_refuses_a_reference_without_markers(bench: Bench) -> None:
    """`start` raises DataError for a black frame: nothing can be followed in it."""
    tracker = build(bench)
    try:
        reference = tracker.start(_black(0), SPEC.pad)
    except DataError:
        return
    except Exception as error:
        raise AssertionError(
            f"start() raised {type(error).__name__} on a black frame: {error}; raise DataError, which names the frame"
        ) from error
    raise AssertionError(
        f"start() found {getattr(reference, 'count', None)} markers in a black frame; raise DataError, which names it"
    )


def _assert_sound(reference: MarkerReference, tracks: Any, frame: Frame) -> None:
    where = f"frame {frame.seq}"
    assert isinstance(tracks, MarkerTracks), f"{where}: update() returned {type(tracks).__name__}; return MarkerTracks"
    shapes = tuple(np.shape(part) for part in (tracks.xy_px, tracks.valid, tracks.flags))
    count = reference.count
    assert shapes == ((count, 2), (count,), (count,)), (
        f"{where}: xy_px, valid and flags have shapes {shapes} for {count} markers; answer one row for each marker of "
        "the reference, in its order"
    )
    assert (tracks.t_ns, tracks.seq) == (frame.t_ns, frame.seq), (
        f"{where}: answered as frame {tracks.seq} at {tracks.t_ns} ns, not at {frame.t_ns} ns; copy t_ns and seq"
    )
    assert set(np.unique(tracks.flags).tolist()) <= {flag.value for flag in TrackFlag}, (
        f"{where}: flags are {np.unique(tracks.flags).tolist()}; use the values of TrackFlag"
    )
    odd = np.flatnonzero(np.asarray(tracks.valid, bool) != (tracks.flags == TrackFlag.OK.value))
    assert not len(odd), f"{where}: marker {odd[0]} is valid and not OK, or OK and not valid; only OK is valid"
    kept = tracks.xy_px[np.asarray(tracks.valid, bool)]
    lost = tracks.xy_px[~np.asarray(tracks.valid, bool)]
    assert np.isnan(lost).all(), f"{where}: a lost marker has the position {lost[0].tolist()}; it must be NaN"
    inside = (kept >= 0) & (kept <= np.array(reference.image_size) - 1)
    assert inside.all(), (
        f"{where}: a valid marker is at {kept[~inside.all(axis=1)][0].tolist()} in an image of "
        f"{reference.image_size}; flag it as OUT_OF_VIEW"
    )


@cache
def _shifted() -> Sequence[tuple[Frame, NDArray[np.float64]]]:
    found = []
    for i, steps in enumerate(SHIFTS):
        shift = GRID_MOTION_PX * np.array(steps, float)
        found.append((Frame(draw(grid_px() + shift, seed=200 + i), (i + 1) * FRAME_NS, i), shift))
    return found


@cache
def _hidden() -> Sequence[Frame]:
    markers = np.where(HIDDEN[:, None], np.nan, grid_px())
    return [Frame(draw(markers, seed=300 + i), (i + 1) * FRAME_NS, i) for i in range(4)]


def _black(seq: int) -> Frame:
    return Frame(np.zeros((SPEC.height_px, SPEC.width_px, 3), np.uint8), (seq + 1) * FRAME_NS, seq)


@cache
def _odd_images() -> dict[str, Frame]:
    shape = (SPEC.height_px, SPEC.width_px, 3)
    stripes = np.zeros(shape, np.uint8)
    stripes[:, ::8] = 255
    images = {
        "a black image": np.zeros(shape, np.uint8),
        "a white image": np.full(shape, 255, np.uint8),
        "noise": np.random.default_rng(5).integers(0, 256, shape, np.uint8),
        "stripes": stripes,
        "a clear frame afterwards": draw(grid_px(), seed=400),
    }
    return {what: Frame(image, (i + 1) * FRAME_NS, i) for i, (what, image) in enumerate(images.items())}


TRACKER_CHECKS = (
    check_reference_is_a_grid,
    check_tracks_are_sound,
    check_follows_a_shifted_grid,
    check_flags_what_is_lost,
    check_never_raises_on_an_image,
    check_refuses_a_reference_without_markers,
)
