"""Our fingertips on the pads of a MuJoCo scene of your own, `own_scene.xml`. Figures are simulated."""

from pathlib import Path

import mujoco
from lsds_mocks.cell.options import ContactOptions
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.gymnasium_space import observation
from lsds_mocks.fingertip.mujoco_scene import MujocoFingertip, MujocoScene

model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name("own_scene.xml")))
data = mujoco.MjData(model)
cup = ContactOptions(shape="box", diameter_mm=40, width_mm=60, length_mm=100, mass_kg=0.2, fidelity="winkler")
pads = (("thumb_pad", SimulatedFingertip(cup)), ("finger_pad", SimulatedFingertip(cup, side="back")))
scene = MujocoScene(model, data, [MujocoFingertip(model, data, tip, pad=pad, target="grasp") for pad, tip in pads])
while data.time < 1.0:
    data.ctrl[:] = max(0.0, 0.02 * (data.time - 0.5)), 6.0, 6.0  # height of the hand (m), force of each pad (N)
    scene.step()
print(f"height {data.body('cup').xpos[2]:.3f} m, load along y {observation(pads[0][1])['force'][1]:.2f} N")
