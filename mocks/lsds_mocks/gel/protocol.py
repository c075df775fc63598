"""The interface of all gel models.

Plane of the gel: x right and y down in the image, origin at the pad's centre, metres. Rotation is positive from x
to y (clockwise as seen in the image). The base of the gel rests in this frame; the object moves against it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds_mocks.gel.state import GelState
    from lsds_mocks.optics.grain import Grain


class Reaction(NamedTuple):
    """Load of the object on the gel after a trial motion.

    Force (N) along x and y, torque (N m) about the pad's centre, tangent stiffness (N/m) along y (a lower bound if part
    of the patch slides), and normal force (N).
    """

    force_x_n: float
    force_y_n: float
    torque_nm: float
    stiffness_y_n_m: float
    normal_n: float


NO_REACTION = Reaction(0.0, 0.0, 0.0, 0.0, 0.0)


class GelModel(Protocol):
    """A gel with friction and memory, driven by the object's rigid motion.

    Each step calls `press` and `set_friction`, then any number of `trial`s; `commit` adopts the last trial. Neither a
    press nor a trial changes the history, so several may be tried in a step. The history is a `GelState`, a value that
    `state` copies and `restore` sets. `grain` is the fine relief of the object's surface, which shows in images but
    does not affect forces; None without relief.
    """

    grain: Grain | None

    @property
    def points_m(self) -> NDArray[np.float64]:
        """Points (2, N) that need a friction coefficient; a new array whenever they change, as `press` may do."""
        ...

    @property
    def force_tolerance(self) -> float:
        """Smallest error of forces that the model can reach, as part of the normal force."""
        ...

    def press(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> float:
        """Set a rigid indentation; return the normal force (N). `reach_m` limits the contact to low <= y <= high."""
        ...

    def set_friction(self, friction: NDArray[np.float64]) -> None:
        """Set the friction coefficient at each of `points_m`, (N,)."""
        ...

    def trial(self, dx_m: float, dy_m: float, dtheta_rad: float = 0.0) -> Reaction:
        """Return the reaction to a rigid motion of the object since the last commit."""
        ...

    def commit(self) -> None:
        """Adopt the last trial."""
        ...

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Which points slid in the last committed step, (N,)."""
        ...

    @property
    def stick_ratio(self) -> float:
        """Fraction of the contact area that did not slide in the last committed step; 1 without contact."""
        ...

    @property
    def fully_sliding(self) -> bool:
        """Whether there is contact and every point of it slid in the last committed step."""
        ...

    @property
    def elastic_energy_j(self) -> float:
        """Energy stored in the gel by shear and, if the model solves for it, by pressing."""
        ...

    def state(self) -> GelState:
        """Return a copy of the history."""
        ...

    def restore(self, state: GelState) -> None:
        """Put a history back."""
        ...

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement (M, 2) in metres of surface points `xy_m` (M, 2) of the undeformed gel."""
        ...

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Depth in metres (>= 0, into the gel) of the surface on the grid of `y_m` (H,) by `x_m` (W,)."""
        ...

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """Fraction of a centred window that the object touches."""
        ...
