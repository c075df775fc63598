"""Touch detection: the first frame in which the light on the gel differs from that without contact.

Under a flat face that is pressed evenly, markers hardly move and slopes are too small for a depth map. But the relief
of any real surface changes the light a little everywhere. The detector compares block means of the image with those of
the last frames without contact; its score is the change divided by the noise of that change. A plain touch shows in one
frame. The smooth face of a phone changes each block by less than the noise of a frame, but in all frames alike: that
shows in the product of two frames' changes, to which independent noise contributes nothing. Two frames may have the
same noise by chance or by repetition, so the median of several pairs counts.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence
from itertools import combinations
from statistics import median
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame, Situation

    Blocks = NDArray[np.float32]

BLOCKS = (64, 48)
"""Columns and rows of block means."""
LEARNT = 16
"""Number of recent frames without contact that a frame is compared with."""
LEAST_LEARNT_FRAMES = 6
"""Minimum number of such frames."""
LEARNING_DELAY_FRAMES = 8
"""Frames without touch after which a frame is learnt from: a faint touch that grows slowly must not be learnt."""
LEARNING_TRAVEL_M = 1.5e-3
"""Closing of the fingers without touch after which a frame is learnt from, m: the smooth face of a phone shows when
both gels are pressed in by 0.85 mm together (simulated)."""
AT_REST_M = 1e-4
"""Closing since the start up to which the fingers have not begun to close, m: below a tick of the gripper."""
MOST_WAITING = 256
"""Maximum number of frames that wait to be learnt from; chosen, for bounded memory."""
TOUCHED = 6.0
"""Change, in standard deviations, that is a touch."""
APERTURES = 256
"""Number of gripper states that are kept."""
PAIRED_FRAMES = 4
"""Number of recent frames whose changes are multiplied in pairs: a faint touch is found at most 3 frames late."""
PAIR_DISTANCE_FRAMES = 2
"""Minimum distance of a pair, frames: a camera may send parts of a frame twice, with the same noise."""
PAIRS = [(m, n) for m, n in combinations(range(PAIRED_FRAMES), 2) if n - m >= PAIR_DISTANCE_FRAMES]
"""The pairs of the recent frames: three."""
LEAST_CHANGE = 1e-3
"""Minimum standard deviation of the change, grey levels: that assumed for a camera without noise."""
SCATTER = 1 / math.sqrt(2 * 3 * BLOCKS[0] * BLOCKS[1])
"""Minimum relative standard deviation of the change: the expected one, which few frames may underestimate."""

PRODUCT_SCATTER = 0.67 / math.sqrt(3 * BLOCKS[0] * BLOCKS[1])
"""Minimum standard deviation of the product, noise squared: that of the median of three independent pairs, 0.67 times
that of one."""


class TouchSense:
    """Detects contact in the frames of one sensor.

    `score` is the last frame's change in standard deviations. `frozen` is true if the frame repeats the last one,
    although the camera has noise. The detector learns from frames without contact, from `reset` until the first touch:
    an object that touches from the start is learnt as part of the gel.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start again without contact."""
        self.score, self.frozen = 0.0, False
        self._newest: Blocks | None = None
        self._noisy = True
        self._free: deque[Blocks] = deque()
        # The sum of these, in double precision: adding and taking off leaves errors of 1e-13.
        self._sum = np.zeros((3, BLOCKS[0] * BLOCKS[1]))
        self._changes: deque[float] = deque(maxlen=LEARNT)
        self._products: deque[float] = deque(maxlen=LEARNT)
        self._waiting: deque[tuple[Blocks, float, float, float]] = deque(maxlen=MOST_WAITING)
        self._widest_m = -math.inf
        self.forget()

    def forget(self) -> None:
        """Multiply frames from now on only: the fingers have opened, and what they touched may be gone."""
        self._recent: deque[Blocks] = deque(maxlen=PAIRED_FRAMES)

    def update(self, frame: Frame, aperture_m: float = math.nan) -> bool:
        """Take the next frame; return whether an object touches the gel. False until enough frames were taken.

        `aperture_m` is the gripper's aperture at the frame's time, NaN if it is not known.
        """
        self._widest_m = max(self._widest_m, aperture_m)
        blocks = _block_means(frame.image)
        repeated = self._newest is not None and np.array_equal(blocks, self._newest)
        if len(self._changes) < LEAST_LEARNT_FRAMES:
            # Without noise, a frozen camera looks like one whose scene does not change.
            self._noisy = self._noisy and not repeated
        self.frozen, self._newest = repeated and self._noisy, blocks
        if not self._free:
            self._keep(blocks)
            return False
        still = (self._sum / len(self._free)).astype(np.float32)
        blocks, gain = _in_the_light_of(still, blocks)
        if len(self._free) < LEAST_LEARNT_FRAMES:
            self._keep(blocks)
            return False
        # The gain converts to the frame's levels, those of the camera's noise. The mean of n frames adds its noise.
        change = gain * float(np.sqrt(np.mean((blocks - still) ** 2))) / math.sqrt(1 + 1 / len(self._free))
        if len(self._changes) < LEAST_LEARNT_FRAMES:
            self._learn(blocks, change)
            return False
        mean, std = _mean_and_std(self._changes)
        self.score = (change - mean) / max(std, SCATTER * mean, LEAST_CHANGE)
        if not repeated:
            self._recent.append(blocks)
        product = gain**2 * self._common_product(still)
        if len(self._products) >= LEAST_LEARNT_FRAMES and math.isfinite(product):
            mean_product, std = _mean_and_std(self._products)
            noise = max(std, PRODUCT_SCATTER * mean**2, LEAST_CHANGE**2)
            self.score = max(self.score, (product - mean_product) / noise)
        if self.score > TOUCHED:
            self._waiting.clear()
            return True
        self._waiting.append((blocks, change, product, aperture_m))
        while self._is_free():
            old_blocks, old_change, old_product, _ = self._waiting.popleft()
            self._learn(old_blocks, old_change)
            if math.isfinite(old_product):
                self._products.append(old_product)
        return False

    def _is_free(self) -> bool:
        """Return whether the oldest waiting frame shows no contact: a faint touch would have grown since."""
        if len(self._waiting) <= LEARNING_DELAY_FRAMES:
            return False
        old_m, now_m = self._waiting[0][-1], self._waiting[-1][-1]
        return not (old_m - now_m < LEARNING_TRAVEL_M and self._widest_m - now_m > AT_REST_M)

    def _common_product(self, still: Blocks) -> float:
        """Return the median product of the recent frames' changes, in pairs that lie apart; NaN with too few frames."""
        if len(self._recent) < PAIRED_FRAMES:
            return math.nan
        changes = [(blocks - still).ravel() for blocks in self._recent]
        return median(float(changes[first] @ changes[second]) for first, second in PAIRS) / still.size

    def _learn(self, blocks: Blocks, change: float) -> None:
        self._keep(blocks)
        self._changes.append(change)

    def _keep(self, blocks: Blocks) -> None:
        """Add block means to those without contact, of which the newest `LEARNT` are kept."""
        self._free.append(blocks)
        self._sum += blocks
        if len(self._free) > LEARNT:
            self._sum -= self._free.popleft()


