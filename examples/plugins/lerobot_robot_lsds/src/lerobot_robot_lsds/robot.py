"""A gripper of lsds behind LeRobot's robot interface."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import lsds
from lsds.errors import DataError

from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots.robot import Robot
from lerobot_robot_lsds.config_robot import LsdsRobotConfig
from lerobot_robot_lsds.follow import Follow
from lerobot_robot_lsds.running import Running

if TYPE_CHECKING:
    from lsds.contracts import Cycle

OPEN = 100.0
"""The value of `gripper.pos` of open fingers, 0 of closed ones: LeRobot's range of grippers, without unit."""
POSITION = "gripper.pos"
"""The position of the fingers, in actions and observations."""
VALUES = (POSITION, "slip.speed", "slip.probability", "load.force", "load.known")
"""Scalar observations: the position, slip speed (m/s), probability of slip, load per finger (N), and whether the last
two are known (1.0 or 0.0)."""


class LsdsRobot(Robot):
    """A gripper whose grip lsds corrects: an action sets a target, and slip closes the fingers further.

    No error opens the fingers, and neither does `disconnect`.
    """

    config_class = LsdsRobotConfig
    name = "lsds"

    def __init__(self, config: LsdsRobotConfig) -> None:
        """Load the rig without any I/O. Raises ConfigError, PluginError."""
        super().__init__(config)
        self.config = config
        self._rig = lsds.load_config(config.rig or None, config.overrides)
        rig = lsds.Rig(self._rig)
        self._stroke_m = math.nan if rig.gripper is None else rig.gripper.spec.stroke_m
        several = len(rig.fingers) > 1
        self._fingers = {f"finger_{finger.name}" if several else "finger": finger.name for finger in rig.fingers}
        specs = [finger.sensor.spec for finger in rig.fingers]
        self._shapes = {key: (spec.height_px, spec.width_px, 3) for key, spec in zip(self._fingers, specs, strict=True)}
        rig.close()
        self.cameras = make_cameras_from_configs(config.cameras)
        self._job = Follow()
        self._running: Running | None = None

    @property
    def observation_features(self) -> dict[str, Any]:
        """The scalars, and the shape (height, width, 3) of each image."""
        features: dict[str, Any] = dict.fromkeys(VALUES, float)
        if self.config.images:
            features |= self._shapes
        return features | {name: (one.height, one.width, 3) for name, one in self.config.cameras.items()}

    @property
    def action_features(self) -> dict[str, Any]:
        """The target of the fingers: 0 closed, 100 open."""
        return {POSITION: float}

    @property
    def is_connected(self) -> bool:
        """Whether the rig is up."""
        return self._running is not None

    @property
    def is_calibrated(self) -> bool:
        """True: lsds calibrates a rig with its own commands."""
        return True

    def calibrate(self) -> None:
        """Do nothing; see `is_calibrated`."""

    def configure(self) -> None:
        """Do nothing; the rig file configures the devices."""

    def connect(self, calibrate: bool = True) -> None:
        """Bring the rig up, with nothing between the fingers. The gripper may move in order to activate.

        Raises ConnectionError if it is up, BringUpError, SafetyStop, everything closed.
        """
        if self._running is not None:
            raise ConnectionError("robot lsds is already connected; call disconnect() first")
        running = Running(self._rig, self._job)
        running.start()
        self._running = running
        try:
            for camera in self.cameras.values():
                camera.connect()
        except BaseException:
            self.disconnect()
            raise

    def get_observation(self) -> dict[str, Any]:
        """Return the newest state. Raises ConnectionError, and the error that ended the run."""
        cycle = self._up().newest(self.config.step_s)
        observation: dict[str, Any] = _scalars(cycle, self._stroke_m)
        if self.config.images:
            seen = {finger.finger: finger.frame.image for finger in (*cycle.grip.fingers, *cycle.fingers)}
            missing = [name for name in self._fingers.values() if name not in seen]
            if missing:
                raise DataError(f"robot lsds: no recent image of finger {', '.join(missing)} (check its camera)")
            observation |= {key: seen[name] for key, name in self._fingers.items()}
        return observation | {name: camera.async_read() for name, camera in self.cameras.items()}

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Set the target of the fingers; return it as it was used, within 0 to 100.

        Raises ConnectionError, ValueError if the action is malformed, and the error that ended the run.
        """
        running = self._up()
        running.check()
        if set(action) != {POSITION}:
            raise ValueError(f"robot lsds: the action has {sorted(action)}; give '{POSITION}' alone")
        position = float(action[POSITION])
        if not math.isfinite(position):
            raise ValueError(f"robot lsds: {POSITION} is {position}; give a number from 0 (closed) to {OPEN:g} (open)")
        position = min(max(position, 0.0), OPEN)
        self._job.aim(position / OPEN * self._stroke_m)
        return {POSITION: position}

    def disconnect(self) -> None:
        """Stop everything and keep the grip. Raises ConnectionError if it is not connected."""
        running = self._up()
        self._running = None
        try:
            for camera in self.cameras.values():
                if camera.is_connected:
                    camera.disconnect()
        finally:
            running.stop()

    def _up(self) -> Running:
        if self._running is None:
            raise ConnectionError("robot lsds is not connected; call connect() first")
        return self._running


def _scalars(cycle: Cycle, stroke_m: float) -> dict[str, float]:
    """Return the scalar observations; unknown ones are 0, because a NaN would spoil the statistics of a dataset."""
    grip = cycle.grip
    known = math.isfinite(grip.slips) and math.isfinite(grip.load_n)
    speed = 0.0 if cycle.estimate.abstained else cycle.estimate.speed_m_s
    measured = cycle.measured_m if math.isfinite(cycle.measured_m) else stroke_m
    numbers = (
        measured / stroke_m * OPEN,
        speed if math.isfinite(speed) else 0.0,
        grip.slips if known else 0.0,
        grip.load_n if known else 0.0,
        float(known),
    )
    return {name: float(number) for name, number in zip(VALUES, numbers, strict=True)}
