"""The cell in a MuJoCo scene: MuJoCo moves pads and object, simulated fingertips give forces and images.

The mocks of sensor, gripper and arm are those of the cell `simulated`. The arm's height and the aperture of the
gripper's drive are commands to the scene's actuators; the normal force is what the gel answers.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lsds.contracts import CellTruth
from lsds.contracts.backend import CELL
from lsds.errors import ConfigError, ConfigIssue, DataError
from lsds.support.extras import require
from lsds_mocks.cell.build import build_friction, cell_of, plant_streams
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.mujoco_scene import (
    MujocoFingertip,
    MujocoScene,
    frame_kind,
    mass_of,
    mujoco_engine,
    upward_velocity_m_s,
)
from lsds_mocks.fingertip.pipe import PAD_KG, longest_step_s, pipe_mjcf
from lsds_mocks.plant.physics import FINGERS, Physics
from lsds_mocks.plant.slip import drops
from lsds_mocks.plant.vibration import Vibration

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_mocks.cell.cell import SimulatedCell
    from lsds_mocks.fingertip.mujoco_options import MujocoCellOptions
    from lsds_mocks.gel.state import GelState


CLAMPED_M = 1e-4
"""Way by which a command may exceed an actuator's range, m: fingers that are open stand at the end of it; chosen."""


