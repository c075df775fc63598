"""Match streams of different rates by time, for example 60 Hz poses with 25 Hz tactile frames.

Pure functions of samples that have a `t_ns`, in order of time.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar

from lsds.contracts.values import Pose, Quaternion


class Timed(Protocol):
    """A sample with a time."""

    @property
    def t_ns(self) -> int:
        """Time at which it was true, ns."""


S = TypeVar("S", bound=Timed)


def nearest(samples: Sequence[S], t_ns: int, slop_ns: int) -> S | None:
    """Return the sample nearest in time, the earlier of two equally near; None where none is within `slop_ns`.

    `samples` are in order of time, none of them twice.
    """
    after = bisect_left(samples, t_ns, key=lambda sample: sample.t_ns)
    near = samples[max(0, after - 1) : after + 1]
    best = min(near, key=lambda sample: abs(sample.t_ns - t_ns), default=None)
    return best if best is not None and abs(best.t_ns - t_ns) <= slop_ns else None


def around(samples: Sequence[S], t_ns: int, slop_ns: int) -> tuple[S, S] | None:
    """Return the last sample at or before and the first at or after an instant, each within `slop_ns` of it."""
    after = bisect_left(samples, t_ns, key=lambda sample: sample.t_ns)
    if after < len(samples) and samples[after].t_ns == t_ns:
        return samples[after], samples[after]
    if after == 0 or after == len(samples):
        return None
    early, late = samples[after - 1], samples[after]
    return (early, late) if t_ns - early.t_ns <= slop_ns and late.t_ns - t_ns <= slop_ns else None


def pairs(samples: Sequence[S], times_ns: Sequence[int], slop_ns: int) -> list[S | None]:
    """Return for each time the nearest sample, each sample once at most: the time it is nearest to gets it.

    Both in order of time. This is approximate-time synchronisation where one stream is the reference.
    """
    found: list[S | None] = []
    owner: dict[int, int] = {}
    for place, t_ns in enumerate(times_ns):
        sample = nearest(samples, t_ns, slop_ns)
        if sample is not None:
            rival = owner.get(sample.t_ns)
            if rival is not None:
                if abs(times_ns[rival] - sample.t_ns) <= abs(t_ns - sample.t_ns):
                    sample = None
                else:
                    found[rival] = None
            if sample is not None:
                owner[sample.t_ns] = place
        found.append(sample)
    return found


def interpolated(early: Pose, late: Pose, share: float) -> Pose:
    """Return the pose a `share` (0..1) of the way: straight in position, by the shorter arc in rotation."""
    x, y, z = (a + share * (b - a) for a, b in zip(early.position_m, late.position_m, strict=True))
    return Pose((x, y, z), slerp(early.quaternion_xyzw, late.quaternion_xyzw, share))


def slerp(early: Quaternion, late: Quaternion, share: float) -> Quaternion:
    """Return the unit quaternion a `share` of the way along the shorter arc (Shoemake 1985)."""
    cosine = sum(a * b for a, b in zip(early, late, strict=True))
    sign = -1.0 if cosine < 0 else 1.0
    angle = math.acos(min(1.0, abs(cosine)))
    if angle < 1e-6:
        weights = (1.0 - share, sign * share)
    else:
        weights = (math.sin((1 - share) * angle) / math.sin(angle), sign * math.sin(share * angle) / math.sin(angle))
    mixed = [weights[0] * a + weights[1] * b for a, b in zip(early, late, strict=True)]
    length = math.hypot(*mixed)
    qx, qy, qz, qw = (part / length for part in mixed)
    return qx, qy, qz, qw


class RecentSamples(Generic[S]):
    """The newest samples of a stream, for looking up the state at the time of a slower stream's sample."""

    def __init__(self, kept: int = 128) -> None:
        self._samples: deque[S] = deque(maxlen=kept)

    def add(self, sample: S) -> None:
        """Add a sample; ignored if it is not newer than the last one."""
        if not self._samples or sample.t_ns > self._samples[-1].t_ns:
            self._samples.append(sample)

    def nearest(self, t_ns: int, slop_ns: int) -> S | None:
        """Return the nearest sample within `slop_ns`, None if there is none."""
        return nearest(tuple(self._samples), t_ns, slop_ns)

    def around(self, t_ns: int, slop_ns: int) -> tuple[S, S] | None:
        """Return the samples before and after, for interpolation; None if one is missing or too far away."""
        return around(tuple(self._samples), t_ns, slop_ns)
