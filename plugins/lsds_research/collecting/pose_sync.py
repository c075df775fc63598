"""Matching streams of different rates by time: 60 Hz poses with 25 Hz tactile frames."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from typing import Protocol, TypeVar


class Timed(Protocol):
    """Anything with a time."""

    @property
    def t_ns(self) -> int:
        """Time of the sample (ns)."""
        ...


S = TypeVar("S", bound=Timed)


def nearest(samples: Sequence[S], t_ns: int, slop_ns: int) -> S | None:
    """Return the sample nearest in time, the earlier of two equally near; None without one within `slop_ns`.

    `samples` are in order of time, without duplicates.
    """
    after = bisect_left(samples, t_ns, key=lambda sample: sample.t_ns)
    near = samples[max(0, after - 1) : after + 1]
    best = min(near, key=lambda sample: abs(sample.t_ns - t_ns), default=None)
    return best if best is not None and abs(best.t_ns - t_ns) <= slop_ns else None
