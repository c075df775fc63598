"""Gel tier 'auto': an elastic pad on the coarsest grid that meets a tolerance, found by retracing the path on another.

Two grids run: the one that answers, and an auditor that retraces the same path in long legs now and then. The
difference of the dots between a grid and the next finer one is, on a great many scenes, 0.8 to 1.1 of the coarser one's
error, and 0.2 to 0.5 of it is the finer one's. So either grid of a pair can audit the other, and to go finer
is to let the auditor answer, which has the whole history already.

Audits follow what makes errors grow: pressing, distance, and turns. Where they find little, they get rarer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.auto.path import Friction, Path
from lsds_mocks.gel.auto.report import Choice, FidelityReport
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.material import GelMaterial

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.protocol import Reaction
    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.gel.state import GelState

FINES = (1, 2, 4)
DEFAULT_TOLERANCE_M = 5e-6
_COARSER = 1.15
_FINER = 0.32
"""Error of a grid over its difference to the next finer, and to the next coarser one: high quantiles of many scenes."""
_EVER = 0.25
"""Part of the dots' motion that the coarsest grid's error has been at most: below the tolerance, nothing is asked."""
_RAISE = 1.0
_LOWER = 0.5
_NO_WORSE = 1.2
_PATIENCE = 3
"""Go finer where the estimate exceeds this part of the tolerance; coarser where that grid's would be below this part
for so many audits in a row. Audits get rarer where the estimate is below that part, or no worse than it has been."""
_NEAR_M = 0.1e-3
_FAR_M = 0.8e-3
"""Distances between audits: where they count, and where they have long found little."""
_PRESSED = 0.15
_SOON_M = 0.02e-3
"""A change of the indentation by this part calls for an audit after this distance."""
MOST_CELLS = 2500
"""Grids of more cells in contact are not gone to: they could not keep up with a running cell. The report says so."""
_FINEST_START = ((0.8e-6, 4), (2.5e-6, 2))


def _dots() -> NDArray[np.float64]:
    x, y = np.meshgrid((np.arange(9) - 4) * 2e-3, (np.arange(7) - 3) * 2e-3)
    return np.stack([x.ravel(), y.ravel()], axis=1)


DOTS_M = _dots()
"""Where errors are looked at: 9 x 7 dots, 2 mm apart."""


class AutoGel:
    """A `GelModel` with a tolerance on the RMS error of its dots; `first` plants a grid to begin with."""

    def __init__(
        self,
        shape: Shape,
        material: GelMaterial | None = None,
        *,
        tolerance_m: float = DEFAULT_TOLERANCE_M,
        follows: bool = True,
        first: FieldGel | None = None,
    ) -> None:
        self.shape = shape
        self.material = material or GelMaterial()
        self.tolerance_m = tolerance_m
        self._follows = follows
        self._main = first or self._new(next((fine for limit, fine in _FINEST_START if tolerance_m < limit), 1))
        self._views: dict[int, FieldGel] = {self._main.grid.fine: self._main}
        self._auditor: FieldGel | None = None
        self._path = Path()
        self._retraced = 0
        self._step = (0.0, 0.0, 0.0)
        self._indentation = 0.0
        self._reach: tuple[float, float] | None = None
        self._friction: Friction | None = None
        self._gone_m = self._to_next_m = 0.0
        self._wait_m = _NEAR_M
        self._audited_at_m = 0.0
        self._calm = 0
        self._worst = 0.0
        self._estimate: float | None = None
        self._audits = 0
        self._work = 0.0
        self._audit_work = 0.0
        self._choices = [Choice(0.0, self._main.grid.pitch_m, None, "coarsest that may do")]

    def _new(self, fine: int) -> FieldGel:
        return FieldGel(self.shape, self.material, fine=fine, follows=self._follows)

    # What a gel does, the answering grid does.

    @property
    def points_m(self) -> NDArray[np.float64]:
        """Centres of the answering grid's cells, (2, N)."""
        return self._main.points_m

    @property
    def force_tolerance(self) -> float:
        """The answering grid's."""
        return self._main.force_tolerance

    def press(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> float:
        """Set how deep the object stands; return the normal force (N)."""
        self._indentation, self._reach = indentation_m, reach_m
        return self._main.press(indentation_m, reach_m)

    def set_friction(self, friction: NDArray[np.float64]) -> None:
        """Set the friction coefficient of each cell."""
        self._main.set_friction(friction)
        self._friction = Friction(self._main.grid, self._main.cells, np.array(friction, float))

    def trial(self, dx_m: float, dy_m: float, dtheta_rad: float = 0.0) -> Reaction:
        """Carry the gel with the object."""
        self._step = (dx_m, dy_m, dtheta_rad)
        return self._main.trial(dx_m, dy_m, dtheta_rad)

    def commit(self) -> None:
        """Make the last trial real, and audit where it is time to."""
        self._main.commit()
        if self._indentation <= 0:
            self._let_go()
            return
        before = self._path.gone_m
        turned = self._path.add(self._step, self._indentation, self._reach, self._friction)
        self._gone_m += self._path.gone_m - before
        self._to_next_m -= self._path.gone_m - before
        if turned:
            self._wait_m, self._worst = _NEAR_M, 0.0
            self._to_next_m = min(self._to_next_m, _NEAR_M)
        if abs(self._indentation - self._audited_at_m) > _PRESSED * self._indentation:
            self._to_next_m = min(self._to_next_m, _SOON_M)
        if self._to_next_m <= 0 and self._gone_m > 0:
            self._audit()

    def _let_go(self) -> None:
        """Nothing touches: nothing is remembered."""
        if self._path.count or self._path.open:
            self._path, self._retraced, self._auditor = Path(start=self._main.place), 0, None
            self._calm, self._wait_m, self._to_next_m = 0, _NEAR_M, 0.0

    # Auditing.

    def _audit(self) -> None:
        """Retrace the path on the other grid of the pair, estimate this one's error, change grid where need be."""
        own = self._dots_of(self._main)
        if self._main.operator.kernel == "pad" and _EVER * _rms(own) < self.tolerance_m:
            self._to_next_m = _NEAR_M
            return
        if self._auditor is None:
            self._auditor, self._retraced = self._new(self._beside()), 0
        auditor = self._auditor
        self._retrace(auditor)
        self._audits += 1
        self._audited_at_m = self._indentation
        difference = _rms(own - self._dots_of(auditor))
        finer = auditor.grid.pitch_m < self._main.grid.pitch_m or auditor.operator.kernel != self._main.operator.kernel
        self._estimate = (_COARSER if finer else _FINER) * difference
        small = self._estimate < max(_LOWER * self.tolerance_m, _NO_WORSE * self._worst)
        self._worst = max(self._worst, self._estimate)
        self._wait_m = min(2 * self._wait_m, _FAR_M) if small else _NEAR_M
        self._to_next_m = self._wait_m
        if self._estimate > _RAISE * self.tolerance_m:
            self._calm = 0
            self._go_finer(finer)
        elif not finer and _COARSER * difference < _LOWER * self.tolerance_m:
            self._calm += 1
            if self._calm >= _PATIENCE:
                self._swap("the coarser grid will do")
        else:
            self._calm = 0

    def _beside(self) -> int:
        """Return the grid that audits the answering one: the finer of the first pair, else the next coarser one."""
        at = FINES.index(self._main.grid.fine)
        if self._main.operator.kernel != "pad":
            return self._main.grid.fine
        return FINES[1] if at == 0 else FINES[at - 1]

    def _go_finer(self, auditor_is: bool) -> None:
        """Let the auditor answer where it is the finer one; else make a finer grid and let it retrace the path."""
        if auditor_is:
            self._swap("the auditor disagrees")
            return
        at = FINES.index(self._main.grid.fine)
        if at + 1 == len(FINES) or 4 * self._main.cells.size > MOST_CELLS:
            return
        self._auditor, self._retraced = self._new(FINES[at + 1]), 0
        self._retrace(self._auditor)
        self._swap("the coarser auditor disagrees by too much")

    def _swap(self, why: str) -> None:
        """Let the auditor, which has come to the same place, answer, and the answering grid audit."""
        if self._auditor is None:
            return
        self._main, self._auditor = self._auditor, self._main
        if self._auditor.operator.kernel != "pad":
            self._auditor = None
        self._views[self._main.grid.fine] = self._main
        self._retraced = self._path.count
        self._calm, self._wait_m, self._to_next_m, self._worst = 0, _NEAR_M, _NEAR_M, 0.0
        self._choices.append(Choice(self._gone_m, self._main.grid.pitch_m, self._estimate, why))

    def _retrace(self, gel: FieldGel) -> None:
        """Lead another grid along what it has not been through yet."""
        path = self._path
        path.close()
        if self._retraced < path.dropped or (self._retraced == 0 and gel.place != path.start):
            gel.place = path.start
            self._retraced = path.dropped
            for step in range(1, 5):
                gel.press(step / 4 * path.legs[0].indentation_m, path.legs[0].reach_m)
                gel.trial(0.0, 0.0)
                gel.commit()
        sweeps = gel.work
        for leg in path.legs[self._retraced - path.dropped :]:
            gel.press(leg.indentation_m, leg.reach_m)
            if leg.friction is not None:
                gel.set_friction(_over(leg.friction, gel))
            gel.trial(leg.dx_m, leg.dy_m, leg.dtheta_rad)
            gel.commit()
        self._retraced = path.count
        self._audit_work += gel.work - sweeps

    def _dots_of(self, gel: FieldGel) -> NDArray[np.float64]:
        return gel.displacement_now(DOTS_M)

    def report(self) -> FidelityReport:
        """Return what was chosen, why, at what cost, and what cannot be promised."""
        gels = {id(gel): gel for gel in (self._main, self._auditor, *self._views.values()) if gel is not None}
        work = sum(gel.work for gel in gels.values())
        return FidelityReport(
            self.tolerance_m,
            self._main.grid.pitch_m,
            self._estimate,
            self._audits,
            tuple(self._choices),
            work,
            self._audit_work / work if work else 0.0,
            self._indentation / self.material.thickness_m,
            self._main.wall_distance_m,
            self._main.unconverged,
        )

    # What a gel can be asked, the answering grid is asked.

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Which cells slid in the last committed step."""
        return self._main.sliding

    @property
    def stick_ratio(self) -> float:
        """Share of the cells in contact that did not slide."""
        return self._main.stick_ratio

    @property
    def fully_sliding(self) -> bool:
        """Whether every cell in contact slid in the last committed step."""
        return self._main.fully_sliding

    @property
    def elastic_energy_j(self) -> float:
        """Stored energy; it jumps a little where the grid changes."""
        return self._main.elastic_energy_j

    def state(self) -> GelState:
        """Return a copy of where the gel stands; it names its grid."""
        return self._main.state()

    def restore(self, state: GelState) -> None:
        """Put a state back; what led there is not known, so audits begin anew."""
        self._main = self._view(state)
        self._main.restore(state)
        self._indentation, self._reach = state.indentation_m, state.reach_m
        self._path, self._retraced, self._auditor = Path(start=self._main.place), 0, None
        self._path.pressed_m = 0.0

    def _view(self, state: GelState) -> FieldGel:
        """Return the grid that a state is of."""
        if state.fine not in self._views:
            self._views[state.fine] = self._new(state.fine)
        return self._views[state.fine]

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `lsds_mocks.gel.field.view`."""
        return self._view(state).marker_displacement(state, xy_m)

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """See `lsds_mocks.gel.field.view`."""
        return self._view(state).depth(state, x_m, y_m)

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """See `lsds_mocks.gel.field.view`."""
        return self._view(state).contact_fraction(state, width_m, height_m)


def _rms(difference: NDArray[np.float64]) -> float:
    return float(np.sqrt((difference**2).sum(axis=1).mean()))


def _over(friction: Friction, gel: FieldGel) -> NDArray[np.float64]:
    """Return friction at the cells of another grid: of the cell around it, or the mean of the cells within."""
    own, other = friction.grid, gel.grid
    mean = friction.mean
    if not friction.values.size or float(np.ptp(friction.values)) == 0.0:
        return np.full(gel.cells.size, mean)
    full = np.full((own.rows, own.columns), mean)
    full[friction.cells // own.columns, friction.cells % own.columns] = friction.values
    if other.fine >= own.fine:
        times = other.fine // own.fine
        rows, columns = gel.cells // other.columns // times, gel.cells % other.columns // times
        return np.asarray(full[rows, columns])
    times = own.fine // other.fine
    means = full.reshape(other.rows, times, other.columns, times).mean(axis=(1, 3))
    return np.asarray(means.ravel()[gel.cells])
