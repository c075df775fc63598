"""Gel tier 'auto': an elastic pad on the coarsest grid that meets a tolerance, found by retracing the path on another.

Two grids run: the active grid answers queries; the auditor retraces the active grid's path in long legs from time to
time. Over many scenes, the difference in marker positions between a grid and the next finer one was 0.8 to 1.1 times
the coarser grid's error, and the finer grid's error was 0.2 to 0.5 of the difference. Either grid of a pair can
therefore audit the other. To refine, the two swap roles, since the auditor already has the whole history.

Pressing, travel and turns trigger audits, because errors grow with them. Audits become rarer while they find small
errors. The auditor catches up over several steps and is compared with the active grid's state when the audit began.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.auto.audit import DOTS_M, Audit, rms_m
from lsds_mocks.gel.auto.bound import NARROW, OverTheWay, across, is_sharp, share_of_motion
from lsds_mocks.gel.auto.follower import Follower
from lsds_mocks.gel.auto.path import Friction, Path
from lsds_mocks.gel.auto.report import Choice, FidelityReport
from lsds_mocks.gel.field.gel import TRACTION_TOLERANCE, FieldGel
from lsds_mocks.gel.material import GelMaterial

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.protocol import Reaction
    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.gel.state import GelState
    from lsds_mocks.optics.grain import Grain

FINES = (1, 2, 4)
"""Refinement factors of the grids, coarsest first; chosen."""
DEFAULT_TOLERANCE_M = 5e-6
"""Default RMS error of the dots that the chosen grid may have, m; chosen."""
_COARSER = 1.15
"""Error of a grid over its difference to the next finer grid: a high quantile of many scenes."""
_FINER = 0.42
"""Error of a grid over its difference to the next coarser grid: a high quantile of many scenes."""
_GROWS = 2.5
"""Factor by which an error, as part of the markers' motion, may exceed the largest that audits have found."""
_RAISE_ALL = 0.7
"""RMS error over the travel, as part of the tolerance, above which `_RAISE` applies instead of `_RAISE_NOW`."""
_RAISE = 0.8
"""Estimated error, as part of the tolerance, above which a finer grid takes over if `_RAISE_ALL` is exceeded."""
_RAISE_NOW = 1.15
"""Estimated error, as part of the tolerance, above which a finer grid takes over in any case."""
_LOWER = 0.5
"""Estimated error, as part of the tolerance, below which a coarser grid may take over and audits become rarer."""
_NO_WORSE = 1.2
"""Audits also become rarer if the estimate is below this many times the worst one of the grid so far."""
_LOW_AUDITS = 3
"""Consecutive audits below `_LOWER` before a coarser grid takes over."""
_UNRESOLVED = 0.1
"""Least estimated error, as part of the markers' motion, for a contact too narrow for its cells to resolve."""
_PEAK = 1.5
"""Factor by which the error may temporarily exceed its RMS over the travel."""
_AUDIT_DISTANCE_M = 0.1e-3
"""Least distance between audits."""
_FAR_M = 0.8e-3
"""Greatest distance between audits, reached while they find small errors."""
_PRESSED_CHANGE = 0.15
"""Relative change of the indentation that triggers an audit."""
_SOON_M = 0.02e-3
"""Distance after which an audit follows a change of the indentation."""
MOST_CELLS = 2500
"""Most cells in contact: larger grids could not keep up with a running cell. The report states if one was needed."""
_WORK_M2 = 4e-3
"""Multiplications of an audit per step, times the squared tolerance (m^2): 1 ms at 20 um, longer for less error."""
_LATE_M = 0.05e-3
"""Travel since the start of an audit after which it is late."""
_HURRY = 1.5
"""Factor on the multiplications per step of a late audit."""
_SHARP_M = 12e-6
"""Tolerance below which the coarsest grid seldom suffices under faces with a sharp edge."""
_FINEST_START = ((0.8e-6, 4), (3.5e-6, 2))
"""Pairs of a tolerance (m) and the refinement factor with which a gel of a smaller tolerance starts; chosen."""