class MujocoPlant(Physics):
    """A `Physics` whose pads and object are bodies of a MuJoCo model.

    Raises DataError for a scene that cannot be read or lacks a name, and if the object is too deep in a gel.
    """

    def __init__(self, options: MujocoCellOptions, seed: list[int]) -> None:
        require("mujoco", extra="mujoco", purpose="a cell in a MuJoCo scene")
        self._options = options
        self._left, right = (
            SimulatedFingertip(options, side=side, friction=build_friction(options, *plant_streams(seed)[:2]))
            for side in ("front", "back")
        )
        self.gel = self._left.gel
        model, data = _model(options, self._left)
        for key in ("left_pad", "right_pad", "held"):
            _require_frame(model, options, key)
        self.gravity_m_s2 = _gravity_m_s2(model)
        self._scene = MujocoScene(
            model,
            data,
            [
                MujocoFingertip(model, data, self._left, pad=options.left_pad, target=options.held),
                MujocoFingertip(model, data, right, pad=options.right_pad, target=options.held),
            ],
        )
        self._step_s = float(model.opt.timestep)
        self._actuators = [_actuator(model, data, options, key) for key in ("lift", "squeeze")]
        if options.lift == options.squeeze:
            raise DataError(f"lift and squeeze are one actuator, {options.lift!r}; name two")
        if options.left_pad == options.right_pad:
            raise DataError(f"left_pad and right_pad are one frame, {options.left_pad!r}; name two")
        self._ranges = [_range(model, options, key) for key in ("lift", "squeeze")]
        pads = [finger.pad_pose().position_m for finger in self._scene.fingertips]
        welded = model.body_weldid
        self._pad_bodies = {int(welded[finger.pad_body]) for finger in self._scene.fingertips}
        self._target = self._scene.fingertips[0].target_body
        if not welded[self._target]:
            raise DataError(f"held = {options.held!r} cannot move: give its body a <freejoint/>")
        self._opened_m = float(np.linalg.norm(pads[0] - pads[1]))
        super().__init__(float(pads[0][2]))
        self._start_m = self.arm.position_m
        self._mass_kg = mass_of(model, self._target)
        self._foot_m = self._height()
        self._vibration = Vibration(options.vibration_um * 1e-6, plant_streams(seed)[2])
        self._time_s = 0.0
        self._deepest_m = 0.0
        self._misplaced: dict[str, str] = {}
        self.normal_n = 0.0
        self.supported = True
        self.dropped = False

    @property
    def can_turn(self) -> bool:
        """Whether the arm may rotate the pads: the scene has no joint for it."""
        return False

    @property
    def greatest_strain(self) -> float:
        """Greatest indentation so far, as part of the gel's thickness."""
        return self._deepest_m / (self._options.pad_thickness_mm * 1e-3)

    @property
    def invalid(self) -> tuple[str, ...]:
        """Why results so far are not valid, apart from the strain of the gel."""
        return tuple(self._misplaced.values())

    @property
    def object_height_m(self) -> float:
        """Height of the object above its start, m."""
        return self._height() - self._foot_m

    @property
    def object_velocity_m_s(self) -> float:
        """Upward velocity of the object, m/s."""
        return upward_velocity_m_s(self._scene.model, self._scene.data, self._target)

    def step(self, dt_s: float) -> None:
        """Advance the drives and the scene. Raises DataError if the object gets as deep in a gel as that is thick, and
        for a command that an actuator of the scene clamps."""
        self._time_s += dt_s
        self.arm.step(dt_s)
        self.fingers.step(dt_s, self.normal_n)
        lift_m, squeeze_m = self.arm.position_m - self._start_m, (self._opened_m - self.fingers.aperture_m) / 2
        for reach, wanted_m in zip(self._ranges, (lift_m, squeeze_m), strict=True):
            reach.require(wanted_m)
        lift, squeeze = self._actuators
        lift.ctrl = lift_m + self._vibration.displacement_m(self._time_s)
        squeeze.ctrl = squeeze_m
        self._scene.step(round(dt_s / self._step_s))
        truths = [finger.tip.truth() for finger in self._scene.fingertips]
        self.normal_n = sum(each.normal_force_n for each in truths) / FINGERS
        self._deepest_m = max(self._deepest_m, *(each.indentation_m for each in truths))
        for finger, truth in zip(self._scene.fingertips, truths, strict=True):
            if truth.invalid and not self.dropped:
                self._misplaced = finger.tip.misplaced() | self._misplaced
        self.supported = self._is_supported()
        most_slip_m = self._options.drop_slip_mm * 1e-3
        self.dropped = self.dropped or drops(self.normal_n, self.supported, truths[0].slip_distance_m, most_slip_m)

    def gel_state(self) -> GelState:
        """Return a copy of the left gel's history, including the object's placement."""
        return self._left.gel_state()

    def truth(self, t_ns: int) -> CellTruth:
        """Return the truth of the left finger, stamped `t_ns`."""
        of = self._left.truth()
        friction = self._options.static_friction * self._options.friction_scale
        return CellTruth(
            t_ns=t_ns,
            slip_velocity_m_s=of.slip_velocity_m_s,
            relative_velocity_m_s=of.velocity_m_s,
            slip_angular_rad_s=of.slip_angular_rad_s,
            slip_distance_m=of.slip_distance_m,
            stick_ratio=of.stick_ratio,
            normal_force_n=self.normal_n,
            tangential_force_n=math.hypot(*of.force_n),
            required_normal_force_n=self.normal_for(self._mass_kg, friction),
            aperture_m=self.fingers.aperture_m,
            object_height_m=self.object_height_m,
            supported=self.supported,
            dropped=self.dropped,
        )

    def _height(self) -> float:
        return float(self._scene.data.xpos[self._target][2])

    def _is_supported(self) -> bool:
        """Return whether the object touches anything but the pads."""
        data, model = self._scene.data, self._scene.model
        if not data.ncon:
            return False
        own = int(model.body_weldid[self._target])
        geoms = data.contact.geom
        # A contact of a flex has no geom.
        pairs = np.where(geoms >= 0, model.body_weldid[model.geom_bodyid[geoms]], -1).tolist()
        return any(own in pair and not self._pad_bodies & set(pair) for pair in pairs)


