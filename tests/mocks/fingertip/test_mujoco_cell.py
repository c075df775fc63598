"""The cell backend `mujoco`: the same mocks and the same loop, while MuJoCo moves pads and object."""

from __future__ import annotations

import pytest
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.fingertip.mujoco_options import MujocoCellOptions
from lsds_mocks.fingertip.mujoco_plant import MujocoPlant
from lsds_mocks.fingertip.pipe import pipe_mjcf

import lsds
from lsds.config import load_config
from lsds.errors import ConfigError, DataError
from tests.mocks.fingertip import closed_loop

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install '.[mujoco]'")
FAST = ("cell.backend=mujoco", "cell.mujoco.fidelity=winkler", "clock=virtual")


def lifted(*settings):
    return lsds.run(load_config(None, [*FAST, *settings]))


def test_the_loop_holds_a_pipe_in_mujoco_and_repeats_by_seed():
    first, again = lifted("seed=3"), lifted("seed=3")
    assert first.verdict.outcome == "held"
    assert 1.0 < first.verdict.grip_over_needed < 2.0
    assert first.summary["slip_distance_m"] < 4e-3
    assert [each.normal_force_n for each in first.truths] == [each.normal_force_n for each in again.truths]


def test_the_object_is_lost_in_mujoco_if_the_grip_does_not_react():
    lost = lifted("controller.backend=pd", "controller.pd.kp=0", "controller.pd.kd=0")
    assert lost.verdict.outcome in ("dropped", "slipped too far")


def test_a_scene_of_your_own_is_used(tmp_path):
    options = CellOptions(fidelity="winkler")
    text = pipe_mjcf(options, step_s=1e-3, grip="aperture")
    for old, new in (("left_pad", "thumb"), ("right_pad", "finger"), ('"held"', '"bottle"'), ('"squeeze"', '"close"')):
        text = text.replace(old, new)
    (tmp_path / "scene.xml").write_text(text, encoding="utf-8")
    names = ("left_pad=thumb", "right_pad=finger", "held=bottle", "squeeze=close", f"scene={tmp_path / 'scene.xml'}")
    assert lifted(*(f"cell.mujoco.{each}" for each in names)).verdict.outcome == "held"


@pytest.mark.parametrize(
    ("setting", "problem"),
    [
        ("scene=missing.xml", "missing.xml"),
        ("held=cup", "no site and no body 'cup'"),
        ("lift=winch", "no actuator 'winch'"),
        ("lift=squeeze", "lift and squeeze are one actuator, 'squeeze'"),
        ("left_pad=right_pad", "left_pad and right_pad are one frame, 'right_pad'"),
        (
            "finger_stiffness_n_mm=150",
            "finger_stiffness_n_mm = 150 and stiffness_n_mm = .* has 50 at most",
        ),
        ("step_ms=1.3", "no multiple of the scene's time step of 1 ms; choose one"),
    ],
)
def test_a_scene_that_cannot_be_used_is_one_clear_error(setting, problem):
    with pytest.raises(ConfigError, match=problem):
        lifted(f"cell.mujoco.{setting}")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("<freejoint/>", "", "held = 'held' cannot move: give its body a <freejoint/>"),
        ('<position name="squeeze"', '<general name="squeeze"', "squeeze = 'squeeze': the actuator sets a force"),
        ("<worldbody>", "<worldbody", r"scene.xml: MuJoCo cannot read it: .*"),
    ],
)
def test_a_scene_that_cannot_work_is_one_clear_error(tmp_path, old, new, problem):
    file = tmp_path / "scene.xml"
    text = pipe_mjcf(CellOptions(fidelity="winkler"), step_s=1e-3, grip="aperture").replace(old, new)
    file.write_text(text.replace('kp="200000.0"/>', "/>") if "general" in new else text, encoding="utf-8")
    with pytest.raises(ConfigError, match=problem):
        lifted(f"cell.mujoco.scene={file}")


def test_all_that_moves_with_the_object_has_to_be_carried(tmp_path):
    file = tmp_path / "scene.xml"
    text = pipe_mjcf(CellOptions(fidelity="winkler"), step_s=1e-3, grip="aperture")
    lid = '<body name="lid"><inertial pos="0 0 0" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/></body>'
    file.write_text(text.replace('mass="0.3"', 'mass="0.1"').replace('<site name="held"', f'{lid}<site name="held"'))
    truth = lifted(f"cell.mujoco.scene={file}").truths[-1]
    assert truth.required_normal_force_n == pytest.approx(0.3 * 9.81 / 2 / 0.55, rel=0.05)


