"""Gel tiers 'half-space', 'layer' and 'pad': frictional contact of an elastic pad, on a grid of cells.

The history consists of anchors: the displacement at which a sticking cell is held. A trial moves the anchors of all
cells with the object and solves for tractions. A commit keeps the moved anchors of sticking cells and sets those of
sliding and free cells to the displacement of the surface. Motion below the solver's resolution is therefore not lost
over many steps, and repeating a step changes nothing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.choice import AnyPatch, Effort, Solver
from lsds_mocks.gel.field.extrapolation import Extrapolation
from lsds_mocks.gel.field.footprint import Footprint
from lsds_mocks.gel.field.increment import TURN_ARM_M, Increment, add_up, carry, notice_sliding, settle, stick_share
from lsds_mocks.gel.field.operator import Kernel, operator
from lsds_mocks.gel.field.surface import FieldView
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.placement import ORIGIN, Placement
from lsds_mocks.gel.protocol import NO_REACTION, Reaction
from lsds_mocks.gel.state import GelState

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.optics.grain import Grain

TRACTION_TOLERANCE = 0.02
"""Greatest residual change of a traction in an accepted solution, as part of the greatest pressure."""
_ACTIVE_GAP = 1.15
"""Gap, in indentations, below which a cell is active; above 1 because the surface bulges around the contact."""
_DEAD = 1.5
"""A patch drops the cells that no longer touch when it holds this many times the cells it needs."""
_LOOK_M = 2e-6
"""Motion of the object after which its surface is looked up again."""
_LOOK_AGAIN_M = 20e-6
"""The same within one search for balance."""
_REFRESH = 64
"""Increments after which displacements, accumulated in single precision, are recomputed."""
_FORCE_ERROR_SHARE = 0.05
"""Error of the total force, as part of the tolerance on single tractions."""
_CLOSE = 0.3
"""Tolerance at the end of an increment, as part of the tolerance; its steps may each have left small changes undone."""
_SLIDES = 0.03
"""Lag of a cell behind the object, as part of a step, above which the cell counts as sliding."""


class FieldGel:
    """A `GelModel` on `fine` x `fine` cells per hat interval (0.96 mm on the default pad).

    `follows`: the object's surface moves over the gel with the object; the reference solutions keep it in place.
    `solver`: see `lsds_mocks.gel.field.choice`.
    """

    grain: Grain | None = None

    def __init__(
        self,
        shape: Shape,
        material: GelMaterial | None = None,
        *,
        fine: int = 2,
        kernel: Kernel = "pad",
        tolerance: float = TRACTION_TOLERANCE,
        follows: bool = True,
        solver: Solver = "auto",
    ) -> None:
        self.shape = shape
        self.material = material or GelMaterial()
        self.operator = operator(self.material, fine, kernel)
        self.grid = self.operator.grid
        self.tolerance = tolerance
        self.effort = Effort()
        self.place = ORIGIN
        self._follows = follows
        self._view = FieldView(self.operator, shape)
        self._footprint = Footprint(shape, self.grid)
        self._patch = AnyPatch(self.operator, solver)
        self._indentation = 0.0
        self._reach: tuple[float, float] | None = None
        self._looked_at: tuple[float, tuple[float, float] | None] | None = None
        self._looked_from: Placement | None = None
        self._increments = 0
        self._steps = 0
        self._since = self._last = Increment()
        self._tried = (0.0, 0.0, 0.0)
        self._near = Extrapolation()
        self._at = (0.0, 0.0, 0.0, 0.0)
        self._first, self._fresh, self._astray = True, True, False
        self._pressed = 0.0
        self.mean_friction = 0.0
        """Mean friction coefficient of the cells; 0 without cells."""
        self._gap, self._slope = np.zeros(0), np.zeros((2, 0), np.float32)
        self._resize(np.zeros(0, np.int64), 0)

    # Arrays over the patch: kept by `_resize` when cells come and go.
    _traction: NDArray[np.float32]
    _w: NDArray[np.float32]
    _old_traction: NDArray[np.float32]
    _old_w: NDArray[np.float32]
    _older_traction: NDArray[np.float32]
    _older_w: NDArray[np.float32]
    _anchor: NDArray[np.float64]
    _carried: NDArray[np.float64]
    _target: NDArray[np.float32]
    _friction: NDArray[np.float32]
    _slid: NDArray[np.bool_]
    _now_sliding: NDArray[np.bool_]
    _slip: NDArray[np.float64]

    def _resize(self, kept: NDArray[np.int64], count: int) -> None:
        """Keep the columns `kept` of all arrays and append zero columns up to `count`."""
        for names, rows, kind in (
            ("_traction _w _old_traction _old_w _older_traction _older_w _target", 3, np.float32),
            ("_anchor _carried", 2, np.float64),
            ("_friction", 0, np.float32),
            ("_slip", 0, np.float64),
            ("_slid _now_sliding", 0, np.bool_),
        ):
            shape = (rows, count) if rows else (count,)
            for name in names.split():
                new = np.full(shape, kind is np.bool_, kind)
                if len(kept):
                    new[..., : len(kept)] = getattr(self, name)[..., kept]
                setattr(self, name, new)
        self._friction[len(kept) :] = self.mean_friction
        self._near.clear()
        self._points = self.grid.centres_m(self._patch.cells)

    def solve_in_portions(self, portions: bool) -> None:
        """Set whether a call solves only a portion that `solve_on` continues, for a gel in the background.

        Such a gel does not prepare its contact for many solutions either.
        """
        self._patch.grows = not portions

    @property
    def work(self) -> float:
        """Work so far, in multiplications."""
        return self.effort.work(self._patch)

    @property
    def force_tolerance(self) -> float:
        """Error of forces that the solver leaves, as part of the normal force."""
        return _FORCE_ERROR_SHARE * self.tolerance

    @property
    def cells(self) -> NDArray[np.int32]:
        """Numbers (N,) of the active cells."""
        return self._patch.cells

    @property
    def wall_distance_m(self) -> float | None:
        """Least distance of the contact from a wall of the pad, 0 if it reaches one; None without contact."""
        x, y = np.abs(self._points[:, self._touching])
        if not x.size:
            return None
        of, grid = self.material, self.grid
        return min((of.width_m - grid.dx_m) / 2 - float(x.max()), (of.height_m - grid.dy_m) / 2 - float(y.max()))

    @property
    def points_m(self) -> NDArray[np.float64]:
        """Centres (2, N) of the active cells; a new array whenever they change."""
        return self._points

    def press(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> float:
        """Set the indentation and the range of y under the object; return the normal force (N) at rest."""
        self.stand(indentation_m, reach_m)
        return self._solve(0.0, 0.0, 0.0).normal_n

    def stand(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> None:
        """Set the indentation without solving; the next trial finds the forces."""
        self._indentation, self._reach = indentation_m, reach_m
        self._look_after(self.place)

    def _look_after(self, place: Placement, within_m: float = _LOOK_M) -> None:
        """Activate the cells near the object; from time to time drop those that it has left."""
        moved = self._looked_from is None or place.distance_m(self._looked_from) > within_m
        if not moved and (self._indentation, self._reach) == self._looked_at:
            return
        if moved:
            self._looked_from = place
        self._looked_at = (self._indentation, self._reach)
        near = self._footprint.near(self._looked_from or place, _ACTIVE_GAP * self._indentation)
        patch = self._patch
        known_cells = np.zeros(self.grid.size, np.bool_)
        known_cells[patch.cells] = True
        new = np.flatnonzero(near & ~known_cells).astype(np.int32)
        left = patch.size > 16 + _DEAD * np.count_nonzero(near)
        if left:
            kept = near[patch.cells] | (self._old_traction[2] > 0) | (self._traction[2] > 0)
            patch.keep(kept)
            self._resize(np.flatnonzero(kept), patch.size)
        if len(new):
            self._add(new)
        if moved or left or len(new):
            self._find_surface(self._looked_from or place)
        gap = self._gap
        if self._reach is not None:
            y = self._points[1]
            gap = np.where((y >= self._reach[0]) & (y <= self._reach[1]), gap, self._indentation + 1.0)
        self._target[2] = self._indentation - gap

    def _add(self, new: NDArray[np.int32]) -> None:
        """Activate cells; as free cells, their displacement so far is that due to the other cells' tractions."""
        known = self._patch.size
        self._patch.add(new)
        self._resize(np.arange(known), self._patch.size)
        for traction, w in (
            (self._traction, self._w),
            (self._old_traction, self._old_w),
            (self._older_traction, self._older_w),
        ):
            self._patch.respond(traction, w, known)
        self._anchor[:, known:] = self._old_w[:2, known:]

    def _find_surface(self, place: Placement) -> None:
        """Look up the object's surface over the patch."""
        self.effort.looked_up += self._patch.size
        self._gap, slope = self._footprint.over(self._patch.cells, place)
        self._slope = slope.astype(np.float32)

    def set_friction(self, friction: NDArray[np.float64]) -> None:
        """Set the friction coefficient of each cell."""
        self._friction[:] = friction
        self.mean_friction = float(friction.sum()) / len(friction) if len(friction) else 0.0

    def trial(self, dx_m: float, dy_m: float, dtheta_rad: float = 0.0) -> Reaction:
        """Carry the anchors with the object and solve."""
        if self._first and self._since.turns_with(dx_m, dy_m, dtheta_rad):
            self._end_increment()
        within, self._first = _LOOK_M if self._first else _LOOK_AGAIN_M, False
        return self._solve(dx_m, dy_m, dtheta_rad, within)

    def _solve(self, dx_m: float, dy_m: float, dtheta_rad: float, within_m: float = _LOOK_M) -> Reaction:
        whole = self._since.and_then(dx_m, dy_m, dtheta_rad)
        self._tried = motion = (dx_m, dy_m, dtheta_rad)
        pad_m = (self.material.width_m, self.material.height_m)
        if any(motion) and self._follows and (self._astray or not self.shape.slides_along(self.place, motion, pad_m)):
            self._astray = True  # If another trial follows, it has to look up the surface again.
            self._look_after(self.place.moved(*motion), within_m)
        if not self._patch.size:
            return NO_REACTION
        self.effort.unsolved = 0
        carry(self._anchor, self._points, whole.dx_m, whole.dy_m, whole.dtheta_rad, self._carried, self._target)
        self._at = (whole.dx_m, whole.dy_m, TURN_ARM_M * whole.dtheta_rad, self._indentation)
        if self._fresh:
            self._fresh = False
            self._guess(whole)
        elif self._patch.solver == "fft":
            self._near.guess(self._at, self._traction, self._w)
        self._relax(self.tolerance)
        return self._reaction()

    def _relax(self, tolerance: float) -> None:
        most = self.effort.most(self._patch)
        done = self._patch.relax(self._traction, self._w, self._target, self._friction, self._slid, tolerance, most)
        self.effort.count(self._patch, done, most)
        if done > 0 and self._patch.solver == "fft":
            self._near.learn(self._at, self._traction, self._w)

    def solve_on(self) -> bool:
        """Continue the last trial by a portion; return whether it is done or cannot be improved."""
        if self.effort.unsolved:
            self._relax(self.tolerance)
        return not self.effort.may_go_on

    def _guess(self, motion: Increment) -> None:
        """Extrapolate the initial guess: add the last increment's change, as far as this motion repeats it."""
        share = motion.share_of(self._last)
        if share > 0:
            self._traction += np.float32(share) * (self._old_traction - self._older_traction)
            self._w += np.float32(share) * (self._old_w - self._older_w)

    def _reaction(self) -> Reaction:
        area = self.grid.cell_m2
        fx, fy, torque, normal, stuck = add_up(self._traction, self._points, self._slope, self._slid, self._follows)
        stiffness = stuck * self.material.shear_modulus_pa / self.material.thickness_m
        return Reaction(fx * area, fy * area, torque * area, stiffness * area, normal * area)

    def commit(self) -> None:
        """Adopt the last trial; end the increment if it is long or turns."""
        self._since = self._since.and_then(*self._tried)
        self._first, self._astray = True, False
        self._steps += 1
        if self._follows:
            self.place = self.place.moved(*self._tried)
        self._notice_sliding()
        if self._since.is_over(self._indentation - self._pressed):
            self._end_increment()

    def _notice_sliding(self) -> None:
        """Mark the cells that slid in this increment and whose slip has grown with the last step as sliding."""
        step = math.hypot(self._tried[0], self._tried[1]) + abs(self._tried[2]) * self.material.thickness_m
        notice_sliding(self._carried, self._w, self._slid, _SLIDES * step, self._slip, self._now_sliding)

    def _end_increment(self) -> None:
        """Move the anchors of cells that slid, and start a new increment from here."""
        if self._patch.size and self._steps > 1:
            self._relax(_CLOSE * self.tolerance)
        self._steps = 0
        self._older_traction, self._old_traction = self._old_traction, self._older_traction
        self._older_w, self._old_w = self._old_w, self._older_w
        self._last = Increment(*self._since[:3], self._indentation - self._pressed)
        self._increments += 1
        if self._increments % _REFRESH == 0:
            self._patch.respond(self._traction, self._w)
            self._last = Increment()
        settle(
            self._anchor,
            self._carried,
            self._slid,
            self._traction,
            self._w,
            self._old_traction,
            self._old_w,
            self._slip,
        )
        self._pressed = self._indentation
        self._since = Increment()
        self._fresh = True
        self._near.clear()

    def displacement_now(self, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return displacements (M, 2) of points (M, 2) in the present state."""
        return self._view.displacement(self._patch.cells, self._traction, xy_m)

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Which cells slid in the last committed step."""
        return self._now_sliding

    @property
    def _touching(self) -> NDArray[np.bool_]:
        return np.asarray(self._traction[2] > 0)

    @property
    def touches(self) -> bool:
        """Whether any cell is in contact."""
        return bool(self._touching.any())

    @property
    def stick_ratio(self) -> float:
        """Share of the cells in contact that did not slide."""
        return float(stick_share(self._traction, self._now_sliding))

    @property
    def fully_sliding(self) -> bool:
        """Whether every cell in contact slid in the last committed step."""
        return self.touches and not bool((self._touching & ~self._now_sliding).any())

    @property
    def elastic_energy_j(self) -> float:
        """Half of traction times displacement, pressing included, plus friction work that the increment may give back.

        A step adds to it no more than the object's work, up to the solver's tolerance.
        """
        traction = self._traction.astype(np.float64)
        slip = np.where(self._slid, self._carried - self._w[:2], 0.0)
        return self.grid.cell_m2 * float(0.5 * np.vdot(traction, self._w) + np.vdot(traction[:2], slip))

    def state(self) -> GelState:
        """Return a copy of the gel's state."""
        area = np.float64(self.grid.cell_m2)
        force = self._traction * area
        return GelState(
            np.where(self._slid, self._w[:2], self._carried),
            force[:2],
            force[2],
            self._now_sliding.copy(),
            self._indentation,
            float(force[2].sum()),
            self._reach,
            self.grid.fine,
            self._patch.cells,
            (self.place.x_m, self.place.y_m, self.place.angle_rad),
        )

    def restore(self, state: GelState) -> None:
        """Restore a state as the beginning of an increment."""
        self._patch.keep(np.zeros(self._patch.size, bool))
        self._resize(np.zeros(0, np.int64), 0)
        self._patch.add(state.cells)
        self._resize(np.zeros(0, np.int64), self._patch.size)
        self._traction[:] = np.concatenate([state.shear_n, state.pressure_n[None]]) / self.grid.cell_m2
        self._patch.respond(self._traction, self._w)
        np.copyto(self._old_traction, self._traction)
        np.copyto(self._old_w, self._w)
        self._anchor[:] = self._carried[:] = state.deflection_m
        self._now_sliding[:] = self._slid[:] = state.slid
        self.place = Placement(*state.placement)
        self._indentation = self._pressed = state.indentation_m
        self._reach = state.reach_m
        self._looked_at, self._looked_from = None, None
        self.effort.unsolved = 0
        self._since = self._last = Increment()
        self._tried = (0.0, 0.0, 0.0)
        self._first, self._fresh, self._astray = True, True, False
        self._find_surface(self.place)

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `lsds_mocks.gel.field.surface`."""
        return self._view.marker_displacement(state, xy_m)

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """See `lsds_mocks.gel.field.surface`."""
        return self._view.depth(state, x_m, y_m)

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """See `lsds_mocks.gel.field.surface`."""
        return self._view.contact_fraction(state, width_m, height_m)
