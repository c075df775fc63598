"""The gate: the one place that decides whether a frame is usable, and says why not.

A frame is refused where its image shows nothing (black, saturated, without a colour, of the wrong shape), where its
time stamp cannot be true, where the whole image trembles, where it repeats the image before while something depends on
it, and where hardly a dot of it can be followed. A stream without usable frames for too long stops the cell.
`check_image` asks about one image, `FrameGate` keeps the book of a stream.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.clock import nanoseconds
from lsds.errors import DataError
from lsds.safety.monitors import Freshness
from lsds.tactile.unrest import Unrest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame, MarkerTracks, SensorSpec
    from lsds.safety.guard import SafetyOptions

#: Time that a camera may take for its first frame, s.
FIRST_FRAME_S = 3.0
#: With fewer of its dots followed than this share, a gel is as good as not seen.
BLIND_SHARE = 0.3
#: Refusals that are kept; beyond that only their number is.
_KEPT = 10_000


@dataclass(frozen=True, slots=True)
class Refusal:
    """A frame that was not used, and why. `seq` is -1 where the sensor gave no frame to speak of."""

    t_ns: int
    seq: int
    reason: str


class FrameGate:
    """Admits the frames of one finger. `source` names it in messages.

    A recording (`live` false) is admitted frame by frame by its images alone: it has no clock to be late by.
    """

    def __init__(
        self, source: str, spec: SensorSpec, safety: SafetyOptions, start_ns: int, *, live: bool = True
    ) -> None:
        self._spec = spec
        self._live = live
        self._fresh = Freshness(
            source,
            start_ns,
            nanoseconds(safety.stale_after_s),
            allowance_ns=nanoseconds(FIRST_FRAME_S),
            remedy="check the sensor and its cable",
        )
        self._changing = Freshness(
            source,
            start_ns,
            nanoseconds(max(safety.frozen_after_s, safety.stale_after_s)),
            remedy="the camera repeats one image",
        )
        self._repeated = RepeatedImage()
        self._unrest = Unrest()
        self.refused = 0
        self.refusals: deque[Refusal] = deque(maxlen=_KEPT)

    def admit(self, frame: Frame, now_ns: int, *, depends: bool) -> bool:
        """Return whether perception may have the frame; `depends` tells whether an object or a moving arm does.

        Raises SafetyStop where nothing usable came for too long.
        """
        if self._live and not self._fresh.stamped(frame.t_ns, now_ns):
            self.refuse(self._fresh.reason, now_ns, frame.seq)
            return False
        if self._live and self._unrest.seen(frame.image):
            reason = f"the whole image changes by {self._unrest.level:.0f} levels from frame to frame (noise? flicker?)"
            self.refuse(f"frame {frame.seq}: {reason}", now_ns, frame.seq)
            return False
        if not self._live or not self._repeated.seen(frame.image) or not depends:
            self._changing.good(now_ns)
            return True
        try:
            # Black is black again and again: that is no mere repetition, and does not have its patience.
            check_image(frame, self._spec)
        except DataError as error:
            self.refuse(str(error), now_ns, frame.seq)
            return False
        self._fresh.good(now_ns)
        self._changing.bad("the camera repeats one image")
        self._changing.require(now_ns)
        return False

    def followed(self, frame: Frame, tracks: MarkerTracks, now_ns: int) -> None:
        """Take note of how much of the gel is seen. Raises SafetyStop where that was too little for too long."""
        share = float(np.count_nonzero(tracks.valid)) / len(tracks.valid)
        if share >= BLIND_SHARE or (share > 0 and not self._live):
            self.good(now_ns)
        elif not self._live:
            self.refuse(f"frame {frame.seq}: none of the dots can be followed for certain", now_ns, frame.seq)
        else:
            self.refuse(f"frame {frame.seq}: only {100 * share:.0f} % of the dots can be followed", now_ns, frame.seq)

    def good(self, now_ns: int) -> None:
        """Take note of a frame that could be used."""
        self._fresh.good(now_ns)

    def refuse(self, reason: str, now_ns: int, seq: int = -1) -> None:
        """Count a frame that cannot be used. Raises SafetyStop where there was no other for too long."""
        self.refused += 1
        self.refusals.append(Refusal(now_ns, seq, reason))
        self.silent(reason, now_ns)

    def silent(self, reason: str, now_ns: int) -> None:
        """Take note that there is no new frame, and why if that is known. Raises SafetyStop after too long."""
        if reason:
            self._fresh.bad(reason)
        if self._live:
            self._fresh.require(now_ns)


class RepeatedImage:
    """Notices an image that is the last one again: a camera's noise never comes twice.

    A few rows tell nearly always; only where they repeat the whole image is looked at.
    """

    _ROWS = 48

    def __init__(self) -> None:
        self._rows: NDArray[np.uint8] | None = None
        self._image: NDArray[np.uint8] | None = None

    def seen(self, image: NDArray[np.uint8]) -> bool:
        """Take an image (height, width, 3); return whether it repeats the one before."""
        rows = image[:: self._ROWS]
        repeated = (
            self._rows is not None
            and self._image is not None
            and np.array_equal(rows, self._rows)
            and np.array_equal(image, self._image)
        )
        if not repeated:
            self._rows, self._image = rows.copy(), image
        return repeated


#: A frame of which more than this share is saturated, or that is black, shows nothing that could be measured.
UNUSABLE_SHARE = 0.5
BLACK_SHARE = 0.95
_DARK, _BRIGHT = 8, 247
_BRIGHTEST_BLACK = 2 * (BLACK_SHARE * _DARK + (1 - BLACK_SHARE) * 255)


def check_image(frame: Frame, spec: SensorSpec) -> None:
    """Raise DataError where the image is not uint8 RGB of the sensor's size, or is mostly saturated or black, or
    lacks a colour.

    The message names the frame and the remedy.
    """
    image = frame.image
    expected = (spec.height_px, spec.width_px, 3)
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8 or image.shape != expected:
        what = f"{image.dtype} {image.shape}" if isinstance(image, np.ndarray) else type(image).__name__
        broken = isinstance(image, np.ndarray) and image.dtype.kind == "f" and bool(np.isnan(image).any())
        what += " with NaN in it" if broken else ""
        raise DataError(
            f"frame {frame.seq}: expected a uint8 RGB image {expected}, got {what} "
            "(convert to 8-bit RGB and resize to the sensor's size)"
        )
    # Red and blue carry the dots, all three the contact: half of any of them gone is too much. The mean colour settles
    # it for nearly every frame: half saturated cannot be darker, and nearly all black not brighter, than this.
    sample = np.ascontiguousarray(image[4::8, 4::8])
    red, green, blue, _ = cv2.mean(sample)
    colours = (red, green, blue)
    if max(colours) < UNUSABLE_SHARE * _BRIGHT and red + blue > _BRIGHTEST_BLACK and min(colours) > _DARK:
        return
    sample = sample.reshape(-1, 3)
    bright = sample >= _BRIGHT
    limit = UNUSABLE_SHARE * len(sample)
    if np.count_nonzero(bright) > limit and bright.sum(axis=0).max() > limit:
        raise DataError(f"frame {frame.seq}: most of the image is saturated (lower the exposure, shield the gel)")
    # Without red and blue there are no dots, however green the image.
    if np.count_nonzero(sample[:, ::2] <= _DARK) > BLACK_SHARE * 2 * len(sample):
        raise DataError(f"frame {frame.seq}: the image is black (is the sensor lit? was the frame torn?)")
    missing = [name for name, level in zip(("red", "green", "blue"), colours, strict=True) if level <= _DARK]
    if missing:
        # Two colours still show the dots, but not which way a slope faces: an imprint's edges would come from noise.
        raise DataError(f"frame {frame.seq}: the image has no {' and no '.join(missing)} (is a lamp out?)")