class AutoGel:
    """A `GelModel` with a tolerance on the RMS error of its markers.

    `first` is the grid to begin with; `settled` is the solver tolerance of the grids.
    """

    grain: Grain | None = None

    def __init__(
        self,
        shape: Shape,
        material: GelMaterial | None = None,
        *,
        tolerance_m: float = DEFAULT_TOLERANCE_M,
        follows: bool = True,
        first: FieldGel | None = None,
        settled: float = TRACTION_TOLERANCE,
    ) -> None:
        self.shape = shape
        self.material = material or GelMaterial()
        self.tolerance_m = tolerance_m
        self._budget = _WORK_M2 / tolerance_m**2
        self._follows, self._settled = follows, settled
        self._main = first or self._new(next((fine for limit, fine in _FINEST_START if tolerance_m < limit), 1))
        self._views: dict[int, FieldGel] = {self._main.grid.fine: self._main}
        self._step = (0.0, 0.0, 0.0)
        self._indentation = self._deepest_m = 0.0
        self._reach: tuple[float, float] | None = None
        self._friction: Friction | None = None
        self._estimate: float | None = None
        self._over_the_way = 0.0
        self._gave_up = False
        self._audits = 0
        self._audit_work = 0.0
        self._past_work, self._past_unconverged = 0.0, 0
        self._last_wall_m: float | None = None
        self._other: Follower | None = None
        self._begin()
        self._choices = [Choice(0.0, self._main.grid.pitch_m, None, "coarsest that may do")]

    def _begin(self) -> None:
        """Begin a new path here, without history and without an error estimate."""
        self._path = Path(start=self._main.place)
        self._replace_other(None)
        self._audit: Audit | None = None
        self._gone_m = self._to_next_m = self._looked_at_m = self._worst = 0.0
        self._wait_m = _AUDIT_DISTANCE_M
        self._calm = 0
        self._motion, self._error = OverTheWay(), OverTheWay()
        self._share: float | None = None

    def _replace_other(self, other: Follower | None) -> None:
        """Set the other grid; the cost of the former one still counts."""
        former, self._other = self._other, other
        if former is not None:
            self._count_unused(former.gel)

    def _count_unused(self, gel: FieldGel) -> None:
        """Add the cost of a grid to that of the past if nothing uses the grid any more."""
        if not any(gel is used for used in self._used()):
            self._past_work += gel.work
            self._past_unconverged += gel.effort.unconverged

    def _used(self) -> list[FieldGel]:
        """Return the grids in use, each once."""
        other = [] if self._other is None else [self._other.gel]
        return list({id(gel): gel for gel in (self._main, *other, *self._views.values())}.values())

    def _new(self, fine: int) -> FieldGel:
        return FieldGel(self.shape, self.material, fine=fine, follows=self._follows, tolerance=self._settled)

    # The methods of a gel are those of the active grid.

    @property
    def points_m(self) -> NDArray[np.float64]:
        """Centres (2, N) of the active grid's cells."""
        return self._main.points_m

    @property
    def force_tolerance(self) -> float:
        """The active grid's force tolerance."""
        return self._main.force_tolerance

    def press(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> float:
        """Set the indentation; return the normal force (N)."""
        if indentation_m <= 0 < self._indentation:
            self._last_wall_m = self._main.wall_distance_m
        self._indentation, self._reach = indentation_m, reach_m
        self._deepest_m = max(self._deepest_m, indentation_m)
        return self._main.press(indentation_m, reach_m)

    def set_friction(self, friction: NDArray[np.float64]) -> None:
        """Set the friction coefficient of each cell."""
        self._main.set_friction(friction)
        own = self._main
        self._friction = Friction(own.grid, own.cells, np.array(friction, float), own.mean_friction)

    def trial(self, dx_m: float, dy_m: float, dtheta_rad: float = 0.0) -> Reaction:
        """Carry the gel with the object."""
        self._step = (dx_m, dy_m, dtheta_rad)
        return self._main.trial(dx_m, dy_m, dtheta_rad)

    def commit(self) -> None:
        """Adopt the last trial, and audit when it is due."""
        self._main.commit()
        if self._indentation <= 0:
            self._release()
            return
        before = self._path.gone_m
        turned = self._path.add(self._step, self._indentation, self._reach, self._friction)
        self._gone_m += self._path.gone_m - before
        self._to_next_m -= self._path.gone_m - before
        if turned:
            self._wait_m, self._worst = _AUDIT_DISTANCE_M, 0.0
            self._to_next_m = min(self._to_next_m, _AUDIT_DISTANCE_M)
        if abs(self._indentation - self._looked_at_m) > _PRESSED_CHANGE * self._indentation:
            self._looked_at_m = self._indentation
            self._to_next_m = min(self._to_next_m, _SOON_M)
            if self._audit is None:
                self._look_at_pressure()
        if self._audit is None and self._to_next_m <= 0 and self._gone_m > 0:
            self._send_out()
        if self._audit is not None:
            self._go_on(self._audit)

    def _release(self) -> None:
        """Forget the path when the contact is lost."""
        if self._path.count or self._path.open:
            self._begin()

    # Auditing.

    def _send_out(self) -> None:
        """Begin an audit of the active grid's present state, unless the error bound allows a delay."""
        dots = self._main.displacement_now(DOTS_M)
        bound = self._bound() if self._main.operator.kernel == "pad" else math.inf
        if bound < math.inf:
            now = rms_m(dots)
            motion = max(self._motion.add(self._gone_m, now), now / _PEAK)
            # Markers move no faster than the object.
            spare = self.tolerance_m / max(bound, 1e-6) - motion
            if spare > 0:
                self._to_next_m = max(spare, _AUDIT_DISTANCE_M)
                return
        if self._other is None:
            self._other = Follower(self._new(self._partner()))
        self._path.close()
        self._set_out(Audit(self._path.count, dots, self._gone_m), self._other)

    def _set_out(self, audit: Audit, other: Follower) -> None:
        """Begin an audit, and keep the legs that the other grid has still to retrace."""
        self._audit = audit
        self._path.held = max(other.retraced, self._path.dropped)

    def _look_at_pressure(self) -> None:
        """Check during pressing whether the contact is of a kind for which the coarsest grid is seldom accurate."""
        sharp = self._main.grid.fine == FINES[0] and self.tolerance_m <= _SHARP_M
        if self._is_narrow(self._main):
            self._send_out()
        elif sharp and self._other is None and is_sharp(self._main.state().pressure_n):
            self._go_finer(other_is=False)

    @staticmethod
    def _is_narrow(gel: FieldGel) -> bool:
        """Return whether a contact is so narrow that the cells may have missed part of it."""
        state = gel.state()
        return across(gel.grid, state.cells[state.pressure_n > 0]) < NARROW

    def _bound(self) -> float:
        """Return the bound on the error, as part of the markers' motion; infinite for a contact that is too narrow."""
        state = self._main.state()
        ever = share_of_motion(self._main.grid, state.cells, state.pressure_n)
        return ever if self._share is None or ever == math.inf else min(ever, _GROWS * self._share)

    def _go_on(self, audit: Audit) -> None:
        """Advance the auditor; once it has caught up, estimate the active grid's error and act on it."""
        other = self._other
        # Do not wait for a grid known to be too coarse. In gross slip, errors stay constant.
        late = self._gone_m - audit.sent_m > _LATE_M and not self._main.fully_sliding
        budget = (
            math.inf if self._main.operator.kernel != "pad" else self._budget * (_HURRY if audit.answers or late else 1)
        )
        if other is None or not self._lead(other, audit.until, budget):
            return
        self._audit, self._path.held = None, sys.maxsize
        if audit.answers:
            self._swap(audit.answers, audit.legs)
            return
        self._audits += 1
        motion, difference = rms_m(audit.dots_m), rms_m(audit.dots_m - other.gel.displacement_now(DOTS_M))
        same = other.gel.operator.kernel == self._main.operator.kernel
        finer = other.gel.grid.pitch_m < self._main.grid.pitch_m or not same
        self._estimate = (_COARSER if finer else _FINER) * difference
        finest = other.gel if finer else self._main
        if self._is_narrow(finest):
            # Both grids may have missed part of the contact, so agreement, above all on no contact, proves little.
            motion = max(motion, rms_m(finest.displacement_now(DOTS_M)))
            self._estimate = max(self._estimate, _UNRESOLVED * motion if finest.touches else self._indentation)
        self._share = max(self._share or 0.0, self._estimate / max(motion, 1e-9))
        small = self._estimate < max(_LOWER * self.tolerance_m, _NO_WORSE * self._worst)
        self._worst = max(self._worst, self._estimate)
        self._wait_m = min(2 * self._wait_m, _FAR_M) if small and self._gone_m > 0 else _AUDIT_DISTANCE_M
        # The error in pressing does not predict the error in shear.
        self._to_next_m = self._wait_m if self._gone_m > 0 else _SOON_M
        # The tolerance applies to the RMS over the whole travel, to which earlier grids may have contributed.
        so_far = self._error.add(self._gone_m, self._estimate)
        self._over_the_way = so_far
        most = _RAISE if so_far > _RAISE_ALL * self.tolerance_m else _RAISE_NOW
        if self._estimate > most * self.tolerance_m:
            self._calm = 0
            self._go_finer(finer)
        elif not finer and _COARSER * difference < _LOWER * self.tolerance_m:
            self._calm += 1
            if self._calm >= _LOW_AUDITS:
                self._swap("the coarser grid suffices")
        else:
            self._calm = 0

    def _partner(self) -> int:
        """Return the grid that audits the active one: the finer one of the first pair, else the next coarser one."""
        at = FINES.index(self._main.grid.fine)
        if self._main.operator.kernel != "pad":
            return self._main.grid.fine
        return FINES[1] if at == 0 else FINES[at - 1]

    def _lead(self, other: Follower, until: int, budget: float) -> bool:
        before = other.work
        arrived = other.follow(self._path, until, budget)
        self._audit_work += other.work - before
        return arrived

    def _go_finer(self, other_is: bool) -> None:
        """Activate the other grid if it is finer; else make a finer grid that becomes active once it catches up."""
        if other_is:
            self._swap("the auditor disagrees")
            return
        at = FINES.index(self._main.grid.fine)
        if at + 1 == len(FINES) or 4 * self._main.cells.size > MOST_CELLS:
            self._gave_up = True
            return
        other = Follower(self._new(FINES[at + 1]))
        self._replace_other(other)
        self._path.close()
        audit = Audit(self._path.count, np.zeros_like(DOTS_M), self._gone_m, "the coarser grid exceeds the tolerance")
        self._set_out(audit, other)
        self._go_on(audit)

    def _swap(self, why: str, legs: int = sys.maxsize) -> None:
        """Let the other grid catch up with the active one, then swap their roles.

        If fewer legs than last time (`legs`) are missing, it catches up over several steps instead of at once.
        """
        other = self._other
        if other is None:
            return
        self._path.close()
        behind = self._path.count - other.retraced
        if 1 < behind < legs and self._main.operator.kernel == "pad":
            self._set_out(Audit(self._path.count, np.zeros_like(DOTS_M), self._gone_m, why, behind), other)
            return
        self._lead(other, self._path.count, math.inf)
        self._main, other.gel = other.gel, self._main
        self._main.solve_in_portions(False)
        other.gel.solve_in_portions(True)
        self._gave_up = False
        former = self._views.get(self._main.grid.fine, self._main)
        self._views[self._main.grid.fine] = self._main
        if other.gel.operator.kernel != "pad":
            self._replace_other(None)
        if former is not other.gel:
            self._count_unused(former)
        self._calm, self._wait_m, self._to_next_m, self._worst, self._share = (
            0,
            _AUDIT_DISTANCE_M,
            _AUDIT_DISTANCE_M,
            0.0,
            None,
        )
        self._choices.append(Choice(self._gone_m, self._main.grid.pitch_m, self._estimate, why))

    def report(self) -> FidelityReport:
        """Return the chosen grids, the reasons, the cost and the limits of accuracy.

        After a release, error and distance from the walls are those of the last contact; the cost is that of all.
        """
        used = self._used()
        work = self._past_work + sum(gel.work for gel in used)
        wall_m = self._main.wall_distance_m if self._indentation > 0 else self._last_wall_m
        return FidelityReport(
            self.tolerance_m,
            self._main.grid.pitch_m,
            self._estimate,
            None if self._estimate is None else self._over_the_way,
            self._audits,
            tuple(self._choices),
            work,
            self._audit_work / work if work else 0.0,
            self._deepest_m / self.material.thickness_m,
            wall_m,
            self._past_unconverged + sum(gel.effort.unconverged for gel in used),
            self._gave_up,
        )

    # Queries of a gel are passed to the active grid.

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
        """Stored energy; it jumps slightly when the grid changes."""
        return self._main.elastic_energy_j

    def state(self) -> GelState:
        """Return a copy of the gel's state, which includes its grid."""
        return self._main.state()

    def restore(self, state: GelState) -> None:
        """Restore a state and restart the audits, because the state does not include its path."""
        self._main = self._view(state)
        self._main.restore(state)
        self._indentation, self._reach = state.indentation_m, state.reach_m
        self._estimate, self._gave_up, self._last_wall_m = None, False, None
        self._begin()

    def _view(self, state: GelState) -> FieldGel:
        """Return the grid to which a state belongs."""
        if state.fine not in self._views:
            self._views[state.fine] = self._new(state.fine)
        return self._views[state.fine]

    def displacement_now(self, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return displacements (M, 2) of points (M, 2) in the present state."""
        return self._main.displacement_now(xy_m)

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `lsds_mocks.gel.field.surface`."""
        return self._view(state).marker_displacement(state, xy_m)

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """See `lsds_mocks.gel.field.surface`."""
        return self._view(state).depth(state, x_m, y_m)

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """See `lsds_mocks.gel.field.surface`."""
        return self._view(state).contact_fraction(state, width_m, height_m)
