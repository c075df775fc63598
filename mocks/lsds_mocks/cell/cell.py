"""The simulated cell: steps the plant lazily to the present and provides states at past instants.

Physics runs on an absolute grid of steps, commands are ordered by when they take effect, and every random stream is
seeded by name: the same calls at the same times give bit-identical results, independent of reads in between.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from lsds.clock import NS_PER_S, seconds
from lsds.contracts.plant import Moment
from lsds_mocks.cell.queue import Action, CommandQueue
from lsds_mocks.cell.touch import GelTouch
from lsds_mocks.gel.auto.report import invalid_reasons, strain_warnings
from lsds_mocks.gel.state import blend
from lsds_mocks.plant.physics import Physics

if TYPE_CHECKING:
    from lsds.contracts import CellTruth
    from lsds.contracts.plant import Fingers
    from lsds_mocks.gel.state import GelState

P = TypeVar("P", bound=Physics)

KEPT_STEPS = 256
"""Number of the newest steps whose states a cell keeps for late exposures; chosen."""


class Camera(Protocol):
    """Records the gel's state at instants that it chooses in advance."""

    @property
    def next_exposure_ns(self) -> int:
        """Time of the next exposure."""
        ...

    def expose(self, touch: GelTouch) -> None:
        """Record the gel at `next_exposure_ns`, and choose the next instant."""
        ...


class SimulatedCell(Generic[P]):
    """A `Cell` and a `Plant`: devices post commands and look up moments. `lsds_mocks.cell.build` makes one."""

    def __init__(self, plant: P, *, step_ns: int, start_ns: int, history_s: float = 0.0, model: str = "") -> None:
        self.plant = plant
        self._model = model
        self.step_ns = step_ns
        self._dt_s = step_ns / NS_PER_S
        self._t_ns = start_ns - start_ns % step_ns
        self._queue = CommandQueue()
        self._cameras: list[Camera] = []
        self._lock = threading.RLock()
        self._moments: deque[Moment] = deque([self._moment()], maxlen=KEPT_STEPS)
        self._history: deque[CellTruth] = deque(maxlen=max(1, round(history_s / self._dt_s)))
        self._keeps_history = history_s > 0

    @property
    def t_ns(self) -> int:
        """Time of the physics: the end of the last step."""
        return self._t_ns

    @property
    def can_turn(self) -> bool:
        """Whether the arm may rotate the pads about their normal."""
        return self.plant.can_turn

    def connect(self) -> None:
        """Do nothing: the physics is in this process."""

    def close(self) -> None:
        """Drop pending commands: they reference the devices, which reference the cell, so the whole run would otherwise
        stay in memory until the garbage collector runs."""
        self._queue.clear()

    def advance(self, t_ns: int) -> None:
        """Perform all whole steps that end by `t_ns`."""
        with self._lock:
            while self._t_ns + self.step_ns <= t_ns:
                self._step()

    def truth(self) -> CellTruth:
        """Return the truth at the last step's end."""
        with self._lock:
            return self.plant.truth(self._t_ns)

    def fidelity(self) -> dict[str, Any]:
        """Return the gel model and its report on its accuracy."""
        with self._lock:
            report = getattr(self.plant.gel, "report", None)
            if report is None:
                strain = self.plant.greatest_strain
                summary = "its error is not checked (simulated)"
                values: dict[str, Any] = {"warnings": strain_warnings(strain), "invalid": invalid_reasons(strain)}
            else:
                found = report()
                summary, values = found.summary, found.as_json()
            for key in ("warnings", "invalid"):
                values[key] = [*values[key], *self.plant.invalid]
            return {"model": self._model, "summary": f"{self._model}: {summary}", **values}

    def history(self) -> tuple[CellTruth, ...]:
        """Return the truth of each recorded step, oldest first; empty unless the option `history_s` is set."""
        with self._lock:
            return tuple(self._history)

    def post(self, t_ns: int, source: str, action: Action) -> None:
        """Schedule a command to take effect at `t_ns`; safe from any thread, never waits for physics."""
        self._queue.post(t_ns, source, action)

    def moment(self, t_ns: int) -> Moment:
        """Return the newest moment at or before `t_ns`, or the oldest kept."""
        with self._lock:
            for moment in reversed(self._moments):
                if moment.t_ns <= t_ns:
                    return moment
            return self._moments[0]

    def watch(self, camera: Camera) -> None:
        """Add a camera that exposes from now on."""
        with self._lock:
            self._cameras.append(camera)

    def unwatch(self, camera: Camera) -> None:
        """Remove a camera."""
        with self._lock:
            if camera in self._cameras:
                self._cameras.remove(camera)

    def gel_state(self) -> GelState:
        """Return the gel's state at the last step's end."""
        with self._lock:
            return self.plant.gel_state()

    def touch(self) -> GelTouch:
        """Return the gel at the last step's end."""
        return GelTouch(self.plant.gel, self.gel_state())

    def use_fingers(self, fingers: Fingers) -> None:
        """Replace the fingers' drive."""
        with self._lock:
            self.plant.use_fingers(fingers)
            self._moments[-1] = self._moment()

    def _step(self) -> None:
        for action in self._queue.due(self._t_ns):
            action(self.plant)
        end = self._t_ns + self.step_ns
        exposing = [camera for camera in self._cameras if camera.next_exposure_ns <= end]
        before = self.plant.gel_state() if exposing else None
        self.plant.step(self._dt_s)
        for camera in exposing:
            after = self.plant.gel_state()
            while camera.next_exposure_ns <= end and before is not None:
                share = seconds(camera.next_exposure_ns - self._t_ns) / self._dt_s
                camera.expose(GelTouch(self.plant.gel, blend(before, after, min(max(share, 0.0), 1.0))))
        self._t_ns = end
        self._moments.append(self._moment())
        if self._keeps_history:
            self._history.append(self.plant.truth(end))

    def _moment(self) -> Moment:
        drive, arm, turn = self.plant.fingers, self.plant.arm, self.plant.turn
        return Moment(
            self._t_ns,
            drive.aperture_m,
            drive.target_m,
            drive.moving,
            drive.stalled,
            arm.position_m,
            arm.velocity_m_s,
            turn.position_m,
            turn.velocity_m_s,
            self.plant.normal_n,
        )
