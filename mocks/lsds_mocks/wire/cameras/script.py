"""Scripted cell for a camera mock without a plant, which repeats the same grip in rounds.

Each round begins with a new pipe on the table. The fingers close on it and lift it while it slides slowly; then they
open.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import NS_PER_S
from lsds.contracts import BuildContext
from lsds.contracts.plant_links import Scene
from lsds_mocks.cell.build import build_plant
from lsds_mocks.cell.cell import SimulatedCell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.gel.state import GelState, blend

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.plant.physics import Physics
    from lsds_mocks.plant.plant import Plant

ROUND_S = 5.0
"""Duration of a round of the script, s; chosen."""
GRASP_S = 0.8
"""Time in a round at which the fingers close, s; chosen."""
LIFT_S = 1.8
"""Time in a round at which the arm lifts, s; chosen."""
RELEASE_S = 4.2
"""Time in a round at which the fingers release the object, s; chosen."""
_SCRIPT_STEP_NS = 2_000_000
"""Time step of the scene (ns); chosen."""
_Moving = tuple[GelState, float, float]
"""State of the moving parts: gel, height of the arm (m), height of the object (m)."""


class ScriptedCell:
    """Physics that advances to any requested instant; equal seed and instants give equal states.

    `aperture_mm` sets the grip force: at 23.6 the pipe slides while it is lifted, at 21.5 it does not.
    """

    def __init__(self, clock: Clock, seed: int, *, aperture_mm: float, speed_mm_s: float) -> None:
        self._clock = clock
        self._seed = seed
        self._aperture_m = aperture_mm * 1e-3
        self._speed_m_s = speed_mm_s * 1e-3
        self._start_ns = clock.now()
        self._round = -1
        self._before: _Moving
        self._after: _Moving
        self._begin(0)

    @property
    def plant(self) -> Plant:
        """The plant of this round."""
        return self._cell.plant

    @property
    def gel(self) -> GelModel:
        """The gel of this round."""
        return self._cell.plant.gel

    def at(self, t_ns: int) -> GelState | None:
        """Return the gel at an instant; None for an instant before earlier requests."""
        share = self._reach(t_ns)
        return None if share is None else blend(self._before[0], self._after[0], share)

    def scene(self, t_ns: int) -> Scene | None:
        """Return the scene at an instant; None for an instant before earlier requests."""
        share = self._reach(t_ns)
        if share is None:
            return None
        (_, arm, body), (_, arm_late, body_late) = self._before, self._after
        return Scene(t_ns, arm + share * (arm_late - arm), body + share * (body_late - body))

    def close(self) -> None:
        """Do nothing: there is nothing to release."""

    def _reach(self, t_ns: int) -> float | None:
        """Step until the last step covers the instant; return the instant's fraction of that step."""
        number = max(0, (t_ns - self._start_ns) // round(ROUND_S * NS_PER_S))
        if number < self._round:
            return None
        if number > self._round:
            self._begin(number)
        while self._cell.t_ns < t_ns:
            self._before = self._after
            self._cell.advance(self._cell.t_ns + _SCRIPT_STEP_NS)
            self._after = self._moving()
        late = (self._cell.t_ns - t_ns) / _SCRIPT_STEP_NS
        return 1.0 - late if late <= 1.0 else None

    def _begin(self, number: int) -> None:
        self._round = number
        origin = self._start_ns + number * round(ROUND_S * NS_PER_S)
        context = BuildContext(self._clock, self._seed)
        plant = build_plant(CellOptions(), context.rng_seed(f"scripted plant {number}"))
        self._cell = SimulatedCell(plant, step_ns=_SCRIPT_STEP_NS, start_ns=origin)

        def grip(plant: Physics) -> None:
            plant.fingers.target_m, plant.fingers.speed_m_s = self._aperture_m, 0.05

        def lift(plant: Physics) -> None:
            plant.arm.target_m_s = self._speed_m_s

        def release(plant: Physics) -> None:
            plant.arm.target_m_s = 0.0
            plant.fingers.target_m, plant.fingers.speed_m_s = 0.05, 0.05

        for at_s, action in ((GRASP_S, grip), (LIFT_S, lift), (RELEASE_S, release)):
            self._cell.post(origin + round(at_s * NS_PER_S), "script", action)
        self._before = self._after = self._moving()

    def _moving(self) -> _Moving:
        plant = self._cell.plant
        return plant.gel_state(), plant.arm.position_m, plant.object_height_m


class RestingGel:
    """A gel without contact."""

    def __init__(self, gel: GelModel) -> None:
        self._gel = gel
        self._state = gel.state()

    @property
    def gel(self) -> GelModel:
        """The gel."""
        return self._gel

    def at(self, t_ns: int) -> GelState | None:
        """Return the untouched state."""
        return self._state

    def close(self) -> None:
        """Do nothing: there is nothing to release."""
