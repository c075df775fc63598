"""The gate: the one place that decides whether a frame is usable, and gives the reason if not.

The gate refuses a frame if its image is unusable (black, saturated, without a colour, of the wrong shape), if its time
stamp is impossible, if the whole image trembles, if it repeats the last image while something depends on it, or if
hardly any marker can be tracked. A stream without usable frames for too long stops the cell, and so does a part of the
image that repeats for as long. `check_image` checks one image; `FrameGate` checks a stream.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.clock import nanoseconds, seconds
from lsds.errors import DataError, SafetyStop
from lsds.safety.monitors import Freshness
from lsds.tactile.tile_watch import FrozenPart, Unrest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame, MarkerTracks, SensorSpec
    from lsds.safety.guard import SafetyOptions

#: Maximum time until a camera's first frame, s.
FIRST_FRAME_S = 3.0
#: Minimum share of the markers that must be tracked; with fewer, the frame is refused.
BLIND_SHARE = 0.3
#: Minimum share of the image that repeats if a part of it is frozen; chosen: the contact may lie in any tenth.
FROZEN_SHARE = 0.1
#: Number of refusals kept with their reasons; older ones are only counted.
_REFUSALS_KEPT = 10_000


@dataclass(frozen=True, slots=True)
class Refusal:
    """A refused frame and the reason. `seq` is -1 if the sensor delivered no frame."""

    t_ns: int
    seq: int
    reason: str


class FrameGate:
    """Admits the frames of one finger. `source` names it in messages.

    In a recording (`live` false) only the images are checked: without a clock, no frame is late.
    """

    def __init__(
        self, source: str, spec: SensorSpec, safety: SafetyOptions, start_ns: int, *, live: bool = True
    ) -> None:
        self._spec = spec
        self._live = live
        self._source, self._frozen_after_s = source, max(safety.frozen_after_s, safety.stale_after_s)
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
            nanoseconds(self._frozen_after_s),
            remedy="the camera repeats one image",
        )
        self._repeated, self._frozen = RepeatedImage(), FrozenPart()
        self._whole_ns: int | None = None
        self._unrest = Unrest()
        self.refused = 0
        self.refusals: deque[Refusal] = deque(maxlen=_REFUSALS_KEPT)

    def admit(self, frame: Frame, now_ns: int, *, depends: bool) -> bool:
        """Return whether perception may use the frame; `depends` is whether an object or a moving arm relies on it.

        Raises SafetyStop if no usable frame arrived for too long.
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
            self._require_whole(frame, now_ns, depends=depends)
            return True
        try:
            # A repeated black image counts as unusable, not as frozen, so the shorter limit applies.
            check_image(frame, self._spec)
        except DataError as error:
            self.refuse(str(error), now_ns, frame.seq)
            return False
        self._fresh.good(now_ns)
        self._changing.bad("the camera repeats one image")
        self._changing.require(now_ns)
        return False

    def _require_whole(self, frame: Frame, now_ns: int, *, depends: bool) -> None:
        """Raise SafetyStop if a part of the image has repeated for too long while something depends on it."""
        share = self._frozen.share(frame.image, learns=not depends) if self._live else 0.0
        if share < FROZEN_SHARE or self._whole_ns is None:
            self._whole_ns = now_ns
            return
        repeats_s = seconds(now_ns - self._whole_ns)
        if repeats_s > self._frozen_after_s:
            raise SafetyStop(
                f"{self._source}: {100 * share:.0f} % of the image has repeated for {repeats_s:.2f} s, "
                f"the limit is {self._frozen_after_s:.2f} s (restart the camera, or check its compression)"
            )

    def followed(self, frame: Frame, tracks: MarkerTracks, now_ns: int) -> None:
        """Record the share of tracked markers. Raises SafetyStop if it was too low for too long."""
        share = float(np.count_nonzero(tracks.valid)) / len(tracks.valid)
        if share >= BLIND_SHARE or (share > 0 and not self._live):
            self.good(now_ns)
        elif not self._live:
            self.refuse(f"frame {frame.seq}: none of the dots can be followed for certain", now_ns, frame.seq)
        else:
            self.refuse(f"frame {frame.seq}: only {100 * share:.0f} % of the dots can be followed", now_ns, frame.seq)

    def good(self, now_ns: int) -> None:
        """Record a usable frame."""
        self._fresh.good(now_ns)

    def refuse(self, reason: str, now_ns: int, seq: int = -1) -> None:
        """Count an unusable frame. Raises SafetyStop if no usable frame arrived for too long."""
        self.refused += 1
        self.refusals.append(Refusal(now_ns, seq, reason))
        self.silent(reason, now_ns)

    def silent(self, reason: str, now_ns: int) -> None:
        """Record that there is no new frame, and the reason if known. Raises SafetyStop after too long."""
        if reason:
            self._fresh.bad(reason)
        if self._live:
            self._fresh.require(now_ns)


