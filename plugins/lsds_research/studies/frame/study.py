"""Study `frame`: what one frame costs, as tables and a chart."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from itertools import count
from typing import TYPE_CHECKING

from lsds.contracts.study import StudyResult, StudyTable
from lsds_research.studies.frame.cost import Cost, FrameCost, measure
from lsds_research.studies.frame.plot import plot_frame_cost

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_research.studies.frame.options import FrameOptions

PARTS = (("name", "part", ""), ("p50_us", "us p50", ".1f"), ("p99_us", "us p99", ".1f"))
TRACKERS = (
    ("name", "tracker", ""),
    ("peer", "peer", ""),
    ("p50_us", "us p50", ".0f"),
    ("p99_us", "us p99", ".0f"),
    ("rms_px", "RMS px", ".4f"),
    ("kept_fraction", "kept", ".4f"),
    ("wrong_unflagged", "wrong, unflagged", ".4f"),
    ("jump_wrong_unflagged", "jumps: wrong, unflagged", ".4f"),
    ("jump_right", "right", ".4f"),
)


class FrameStudy:
    """A `Study`."""

    timed = ("p50_us", "p99_us")

    def __init__(self, options: FrameOptions, context: BuildContext) -> None:
        self.options = options

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run the simulated cell once and time its frames. Raises DataError if its sensor has no truth."""
        passes = count(1)
        cost = measure(self.options.seed, self.options.repeats, lambda: tick(next(passes), self.options.repeats))
        parts = [
            dataclasses.asdict(part) for part in (cost.total, *_portable(cost), *cost.parts, *cost.depth, *cost.peers)
        ]
        trackers = [dataclasses.asdict(score) for score in cost.trackers]
        changes = ", ".join(f"{change:.4f}" for change in cost.area_change)
        return StudyResult(
            f"simulated frames, {cost.frames} of one run; accuracies are against the simulated truth",
            TRACKERS,
            trackers,
            partial(plot_frame_cost, cost=cost),
            [f"contact area, mean difference to the finest depth map: {changes}", _compared(cost)],
            dataclasses.asdict(cost),
            [StudyTable(PARTS, parts)],
        )


def _portable(cost: FrameCost) -> tuple[Cost, ...]:
    return () if cost.portable is None else (cost.portable,)


def _compared(cost: FrameCost) -> str:
    if cost.peer_ratio is None:
        return "peer chains were not timed: they need scikit-learn and torch (pip install 'lsds-tactile[train]')"
    return f"the quickest peer chain takes {cost.peer_ratio:.1f} times as long as image to command (medians, in turns)"
