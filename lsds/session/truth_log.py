"""The true states of the simulated cell, sampled during a run."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from lsds.clock import NS_PER_S

if TYPE_CHECKING:
    from lsds.contracts import Cell, CellTruth

#: Maximum age of an exposure to look up, s.
OLDEST_EXPOSURE_S = 1.0


class TruthLog:
    """Samples a cell's truth and finds the sample nearest to an exposure. Without a cell it stays empty."""

    def __init__(self, cell: Cell | None, rate_hz: float) -> None:
        self._cell = cell
        self._apart_ns = round(1.5 * NS_PER_S / rate_hz)
        self._recent: deque[CellTruth] = deque(maxlen=max(8, round(OLDEST_EXPOSURE_S * rate_hz)))
        self.samples: list[CellTruth] = []

    def sample(self, now_ns: int) -> CellTruth | None:
        """Advance the cell to the present and store its truth."""
        if self._cell is None:
            return None
        self._cell.advance(now_ns)
        truth = self._cell.truth()
        self._recent.append(truth)
        self.samples.append(truth)
        return truth

    def release(self) -> None:
        """Forget the cell, which takes some 40 MB; the samples stay."""
        self._cell = None

    def at(self, t_ns: int) -> CellTruth | None:
        """Return the sample nearest to a time, None if no sample lies within one and a half intervals."""
        nearest: CellTruth | None = None
        for truth in reversed(self._recent):
            if nearest is not None and abs(truth.t_ns - t_ns) > abs(nearest.t_ns - t_ns):
                break
            nearest = truth
        return nearest if nearest is not None and abs(nearest.t_ns - t_ns) <= self._apart_ns else None
