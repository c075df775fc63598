"""A MuJoCo scene for trials: two pads on a carriage, and a pipe that stands on a table."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from lsds.errors import DataError
from lsds.support.extras import require
from lsds.support.numeric import is_number
from lsds_mocks.cell.options import ContactOptions
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.mujoco_scene import MujocoFingertip, MujocoScene, mujoco_engine

if TYPE_CHECKING:
    from lsds_mocks.fingertip.fingertip import Side
    from lsds_mocks.fingertip.mujoco_scene import Mode

Grip = Literal["force", "aperture"]
STEPS_S = (2e-3, 1e-3, 0.5e-3, 0.25e-3, 0.125e-3)
"""Time steps of which a scene uses the longest that is stable for its object, s."""
PAD_KG = 0.5
"""Mass of a finger with its share of the drive, kg. An order of magnitude."""
PAD_DAMPING_N_S_M = 100.0
"""Damping of a finger that is driven by a force, N s/m; chosen."""
DRIVE_N_M = 1e5
"""Stiffness of the servo of a finger that is driven to an aperture, N/m; chosen: 50 um at 5 N."""
STIFFEST_N_M = DRIVE_N_M / 2
"""Stiffness of finger and object together up to which a drive of that stiffness leaves the finger softer, N/m."""
FLEXURE_DAMPING = 0.7
"""Damping ratio of a pad on its finger; chosen."""
CLEARANCE_M = 1e-3
"""Distance of the open pads from the object, m."""


def pipe_mjcf(options: ContactOptions, *, step_s: float = STEPS_S[1], mode: Mode = "feel", grip: Grip = "force") -> str:
    """Return the scene of an object as MJCF; a round object stands as a cylinder, any other as a box.

    Actuators: `lift` sets the height of the pads (m) above their start. `squeeze` sets the force of each finger (N);
    with `grip` "aperture" it sets the way (m) by which each finger's drive closes from its start. The pad then hangs on
    the drive by the stiffness of finger and object. Raises DataError if these are too stiff for the drive.
    """
    by_force = grip == "force"
    finger_n_m = 1e3 / (1 / options.finger_stiffness_n_mm + 1 / options.stiffness_n_mm)
    if not by_force and finger_n_m > STIFFEST_N_M:
        raise DataError(
            f"finger_stiffness_n_mm = {options.finger_stiffness_n_mm:g} and stiffness_n_mm = "
            f"{options.stiffness_n_mm:g}: in series {finger_n_m * 1e-3:.3g} N/mm, where this scene has "
            f"{STIFFEST_N_M * 1e-3:g} at most; lower one"
        )
    # The actuator acts on the mean of both fingers' ways, so it has the force and the stiffness of two.
    squeeze = (
        '<general name="squeeze" tendon="mean" gainprm="2"/>'
        if by_force
        else f'<position name="squeeze" tendon="mean" kp="{2 * DRIVE_N_M}"/>'
    )
    half, length, grip_m = options.diameter_mm * 0.5e-3, options.length_mm * 1e-3, options.grip_height_mm * 1e-3
    width = options.width_mm * 0.5e-3 if options.shape == "box" else half
    round_ = options.shape in ("cylinder", "sphere")
    form = f'type="cylinder" size="{half} {length / 2}"' if round_ else f'type="box" size="{half} {width} {length / 2}"'
    middle = f'pos="0 0 {length / 2 - grip_m}"'
    surface = f'mass="{options.mass_kg}" friction="{options.static_friction}"'
    # Pads have the second bit and the table the first, so that low pads pass through the table, as in the other cell.
    apart, foot = ' contype="3" conaffinity="1"', ""
    if round_:
        # MuJoCo 4.0.0 finds no contact of a plane and a cylinder that is tilted by 1e-18, so a box in it meets the
        # table. The cylinder itself meets only the pads.
        apart, within = ' contype="2" conaffinity="0"', half / math.sqrt(2)
        foot = f"""
      <geom type="box" size="{within} {within} {length / 2}" {middle} mass="0" friction="{options.static_friction}"/>"""
    start, meets = half + CLEARANCE_M, 'contype="2" conaffinity="2"'
    damping = PAD_DAMPING_N_S_M if by_force else 2 * math.sqrt(DRIVE_N_M * PAD_KG)
    fingers = ""
    for name, sign in (("left", 1), ("right", -1)):
        pad = f"""
          <geom type="box" size="0.004 0.01248 0.01008" pos="{-sign * 0.004} 0 0" mass="{PAD_KG}" {meets}/>
          <site name="{name}_pad" xyaxes="0 {-sign} 0 0 0 -1"/>"""
        at = f'gravcomp="1" pos="{-sign * start} 0 {grip_m}"'
        drive = f'<joint name="{name}_slide" type="slide" axis="{sign} 0 0" damping="{damping}"/>'
        if by_force:
            fingers += f"""
      <body name="{name}" {at}>
        {drive}{pad}
      </body>"""
            continue
        # Drive and flexure in series are as stiff as finger and object.
        flexure_n_m = 1 / (1 / finger_n_m - 1 / DRIVE_N_M)
        relative = 2 * FLEXURE_DAMPING * math.sqrt(flexure_n_m * PAD_KG)
        fingers += f"""
      <body name="{name}_drive" {at}>
        {drive}
        <inertial pos="0 0 0" mass="{PAD_KG}" diaginertia="1e-3 1e-3 1e-3"/>
        <body name="{name}" gravcomp="1">
          <joint type="slide" axis="{sign} 0 0" stiffness="{flexure_n_m}" damping="{relative}"/>{pad}
        </body>
      </body>"""
    exclude = "".join(f'<exclude body1="{name}" body2="object"/>' for name in ("left", "right"))
    return f"""
