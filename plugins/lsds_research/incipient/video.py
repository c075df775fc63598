"""One labelled video, frame by frame through the same perception as `lsds track`, as columns of a dataset."""

from __future__ import annotations

from contextlib import suppress
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError, LsdsError, naming
from lsds.models.signals import signals_of
from lsds_research.clips.signals import CLIP_SIGNALS, clip_signals
from lsds_research.datasets import from_rows
from lsds_research.incipient.index import PROTOCOL, Video
from lsds_research.incipient.look import LOOKS, look_of
from lsds_research.recording_engine import recording_engine

if TYPE_CHECKING:
    from numpy.typing import NDArray

COLUMNS_VERSION = 3
"""Version of the columns; a change of it invalidates older caches."""

_LEAST_VIDEO_FRAMES = 12
"""Minimum number of usable frames of a video after the first; chosen."""
_PIXELS = slice(None, None, 4)


def columns_of(video: Video) -> dict[str, NDArray[Any]]:
    """Return the columns of one video: those of a dataset, `CLIP_SIGNALS` and `LOOKS`.

    The first frame is the reference. Unusable frames are skipped, and a truncated video is used as far as it goes.
    Raises DataError if it cannot be opened, shows no markers at the start, or has too few usable frames.
    """
    t_s, rows, moved, position, last = [], [], [], None, None
    try:
        engine = recording_engine(video.path)
        cycles = iter(engine)
        first = next(cycles, None)
    except LsdsError as error:
        raise DataError(naming(video.path, error)) from error
    except Exception as error:
        raise DataError(f"{video.path}: {type(error).__name__}: {error}") from error
    reference, start = engine.perception.reference, engine.perception.reference_frame
    if reference is None or start is None:
        raise DataError(f"{video.path}: no usable first frame")
    # A truncated video is usable up to its end.
    with suppress(LsdsError):
        for cycle in chain([] if first is None else [first], cycles):
            observation, image = cycle.observation, cycle.frame.image
            t_s.append((cycle.frame.t_ns - start.t_ns) * 1e-9)
            rows.append(signals_of(observation, float(image[_PIXELS, _PIXELS].mean())))
            moved.append(observation.field.displacement_m)
            position, last = observation.field.position_m, image
    if len(rows) < _LEAST_VIDEO_FRAMES or position is None or last is None:
        raise DataError(
            f"{video.path}: {len(rows)} usable frames after the first, at least {_LEAST_VIDEO_FRAMES} are needed"
        )
    labels = {"slip": np.full(len(rows), -1 if video.conflict else video.slip)}
    columns = from_rows(video.name, video.object, PROTOCOL, t_s, np.array(rows), labels)
    pitch_m = float(np.mean(reference.pitch_px)) * engine.perception.metres_per_px
    found = clip_signals(np.array(moved) / pitch_m, position / pitch_m)
    looks = np.full((len(rows), len(LOOKS)), np.nan, np.float32)
    looks[0], looks[-1] = look_of(start.image), look_of(last)
    columns |= {name: looks[:, index] for index, name in enumerate(LOOKS)}
    return columns | {name: found[:, index] for index, name in enumerate(CLIP_SIGNALS)}


def try_columns(video: Video) -> dict[str, NDArray[Any]] | str:
    """Return the columns of a video, or the reason of a failure."""
    try:
        return columns_of(video)
    except LsdsError as error:
        return str(error)
    except Exception as error:
        # A library may fail on a damaged video; the other videos are still used.
        return f"{video.path}: {type(error).__name__}: {error}"