def _mean_and_std(values: Collection[float]) -> tuple[float, float]:
    """Return mean and standard deviation of a few numbers, for which NumPy takes three times as long."""
    mean = math.fsum(values) / len(values)
    return mean, math.sqrt(math.fsum((value - mean) ** 2 for value in values) / len(values))


def _block_means(image: NDArray[np.uint8]) -> Blocks:
    """Return the means (3, blocks) of an image (h, w, 3). Sums along a colour's own row are several times faster."""
    # Means rounded to integers would hide a faint relief.
    means = cv2.resize(image.astype(np.float32), BLOCKS, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.split(means), np.float32).reshape(3, -1)


def _in_the_light_of(still: Blocks, blocks: Blocks) -> tuple[Blocks, float]:
    """Return blocks (3, blocks) with each colour's gain and offset matched to `still`, and their mean gain.

    A varying lamp or exposure changes the whole image alike; matching removes it.
    """
    mean = still.mean(axis=1, keepdims=True)
    centred, own = still - mean, blocks - blocks.mean(axis=1, keepdims=True)
    gain = (own * centred).sum(axis=1, keepdims=True) / np.maximum((centred**2).sum(axis=1, keepdims=True), 1e-6)
    gain = np.maximum(gain, 1e-3)
    return np.asarray(own / gain + mean, np.float32), float(gain.mean())


MISTAKEN = 2
"""Frames without touch in a row after which the touch before them was none: the light flickered in one frame."""