<mujoco>
  <option timestep="{step_s}" integrator="implicitfast"/>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1"/>
    <body name="carriage" gravcomp="1">
      <joint name="lift" type="slide" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>{fingers}
    </body>
    <body name="object" pos="0 0 {grip_m}">
      <freejoint/>
      <geom {form} {middle} {surface}{apart}/>{foot}
      <site name="held" xyaxes="0 -1 0 0 0 -1"/>
    </body>
  </worldbody>
  <contact>{exclude if mode == "feel" else ""}<exclude body1="left" body2="right"/></contact>
  <tendon>
    <fixed name="mean"><joint joint="left_slide" coef="0.5"/><joint joint="right_slide" coef="0.5"/></fixed>
    <fixed name="centring" stiffness="20000" damping="100">
      <joint joint="left_slide" coef="1"/><joint joint="right_slide" coef="-1"/>
    </fixed>
  </tendon>
  <actuator>
    <position name="lift" joint="lift" kp="200000" kv="1000"/>
    {squeeze}
  </actuator>
</mujoco>"""


def longest_step_s(stable_s: float) -> float:
    """Return the longest of `STEPS_S` that is stable, else the shortest of them."""
    return next((step for step in STEPS_S if step <= stable_s), STEPS_S[-1])


def pipe_scene(
    options: ContactOptions | None = None,
    *,
    mode: Mode = "feel",
    grip: Grip = "force",
    seed: int = 0,
    step_s: float | None = None,
    every: int = 1,
) -> MujocoScene:
    """Return a scene with two fingertips at an object; the default is the pipe on the fast gel of bristles.

    Raises DataError for a time step that is not positive.
    """
    require("mujoco", extra="mujoco", purpose="the scene of a pipe")
    if step_s is not None and not (is_number(step_s) and 0 < step_s < math.inf):
        raise DataError(f"scene of a pipe: time step is {step_s!r} s; pass a positive number of seconds, or None")
    engine = mujoco_engine()
    options = options or ContactOptions(fidelity="winkler")
    sides: tuple[tuple[str, Side], ...] = (("left", "front"), ("right", "back"))
    tips = {name: SimulatedFingertip(options, side=side, seed=seed) for name, side in sides}
    if step_s is None:
        step_s = longest_step_s(tips["left"].stable_step_s(PAD_KG))
    model = engine.MjModel.from_xml_string(pipe_mjcf(options, step_s=step_s, mode=mode, grip=grip))
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    pads = [MujocoFingertip(model, data, tip, pad=f"{name}_pad", target="held") for name, tip in tips.items()]
    return MujocoScene(model, data, pads, mode=mode, every=every)