def test_a_step_that_is_no_multiple_of_the_scenes_is_an_error(tmp_path):
    file = tmp_path / "scene.xml"
    file.write_text(pipe_mjcf(CellOptions(fidelity="winkler"), step_s=1.5e-3, grip="aperture"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"no multiple of the scene's time step of 1\.5 ms"):
        lifted(f"cell.mujoco.scene={file}")


@pytest.mark.parametrize("key", ["clamped=true", "pour_to=2.0", "centre_x_mm=5.0"])
def test_what_a_mujoco_scene_does_not_have_is_no_key_of_it(key):
    with pytest.raises(ConfigError, match=f"cell.mujoco.{key.partition('=')[0]}: unknown key"):
        lifted(f"cell.mujoco.{key}")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plank", "ball", "duster", "phone", "marker-pen", "tape-roll"])
def test_the_same_grip_holds_in_both_cells(name):
    """The belief closes by whole ticks: objects of which the medians of five seeds end on the same tick."""
    own, other = (closed_loop.lifts(cell, name, "winkler", 5) for cell in closed_loop.CELLS)
    assert own.held == other.held == 5
    assert other.steady_n == pytest.approx(own.steady_n, rel=0.05)
    assert other.slip_mm == pytest.approx(own.slip_mm, abs=0.7)


def scene_with(tmp_path, old, new):
    text = pipe_mjcf(CellOptions(fidelity="winkler"), step_s=1e-3, grip="aperture")
    assert old in text
    (tmp_path / "scene.xml").write_text(text.replace(old, new, 1), encoding="utf-8")
    return MujocoCellOptions(fidelity="winkler", scene=str(tmp_path / "scene.xml"))


def test_a_scene_without_a_time_step_is_named(tmp_path):
    with pytest.raises(DataError, match="time step is 0 s; make it positive"):
        MujocoPlant(scene_with(tmp_path, 'timestep="0.001"', 'timestep="0"'), [1])


def test_a_cloth_on_the_floor_does_not_support_the_object(tmp_path):
    """Contacts of a flex have no geom; they counted as those of the last one."""
    cloth = (
        '<flexcomp name="cloth" type="grid" dim="2" count="4 4 1" spacing=".05 .05 .05" pos="0.6 0 0.004" '
        'radius=".005" mass="0.1"><contact selfcollide="none"/></flexcomp></worldbody>'
    )
    plant = MujocoPlant(scene_with(tmp_path, "</worldbody>", cloth), [1])
    model, data = plant._scene.model, plant._scene.data
    for _ in range(5):
        plant.step(2e-3)
    data.qpos[model.jnt_qposadr[model.body("object").jntadr[0]] + 2] += 0.3
    plant.step(2e-3)
    assert data.ncon
    assert not plant._is_supported()


def test_a_command_that_an_actuator_clamps_is_an_error_and_no_drop(tmp_path):
    lift = '<position name="lift"'
    options = scene_with(tmp_path, lift, f'{lift} ctrlrange="0 0.001" ctrllimited="true"')
    result = lifted(f"cell.mujoco.scene={options.scene}")
    assert result.verdict.outcome == "stopped"
    assert "lift = 'lift': commanded to 0.001" in result.verdict.sentence
    assert "ctrlrange is 0 to 0.001 m" in result.verdict.sentence


@pytest.mark.parametrize("height_mm", [1.0, 9.0])
def test_pads_near_the_table_grip_as_higher_ones_do(height_mm):
    """The pads' geoms met the table, which pressed them apart."""
    assert lifted(f"cell.mujoco.grip_height_mm={height_mm}").verdict.in_grip


@pytest.mark.parametrize("turn", ['xyaxes="0 -1 0 0 0 -1" pos="0 0.002 0"', 'xyaxes="0 -.866 .5 0 -.5 -.866"'])
def test_an_object_that_lies_where_results_are_not_valid_is_no_held_one(tmp_path, turn):
    """The run's verdict said "held", while the fingertip named the offset, or the turn."""
    options = scene_with(tmp_path, 'name="held" xyaxes="0 -1 0 0 0 -1"', f'name="held" {turn}')
    result = lifted(f"cell.mujoco.scene={options.scene}")
    assert result.verdict.outcome == "outside the model's validity"
    assert "winkler' ignores that" in result.verdict.sentence


def test_the_needed_force_is_that_of_the_scenes_gravity(tmp_path):
    options = scene_with(tmp_path, '<option timestep="0.001"', '<option timestep="0.001" gravity="0 0 -1.62"')
    truth = lifted(f"cell.mujoco.scene={options.scene}").truths[-1]
    assert truth.required_normal_force_n == pytest.approx(0.3 * 1.62 / 2 / 0.55, rel=0.05)


@pytest.mark.parametrize("gravity", ["0 0 0", "1 0 -9.81", "0 0 9.81"])
def test_a_gravity_that_does_not_pull_down_is_named(tmp_path, gravity):
    options = scene_with(tmp_path, '<option timestep="0.001"', f'<option timestep="0.001" gravity="{gravity}"')
    with pytest.raises(DataError, match=f"gravity of the scene is {gravity}"):
        MujocoPlant(options, [1])


def test_a_camera_that_measures_poses_sees_the_object_rise():
    result = lifted("pose_source.backend=mock-truth-camera")
    assert result.verdict.outcome == "held"
    plant = MujocoPlant(MujocoCellOptions(fidelity="winkler"), [1])
    plant.step(2e-3)
    assert plant.object_height_m == pytest.approx(0.0, abs=1e-4)
    plant._scene.data.qvel[-4] = 0.25
    before = plant.object_height_m
    plant.step(2e-3)
    assert plant.object_velocity_m_s == pytest.approx(0.25, abs=0.03)
    assert plant.object_height_m - before == pytest.approx(0.25 * 2e-3, rel=0.1)