class RepeatedImage:
    """Detects a repeated image: a camera's noise never repeats.

    A few rows nearly always suffice; the whole image is compared only if they repeat.
    """

    _ROWS = 48

    def __init__(self) -> None:
        self._rows: NDArray[np.uint8] | None = None
        self._image: NDArray[np.uint8] | None = None

    def seen(self, image: NDArray[np.uint8]) -> bool:
        """Take an image (height, width, 3); return whether it repeats the last one."""
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


#: Maximum saturated share of a usable image.
UNUSABLE_SHARE = 0.5
#: Maximum black share of a usable image.
BLACK_SHARE = 0.95
#: Maximum level of a black pixel, of 255; chosen.
_DARK_LEVEL = 8
#: Minimum level of a saturated pixel, of 255; chosen.
_BRIGHT_LEVEL = 247
#: Maximum sum of the mean red and blue of an image with the allowed share of black pixels, if the others are white.
_BRIGHTEST_BLACK = 2 * (BLACK_SHARE * _DARK_LEVEL + (1 - BLACK_SHARE) * 255)


def check_image(frame: Frame, spec: SensorSpec) -> None:
    """Raise DataError if an image is unusable.

    It must be uint8 RGB of the sensor's size, not mostly saturated or black, and have all three colours. The message
    names the frame and the remedy.
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
    # Red and blue show the markers, all three colours the contact: losing half of any is too much. The mean colour
    # decides for nearly every frame: a half-saturated image cannot be darker, a nearly black one not brighter.
    sample = np.ascontiguousarray(image[4::8, 4::8])
    red, green, blue, _ = cv2.mean(sample)
    colours = (red, green, blue)
    if max(colours) < UNUSABLE_SHARE * _BRIGHT_LEVEL and red + blue > _BRIGHTEST_BLACK and min(colours) > _DARK_LEVEL:
        return
    sample = sample.reshape(-1, 3)
    bright = sample >= _BRIGHT_LEVEL
    limit = UNUSABLE_SHARE * len(sample)
    if np.count_nonzero(bright) > limit and bright.sum(axis=0).max() > limit:
        raise DataError(f"frame {frame.seq}: most of the image is saturated (lower the exposure, shield the gel)")
    # Without red and blue no marker is visible, however green the image.
    if np.count_nonzero(sample[:, ::2] <= _DARK_LEVEL) > BLACK_SHARE * 2 * len(sample):
        raise DataError(f"frame {frame.seq}: the image is black (is the sensor lit? was the frame torn?)")
    missing = [name for name, level in zip(("red", "green", "blue"), colours, strict=True) if level <= _DARK_LEVEL]
    if missing:
        # Two colours still show the markers, but not the direction of slopes: an imprint's edges would be noise.
        raise DataError(f"frame {frame.seq}: the image has no {' and no '.join(missing)} (is a lamp out?)")