def _model(options: MujocoCellOptions, tip: SimulatedFingertip) -> tuple[Any, Any]:
    """Return the scene's model and data. Raises DataError for a scene that MuJoCo cannot read or step."""
    engine = mujoco_engine()
    if options.scene:
        try:
            model = engine.MjModel.from_xml_path(str(Path(options.scene)))
        except (ValueError, OSError) as error:
            where = "" if Path(options.scene).is_absolute() else f" (from the current folder, {Path.cwd()})"
            raise DataError(f"scene = {options.scene}{where}: MuJoCo cannot read it: {error}") from error
    else:
        step_s = longest_step_s(min(tip.stable_step_s(PAD_KG), options.step_ms * 1e-3))
        model = engine.MjModel.from_xml_string(pipe_mjcf(options, step_s=step_s, grip="aperture"))
    if not model.opt.timestep > 0:
        raise DataError(f"scene = {options.scene}: its time step is {model.opt.timestep:g} s; make it positive")
    parts = options.step_ms * 1e-3 / float(model.opt.timestep)
    if parts < 1 or abs(parts - round(parts)) > 1e-6:
        remedy = "change one of them" if options.scene else "choose one"
        raise DataError(
            f"step_ms = {options.step_ms:g}: no multiple of the scene's time step of "
            f"{1e3 * float(model.opt.timestep):g} ms; {remedy}"
        )
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    return model, data


def _gravity_m_s2(model: Any) -> float:
    """Return the acceleration of gravity. Raises DataError if it does not pull downwards only."""
    x, y, z = model.opt.gravity.tolist()
    if x or y or not z < 0:
        raise DataError(f"gravity of the scene is {x:g} {y:g} {z:g}; the cell lifts against one along -z: 0 0 -9.81")
    return -float(z)


def _require_frame(model: Any, options: MujocoCellOptions, key: str) -> None:
    """Raise DataError if the frame of an option is missing."""
    name = getattr(options, key)
    if frame_kind(model, name) is None:
        raise DataError(f"{key} = {name!r}: no site and no body {name!r} in the model")


def _actuator(model: Any, data: Any, options: MujocoCellOptions, key: str) -> Any:
    """Return the actuator of an option. Raises DataError if the model does not have it, or if it sets a force."""
    name = getattr(options, key)
    try:
        number = model.actuator(name).id
    except KeyError as error:
        raise DataError(f"{key} = {name!r}: no actuator {name!r} in the model") from error
    # A position servo has a bias of minus its gain; a motor has none, and a plugin of MuJoCo may be either.
    if model.actuator_plugin[number] < 0 and model.actuator_biasprm[number][1] >= 0:
        raise DataError(f"{key} = {name!r}: the actuator sets a force, but a position (m) is commanded; use <position>")
    return data.actuator(name)


class _Range(NamedTuple):
    """Commands that an actuator of the scene carries out, m."""

    name: str
    least_m: float
    most_m: float

    def require(self, wanted_m: float) -> None:
        """Raise DataError for a command that would be clamped: the object would be lost for another reason."""
        if not self.least_m - CLAMPED_M <= wanted_m <= self.most_m + CLAMPED_M:
            raise DataError(
                f"{self.name}: commanded to {wanted_m:.4g} m, but its ctrlrange is {self.least_m:g} to "
                f"{self.most_m:g} m; widen it in the scene"
            )


def _range(model: Any, options: MujocoCellOptions, key: str) -> _Range:
    """Return the commands that the actuator of an option carries out."""
    name = getattr(options, key)
    number = model.actuator(name).id
    ends = model.actuator_ctrlrange[number].tolist() if model.actuator_ctrllimited[number] else (-math.inf, math.inf)
    return _Range(f"{key} = {name!r}", *ends)


def build_mujoco_cell(options: MujocoCellOptions, context: BuildContext) -> SimulatedCell[MujocoPlant]:
    """Return the cell of the backend `mujoco`, installed so that the rig's mocks share it.

    Raises ConfigError for a scene that cannot be used.
    """

    def make() -> SimulatedCell[MujocoPlant]:
        try:
            plant = MujocoPlant(options, context.rng_seed("plant"))
        except DataError as error:
            raise ConfigError("rig", [ConfigIssue("cell.mujoco", str(error), "see docs/mujoco.md")]) from error
        return cell_of(plant, options, context, f"{options.fidelity} in MuJoCo")

    return context.shared(CELL, make)
