"""One trial on the cell: untouched gel, grasp, moves; a row a frame with what was felt, measured and true."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import NS_PER_S, nanoseconds
from lsds.config import load_config
from lsds.config.toml import value_text
from lsds.contracts import ArmCommand, GripperCommand, Twist
from lsds.errors import DataError, StaleData
from lsds.models.signals import signals_of
from lsds.rig import Rig
from lsds.safety import Guard
from lsds.tactile.perception import Perception
from lsds.tactile.reference import ReferenceCollector
from lsds.truth_log import TruthLog
from lsds.vigilance import RepeatedImage
from lsds_research.collecting.labels import SlipLabels
from lsds_research.collecting.trials import SLOW_M_S
from lsds_research.datasets import from_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.contracts import Frame
    from lsds_research.collecting.trials import Move, Trial

TICK_NS = 8_000_000
"""How often sensor, arm and pose source are looked at."""
APPROACH_M = 4e-3
"""The fingers come fast to this far from the object, and slowly from there."""
FAST_M_S = 0.1
REFERENCE_TIMEOUT_S = 8.0
LIFETIME_S = 0.2


def run_trial(trial: Trial, config_file: str | None, overrides: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return the columns of one recording.

    Raises what a rig raises, and DataError where the sensor shows no settled, untouched gel.
    """
    settings = {"seed": trial.seed, "cell.simulated.clamped": trial.clamped} | trial.simulated
    own = [f"{path}={value_text(value)}" for path, value in settings.items()]
    config = load_config(config_file, [*own, *overrides])
    with Rig(config) as rig:
        if rig.gripper is None or rig.arm is None:
            raise DataError("collecting needs a gripper and an arm (gripper.backend, arm.backend)")
        rig.arm_devices()
        try:
            return _Drive(rig, trial).run()
        finally:
            rig.stop()


class _Drive:
    """A trial under way."""

    def __init__(self, rig: Rig, trial: Trial) -> None:
        self._rig = rig
        self._trial = trial
        self._clock = rig.clock
        self._guard = Guard(rig.config.safety)
        self._perception = Perception(rig.tracker, rig.sensor.spec, rig.config.tactile)
        self._truth = TruthLog(rig.cell, NS_PER_S / TICK_NS)
        self._labels = SlipLabels(self._truth, measured=rig.pose_source is not None, end_m=trial.end_m)
        self._repeated = RepeatedImage()
        self._last_seq = -1
        self._poses_count = False
        self._velocity = (0.0, 0.0)
        self._rows: list[NDArray[np.float32]] = []
        self._times_ns: list[int] = []
        self._reference = ReferenceCollector(rig.config.tactile.reference_frames)

    def run(self) -> dict[str, NDArray[Any]]:
        """Do it all."""
        thickness = self._trial.grip_aperture_m + APPROACH_M
        self._require_open(thickness)
        self._take_reference()
        self._close(thickness, FAST_M_S)
        self._go(1.0)
        # From here on there is something to slip.
        self._poses_count = True
        self._close(self._trial.grip_aperture_m, SLOW_M_S)
        self._go(APPROACH_M / SLOW_M_S + 0.2)
        for move in self._trial.moves:
            self._move(move)
        self._velocity = (0.0, 0.0)
        self._go(0.1)
        if not self._rows:
            raise DataError(f"{self._trial.recording}: no frame could be used")
        t_s = [(t_ns - self._times_ns[0]) / NS_PER_S for t_ns in self._times_ns]
        labels = self._labels.at(self._times_ns)
        return from_rows(
            self._trial.recording, self._trial.object, self._trial.protocol, t_s, np.array(self._rows), labels
        )

    def _require_open(self, aperture_m: float) -> None:
        """Raise DataError where the fingers are closer: something may be between them, and the gel is not untouched."""
        if self._rig.gripper is None:
            return
        found = self._rig.gripper.read().aperture_m
        if found < min(aperture_m, self._rig.gripper.spec.stroke_m - APPROACH_M):
            raise DataError(
                f"{self._trial.recording}: the fingers are {found * 1e3:.1f} mm apart; to begin they have to be "
                f"{aperture_m * 1e3:.1f} (open them)"
            )

    def _take_reference(self) -> None:
        deadline = self._clock.now() + nanoseconds(REFERENCE_TIMEOUT_S)
        while self._perception.reference is None:
            frame = self._new_frame()
            if frame is not None and self._reference.add(frame):
                self._perception.start(self._reference.frames)
            self._tick()
            if self._clock.now() > deadline:
                raise DataError(
                    f"{self._trial.recording}: no settled image of the untouched gel (is the light steady?)"
                )

    def _move(self, move: Move) -> None:
        if move.aperture_m is not None:
            self._close(move.aperture_m, move.closing_m_s)
        self._velocity = (move.velocity_m_s, move.turn_rad_s)
        self._go(move.duration_s)

    def _go(self, duration_s: float) -> None:
        """Stream the arm's velocity and take every frame for so long."""
        end = self._clock.now() + nanoseconds(duration_s)
        while self._clock.now() < end:
            self._tick()
            frame = self._new_frame()
            if frame is None or self._repeated.seen(frame.image):
                continue
            try:
                observation, _ = self._perception.observe(frame)
            except DataError:
                continue  # An unusable frame is a frame lost, as in the loop.
            self._rows.append(signals_of(observation, float(frame.image[::4, ::4].mean())))
            self._times_ns.append(frame.t_ns)

    def _tick(self) -> None:
        """Let one period pass: truth and poses are sampled, the arm is told again where to go."""
        now = self._clock.now()
        self._clock.sleep_until(now - now % TICK_NS + TICK_NS)
        now = self._clock.now()
        self._truth.sample(now)
        if self._rig.pose_source is not None and self._poses_count:
            with suppress(StaleData):
                self._labels.see(self._rig.pose_source.read())
        rise, turn = self._velocity
        twist = Twist((0.0, 0.0, rise), (0.0, turn, 0.0))
        acceleration = self._rig.config.task.lift_acceleration_m_s2
        command = ArmCommand(twist, acceleration, self._clock.now() + nanoseconds(LIFETIME_S))
        if self._rig.arm is not None:
            self._rig.arm.command(self._guard.arm(command))

    def _close(self, aperture_m: float, speed_m_s: float) -> None:
        task, gripper = self._rig.config.task, self._rig.gripper
        if gripper is None:
            return
        aperture_m = min(max(aperture_m, 0.0), gripper.spec.stroke_m)
        expires = self._clock.now() + nanoseconds(LIFETIME_S)
        command = GripperCommand(aperture_m, speed_m_s, task.grip_force_n, expires)
        gripper.command(self._guard.gripper(command, math.inf, allow_opening=True))

    def _new_frame(self) -> Frame | None:
        try:
            frame = self._rig.sensor.read()
        except (StaleData, DataError):
            return None
        if frame.seq == self._last_seq:
            return None
        self._last_seq = frame.seq
        return frame