class TouchFinder:
    """Finds the aperture at which each finger touches, while the fingers close.

    `names` are the rig's fingers, so that a finger without frames is noticed. Feed it every situation. A frame is older
    than the gripper's newest state, so its aperture is interpolated at its time.
    """

    def __init__(self, names: Sequence[str], start_ns: int) -> None:
        self._senses = {name: TouchSense() for name in names}
        self._apertures: deque[tuple[int, float]] = deque(maxlen=APERTURES)
        # Per finger: time of the newest frame, then of the frames that are not frozen time, arrival and number.
        self._taken_ns = dict.fromkeys(names, -1)
        self._seen_ns = dict.fromkeys(names, -1)
        self._heard_ns = dict.fromkeys(names, start_ns)
        self._count = dict.fromkeys(names, 0)
        self._free_m: dict[str, float] = {}
        # Per finger: apertures of the last frame without touch and of the first with it.
        self._touched_m: dict[str, tuple[float, float]] = {}
        self._touching = dict.fromkeys(names, False)
        self._untouched = dict.fromkeys(names, 0)

    def see(self, now: Situation) -> None:
        """Take the new frames and gripper state of a situation."""
        if now.gripper is not None and (not self._apertures or now.gripper.t_ns > self._apertures[-1][0]):
            self._apertures.append((now.gripper.t_ns, now.gripper.aperture_m))
        for finger in now.fingers:
            name, frame = finger.finger, finger.frame
            if self._taken_ns[name] != frame.t_ns:
                self._taken_ns[name] = frame.t_ns
                self._take(name, frame, now.t_ns)

    @property
    def frames(self) -> int:
        """Number of frames of the finger with the fewest; frozen frames do not count."""
        return min(self._count.values(), default=0)

    @property
    def seen_ns(self) -> int:
        """Time up to which every finger has frames; -1 if one has none."""
        return min(self._seen_ns.values(), default=-1)

    def silent_s(self, now_ns: int) -> tuple[float, str]:
        """Return the longest time (s) since a finger's last new frame, and that finger."""
        return max(((now_ns - heard) * 1e-9, name) for name, heard in self._heard_ns.items())

    @property
    def touching(self) -> bool:
        """Whether the newest frame of any finger shows a touch."""
        return any(self._touching.values())

    @property
    def apart(self) -> tuple[str, ...]:
        """The fingers whose newest frame shows no touch."""
        return tuple(name for name, touches in self._touching.items() if not touches)

    @property
    def touch_m(self) -> float:
        """Aperture at which the last finger touched, m; NaN before the first touch."""
        return min(((free + at) / 2 for free, at in self._touched_m.values()), default=math.nan)

    @property
    def std_m(self) -> float:
        """Standard deviation of `touch_m`, m: the touch lies between two frames."""
        return max((abs(free - at) / math.sqrt(12) for free, at in self._touched_m.values()), default=math.nan)

    def again(self) -> None:
        """Forget the touch, but not the learnt gel without contact."""
        self._touched_m.clear()

    def forget(self) -> None:
        """Judge by frames from now on: the fingers have opened."""
        for sense in self._senses.values():
            sense.forget()

    def _take(self, name: str, frame: Frame, now_ns: int) -> None:
        aperture = aperture_at(self._apertures, frame.t_ns)
        touches = self._senses[name].update(frame, aperture)
        if self._senses[name].frozen:
            return
        self._seen_ns[name] = frame.t_ns
        self._count[name] += 1
        self._heard_ns[name] = now_ns
        self._touching[name] = touches
        self._untouched[name] = 0 if touches else self._untouched[name] + 1
        if not touches:
            self._free_m[name] = aperture
            # The contact of fingers that close farther grows, so a free gel there contradicts the touch.
            if self._untouched[name] >= MISTAKEN or aperture < min(self._touched_m.get(name, (math.nan,))):
                self._touched_m.pop(name, None)
        elif name not in self._touched_m:
            self._touched_m[name] = self._free_m.get(name, aperture), aperture


def aperture_at(apertures: Sequence[tuple[int, float]], t_ns: int) -> float:
    """Return the aperture (m) at a time; NaN if none is known.

    It is interpolated between pairs (t_ns, aperture), which are in order of time.
    """
    later = None
    for earlier in reversed(apertures):
        if earlier[0] <= t_ns:
            if later is None:
                return earlier[1]
            share = (t_ns - earlier[0]) / (later[0] - earlier[0])
            return earlier[1] + share * (later[1] - earlier[1])
        later = earlier
    return math.nan if later is None else later[1]
