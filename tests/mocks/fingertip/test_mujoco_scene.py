"""Two fingertips in a MuJoCo scene: forces rise with the load, carry the weight, and give way at the friction limit."""

import copy
import math
import warnings

import numpy as np
import pytest
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.mujoco_scene import MujocoFingertip, MujocoScene
from lsds_mocks.fingertip.pipe import CLEARANCE_M, pipe_mjcf, pipe_scene
from lsds_mocks.fingertip.pose import Pose

from lsds.errors import DataError
from tests.mocks.fingertip.lifts import EVEN, lift_in_cell, lift_in_scene

mujoco = pytest.importorskip("mujoco")

WEIGHT_N = 0.3 * 9.81


def pipe(**options):
    return CellOptions(**{**EVEN, **options})


def lifted(grip_n=6.0, **options):
    """A scene whose object hangs in the air, at rest."""
    scene = pipe_scene(pipe(**options))
    data = scene.data
    while data.time < 1.5:
        data.actuator("squeeze").ctrl = grip_n
        data.actuator("lift").ctrl = min(0.02, max(0.0, 0.03 * (data.time - 0.4)))
        scene.step()
    return scene


def truths(scene):
    return [fingertip.tip.truth() for fingertip in scene.fingertips]


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
def test_the_tangential_force_of_a_hanging_pipe_is_its_weight(fidelity):
    scene = lifted(fidelity=fidelity)
    assert scene.data.body("object").xpos[2] == pytest.approx(0.05 + 0.02, abs=1e-3)
    for truth in truths(scene):
        assert truth.normal_force_n == pytest.approx(6.0, rel=0.02)
        assert truth.slip_distance_m == 0.0
        assert truth.invalid == ()
    assert sum(truth.force_n[1] for truth in truths(scene)) == pytest.approx(WEIGHT_N, rel=0.02)


def test_steps_may_be_whole_numbers_of_numpy():
    scene = pipe_scene(pipe(), every=np.int64(2))
    scene.step(np.int64(4))
    assert scene.data.time == pytest.approx(4 * scene.model.opt.timestep)


@pytest.mark.parametrize(
    ("name", "fidelity"), [("pvc-pipe", "winkler"), ("pvc-pipe", "auto"), ("ball", "winkler"), ("book", "winkler")]
)
def test_the_normal_force_rises_with_the_squeeze(name, fidelity):
    scene = pipe_scene(pipe(object=name, fidelity=fidelity))
    forces = []
    for grip_n in (1.0, 2.0, 4.0, 6.0, 8.0):
        scene.data.actuator("squeeze").ctrl = grip_n
        scene.step(round(0.3 / scene.model.opt.timestep))
        forces.append(truths(scene)[0].normal_force_n)
    assert forces == pytest.approx([1.0, 2.0, 4.0, 6.0, 8.0], rel=0.02)


@pytest.mark.parametrize(
    ("name", "fidelity"), [("pvc-pipe", "winkler"), ("pvc-pipe", "auto"), ("ball", "winkler"), ("can", "winkler")]
)
def test_the_tangential_force_rises_with_the_load(name, fidelity):
    scene = lifted(grip_n=10.0, object=name, fidelity=fidelity, static_friction=0.9, kinetic_friction=0.8)
    weight_n = 9.81 * scene.model.body("object").subtreemass[0]
    forces = []
    for extra_n in np.arange(0.0, 6.0):
        scene.data.qfrc_applied[scene.model.joint("lift").dofadr] = 0.0
        # The test's own force on the object stays next to the fingertips'.
        scene.data.xfrc_applied[scene.model.body("object").id, 2] -= 1.0 if extra_n else 0.0
        scene.step(round(0.3 / scene.model.opt.timestep))
        forces.append(sum(truth.force_n[1] for truth in truths(scene)))
    assert forces == pytest.approx(weight_n + np.arange(0.0, 6.0), rel=0.02)


def test_forces_of_the_program_are_left_alone():
    """Assigned in each step or once: between steps the applied forces are the program's."""
    once, again = lifted(grip_n=10.0), lifted(grip_n=10.0)
    body = once.model.body("object").id
    once.data.xfrc_applied[body, 2] = -1.0
    for _ in range(100):
        again.data.xfrc_applied[:] = 0.0
        again.data.xfrc_applied[body, 2] = -1.0
        once.step()
        again.step()
    for scene in (once, again):
        assert scene.data.xfrc_applied[body].tolist() == [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]
        assert np.count_nonzero(scene.data.xfrc_applied) == 1
        assert sum(truth.force_n[1] for truth in truths(scene)) == pytest.approx(WEIGHT_N + 1.0, rel=0.02)


@pytest.mark.parametrize("steps", [1, 5])
def test_a_program_that_clears_the_applied_forces_does_not_clear_the_grip(steps):
    kept, cleared = lifted(), lifted()
    for _ in range(40):
        cleared.data.xfrc_applied[:] = 0.0
        kept.step(steps)
        cleared.step(steps)
    assert cleared.data.qpos == pytest.approx(kept.data.qpos, abs=1e-9)
    forces = [np.array([truth.force_n for truth in truths(scene)]) for scene in (cleared, kept)]
    assert forces[0] == pytest.approx(forces[1], abs=1e-6)


def test_the_pipe_slips_when_friction_no_longer_carries_it():
    """The grip weakens until the first gross slip: there the tangential force is friction times the normal force."""
    scene = lifted(grip_n=4.0)
    grip_n = 4.0
    while not any(truth.slip_distance_m for truth in truths(scene)):
        grip_n -= 0.002
        assert grip_n > 1.0
        scene.data.actuator("squeeze").ctrl = grip_n
        scene.step()
    for truth in truths(scene):
        assert truth.tangential_force_n == pytest.approx(0.55 * truth.normal_force_n, rel=0.05)
    assert grip_n == pytest.approx(WEIGHT_N / 2 / 0.55, rel=0.05)


def test_the_wrenches_of_pad_and_object_are_opposite():
    scene = lifted()
    applied = scene.applied
    bodies = [scene.model.body(name).id for name in ("object", "left", "right")]
    force = applied[bodies, :3]
    assert force.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    about_origin = applied[bodies, 3:] + np.cross(scene.data.xipos[bodies], force)
    assert about_origin.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)


@pytest.mark.parametrize("name", ["pvc-pipe", "plank", "ball"])
@pytest.mark.parametrize("ratio", [1.5, 0.9])
def test_a_lift_agrees_with_the_simulated_cell(name, ratio):
    """At the same aperture; `lifts.py` compares all objects."""
    options = CellOptions(object=name, **EVEN)
    cell, scene = lift_in_cell(options, ratio), lift_in_scene(options, ratio)
    assert scene.normal_n == pytest.approx(cell.normal_n, rel=0.05)
    assert scene.slip_m == pytest.approx(cell.slip_m, rel=0.1, abs=0.5e-3)


def test_a_reset_frees_the_gel_and_the_scene_runs_again_alike():
    scene = pipe_scene(pipe(), every=2)

    def run():
        scene.data.actuator("squeeze").ctrl = 6.0
        scene.step(301)
        return truths(scene)[0].normal_force_n

    first = run()
    mujoco.mj_resetData(scene.model, scene.data)
    scene.step(2)
    assert truths(scene)[0].normal_force_n == 0.0
    assert truths(scene)[0].time_s == pytest.approx(scene.data.time)
    assert not scene.applied.any()
    assert run() == pytest.approx(first, rel=1e-3)


@pytest.mark.parametrize(("name", "fidelity"), [("pvc-pipe", "winkler"), ("ball", "auto"), ("duster", "auto")])
def test_an_episode_repeats_exactly_after_a_reset(name, fidelity):
    scene = pipe_scene(pipe(object=name, fidelity=fidelity))

    def episode():
        begun = scene.fingertips[0].tip.image()
        # It is gripped, lifted, and slips as the grip weakens.
        for lift_m, grip_n in ((0.0, 2.0), (0.004, 2.0), (0.004, 0.2)):
            scene.data.actuator("squeeze").ctrl = grip_n
            scene.data.actuator("lift").ctrl = lift_m
            scene.step(60)
        return begun, scene.fingertips[0].tip.image(), scene.data.qpos.copy()

    first = episode()
    scene.reset()
    assert not any(truth.time_s or truth.normal_force_n for truth in truths(scene))
    for one, other in zip(first, episode(), strict=True):
        assert (one == other).all()


@pytest.mark.parametrize("make", [lifted, lambda: pipe_scene(pipe())])
def test_a_scene_that_diverges_is_an_error_and_begins_again(make):
    scene = make()
    scene.data.qvel[-1] = np.nan
    with pytest.raises(DataError, match=r"MuJoCo reset the scene at .* take a shorter step"):
        scene.step(5)
    assert not scene.applied.any()
    scene.reset()
    scene.step(5)


def test_a_callback_that_raises_leaves_no_wrench_behind():
    scene = lifted()

    def control(model, data):
        raise RuntimeError("boom")

    mujoco.set_mjcb_control(control)
    try:
        with pytest.raises(RuntimeError, match="boom"):
            scene.step()
    finally:
        mujoco.set_mjcb_control(None)
    assert not scene.data.xfrc_applied.any()


def test_masses_that_are_welded_to_a_pad_count_for_the_step():
    whole, parts = (scene_of(text, "feel") for text in (pipe_mjcf(pipe()), nested(pipe_mjcf(pipe()))))
    steps = [scene.fingertips[0].stable_step_s() for scene in (whole, parts)]
    assert steps[1] == pytest.approx(steps[0])


@pytest.mark.filterwarnings("ignore:.*forces may be wrong")
def test_a_step_that_is_too_long_is_named():
    light = pipe(mass_kg=0.002, fidelity="auto")
    scene = pipe_scene(light, step_s=2e-3)
    scene.data.actuator("squeeze").ctrl = 6.0
    with pytest.raises(DataError, match=r"pad '\w+' and object 'held': .*the step of 2 ms is not stable, 0\.\d+ ms is"):
        scene.step(3000)


def nested(text):
    """The scene with the geoms of pads and object on separate bodies, welded to those that carry the sites."""
    for name in ("left", "right"):
        text = text.replace(
            f'conaffinity="2"/>\n          <site name="{name}_pad"',
            f'conaffinity="2"/></body>\n          <site name="{name}_pad"',
        )
    text = text.replace('<geom type="box" size="0.004', '<body><geom type="box" size="0.004')
    return text.replace('<geom type="cylinder"', '<body><geom type="cylinder"').replace(
        '<site name="held"', '</body><site name="held"'
    )


def scene_of(text, mode):
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pads = [
        MujocoFingertip(model, data, SimulatedFingertip(pipe(), side=side), pad=f"{name}_pad", target="held")
        for name, side in (("left", "front"), ("right", "back"))
    ]
    return MujocoScene(model, data, pads, mode=mode)


def test_what_is_welded_to_a_pad_or_an_object_belongs_to_it():
    text = nested(pipe_mjcf(pipe(), mode="see"))
    seen = scene_of(text, "see")
    seen.data.actuator("squeeze").ctrl = 6.0
    seen.step(300)
    assert truths(seen)[0].normal_force_n == pytest.approx(6.0, rel=0.05)
    felt = scene_of(text, "feel")
    felt.data.actuator("squeeze").ctrl = 6.0
    with pytest.raises(DataError, match=r"bodies .* and .* collide in MuJoCo, too; name them, and add them"):
        felt.step(300)


@pytest.mark.parametrize("mode", ["feel", "see"])
def test_the_floor_under_an_object_is_not_a_pad_that_does_not_move(mode):
    """Pads that are sites of the world belong to the same body as the floor."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody>
        <geom type="plane" size="1 1 0.1"/>
        <site name="pad" pos="-0.05 0 0.05" xyaxes="0 -1 0 0 0 -1"/>
        <body name="object" pos="0 0 0.075"><freejoint/>
          <geom type="cylinder" size="0.0125 0.075" mass="0.3"/><site name="held" xyaxes="0 -1 0 0 0 -1"/>
        </body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    tip = MujocoFingertip(model, data, SimulatedFingertip(pipe()), pad="pad", target="held")
    scene = MujocoScene(model, data, [tip], mode=mode)
    scene.step(100)
    assert data.ncon > 0
    assert truths(scene)[0].normal_force_n == 0.0


@pytest.mark.parametrize(
    "text",
    [
        pipe_mjcf(pipe(), mode="feel"),
        pipe_mjcf(pipe(), mode="see").replace('contype="2" conaffinity="2"', 'contype="0" conaffinity="0"'),
    ],
    ids=["excluded", "contype"],
)
def test_to_see_a_pair_that_cannot_collide_is_an_error(text):
    with pytest.raises(
        DataError, match=r"'see', but pad 'left.*' and object '.*' cannot collide.*remove their <exclude>"
    ):
        scene_of(text, "see")


def test_seen_contacts_show_the_force_that_mujoco_carries():
    scene = pipe_scene(pipe(), mode="see")
    rest = scene.fingertips[0].tip.image()
    scene.data.actuator("squeeze").ctrl = 6.0
    scene.step(300)
    truth = truths(scene)[0]
    assert truth.normal_force_n == pytest.approx(6.0, rel=0.05)
    assert not scene.applied.any()
    assert np.abs(scene.fingertips[0].tip.image().astype(int) - rest).mean() > 1.0


def test_a_contact_that_mujoco_carries_too_is_an_error():
    model = mujoco.MjModel.from_xml_string(pipe_mjcf(pipe(), mode="see"))
    data = mujoco.MjData(model)
    tip = MujocoFingertip(model, data, SimulatedFingertip(pipe()), pad="left_pad", target="held")
    scene = MujocoScene(model, data, [tip])
    data.actuator("squeeze").ctrl = 6.0
    remedy = r'add <exclude body1="left" body2="object"/> to <contact>'
    with pytest.raises(DataError, match=f"'left' and 'object' collide in MuJoCo, too; {remedy}"):
        scene.step(300)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda scene: MujocoScene(scene.model, scene.data, [], mode="touch"), "write 'feel' or 'see'"),
        (lambda scene: MujocoScene(scene.model, scene.data, [], every=0), "pass a whole number from 1 on"),
        (lambda scene: MujocoScene(scene.model, scene.data, [], every=1.5), "pass a whole number from 1 on"),
        (lambda scene: scene.step(-1), "asked for -1 steps"),
        (lambda scene: scene.step(1.5), "asked for 1.5 steps; pass a whole number"),
        (lambda scene: scene.reset(keyframe=7), "the model has 0 keyframes, and no number 7"),
        (lambda scene: scene.reset(keyframe="a"), "the model has 0 keyframes, and no number 'a'"),
        (lambda scene: pipe_scene(pipe(), step_s=math.nan), "time step is nan s"),
        (lambda scene: pipe_scene(pipe(), step_s="0.001"), "time step is '0.001' s"),
        (lambda scene: MujocoScene(scene.model, scene.data, None), "pass a list of MujocoFingertip"),
        (lambda scene: MujocoScene(scene.model, scene.data, [1]), "pass a list of MujocoFingertip"),
        (
            lambda scene: MujocoFingertip(scene.model, scene.data, 1, pad="left_pad", target="held"),
            "'left_pad' is 1; pass a SimulatedFingertip",
        ),
        (
            lambda scene: MujocoFingertip(scene.model, scene.data, scene.fingertips[0].tip, pad=None, target="held"),
            "no site and no body None",
        ),
        (
            lambda scene: MujocoFingertip(scene.model, scene.data, scene.fingertips[0].tip, pad="thumb", target="held"),
            "no site and no body 'thumb'",
        ),
        (
            lambda scene: MujocoFingertip(
                scene.model, scene.data, scene.fingertips[0].tip, pad="held", target="object"
            ),
            "pad 'held' and object 'object' are on one body",
        ),
        (lambda scene: MujocoScene(scene.model, scene.data, scene.fingertips[:1] * 2), "two pads share one"),
        (
            lambda scene: MujocoScene(scene.model, mujoco.MjData(scene.model), scene.fingertips),
            "belongs to another model or other data",
        ),
        (
            lambda scene: MujocoScene(pipe_scene(pipe()).model, scene.data, scene.fingertips),
            "belongs to another model or other data",
        ),
    ],
)
def test_bad_input_is_one_error_with_its_remedy(make, message):
    with pytest.raises(DataError, match=message):
        make(pipe_scene(pipe()))


@pytest.mark.parametrize("command", [float("nan"), float("inf"), 1e11])
def test_a_command_that_is_no_number_does_not_let_go(command):
    """MuJoCo takes it as zero, and only counts a warning."""
    scene = pipe_scene(pipe())
    scene.data.actuator("squeeze").ctrl = 6.0
    scene.step(100)
    scene.data.actuator("squeeze").ctrl = command
    with pytest.raises(DataError, match="the command of actuator 'squeeze' is"):
        scene.step()
    scene.data.actuator("squeeze").ctrl = 6.0
    scene.step(100)
    assert scene.fingertips[0].tip.truth().normal_force_n == pytest.approx(6.0, rel=0.05)


def test_an_upright_pipe_meets_its_table_at_every_tilt():
    """MuJoCo 4.0.0 finds no contact of a plane and a cylinder of this pose."""
    scene = pipe_scene(pipe())
    scene.data.qpos[-4:] = [0.9999999996763171, 2.459804775062813e-18, 4.837204682801599e-19, -2.544339697996651e-05]
    scene.data.qpos[-5] -= 1e-4
    mujoco.mj_forward(scene.model, scene.data)
    assert scene.data.ncon > 0


def test_the_pads_begin_clear_of_the_object():
    scene = pipe_scene(pipe())
    assert abs(scene.data.site("left_pad").xpos[0]) == pytest.approx(12.5e-3 + CLEARANCE_M)


LOOSE = """<mujoco><option timestep="{step_s}"/><worldbody>
<site name="under" xyaxes="1 0 0 0 1 0"/><site name="left" pos="-{gap_m} 0 0" xyaxes="0 -1 0 0 0 -1"/>
<site name="right" pos="{gap_m} 0 0" xyaxes="0 1 0 0 0 -1"/>
<body name="object" pos="0 0 {height_m}"><freejoint/><geom type="sphere" size="{radius_m}" mass="0.1" contype="0"/>
<site name="held" xyaxes="{axes}"/></body></worldbody></mujoco>"""
LYING, UPRIGHT = "1 0 0 0 1 0", "0 -1 0 0 0 -1"


def loose(shape, radius_m, pads, axes, *, step_s=5e-4, height_m=0.0, gap_m=1.0, fidelity="winkler"):
    """A free object of 0.1 kg at fixed pads."""
    text = LOOSE.format(step_s=step_s, height_m=height_m, gap_m=gap_m, radius_m=radius_m, axes=axes)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    options = pipe(
        shape=shape, diameter_mm=2e3 * radius_m, length_mm=40.0, grip_height_mm=20.0, mass_kg=0.1, fidelity=fidelity
    )
    tips = [SimulatedFingertip(options, side=side) for side in ("front", "back")]
    return MujocoScene(
        model,
        data,
        [MujocoFingertip(model, data, tip, pad=pad, target="held") for tip, pad in zip(tips, pads, strict=False)],
    )


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_what_rolls_on_a_pad_rolls_on_at_its_speed(shape):
    """The normal force acts under the object, not where it first touched: else it would be pushed on."""
    scene = loose(shape, 0.01, ["under"], LYING, height_m=0.0098)
    scene.step(400)
    scene.data.qvel[:] = [0.01, 0.0, 0.0, 0.0, 1.0, 0.0]
    scene.step(1000)
    assert scene.data.qpos[0] == pytest.approx(5e-3, rel=0.1)
    assert scene.data.qvel[4] == pytest.approx(1.0, rel=0.1)
    assert truths(scene)[0].slip_distance_m == 0.0


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
def test_the_stable_step_is_stable_as_deep_as_results_are_valid(fidelity):
    def held(step_s):
        return loose("sphere", 0.02, ["left", "right"], UPRIGHT, step_s=step_s, gap_m=0.0193, fidelity=fidelity)

    scene = held(held(1e-3).fingertips[0].stable_step_s())
    scene.model.opt.gravity[:] = 0.0
    forces = []
    while scene.data.time < 0.3:
        scene.step()
        forces.append(truths(scene)[0].normal_force_n)
    assert np.ptp(forces[-20:]) < 0.02 * forces[-1]


@pytest.mark.parametrize(("multiple", "warns"), [(0.5, 0), (3.0, 1)])
def test_a_step_that_is_surely_too_long_is_warned_of_once(multiple, warns):
    tip = lifted().fingertips[0]
    step_s = multiple * tip.stable_step_s()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(3):
            tip.wrenches(step_s)
    assert len([each for each in caught if "forces may be wrong" in str(each.message)]) == warns


def test_a_copied_scene_sees_its_own_data():
    scene = lifted()
    copied = copy.deepcopy(scene)
    assert copied.fingertips[0].data is copied.data is not scene.data
    before = scene.fingertips[0].pad_pose().position_m
    for each in (scene, copied):
        each.step(3)
    assert truths(copied)[0].tangential_force_n == pytest.approx(truths(scene)[0].tangential_force_n, rel=1e-6)
    copied.data.qpos[:] += 1e-3
    mujoco.mj_forward(copied.model, copied.data)
    assert (copied.fingertips[0].pad_pose().position_m != before).any()


def test_a_callback_that_writes_over_the_wrenches_is_an_error():
    scene = lifted()
    mujoco.set_mjcb_control(lambda model, data: data.xfrc_applied.fill(0.0))
    try:
        with pytest.raises(DataError, match="let it write to qfrc_applied"):
            scene.step()
    finally:
        mujoco.set_mjcb_control(None)


def test_a_callback_may_push_other_bodies():
    scene = lifted()
    other = scene.model.body("carriage").id
    mujoco.set_mjcb_control(lambda model, data: data.xfrc_applied.__setitem__((other, 2), 0.1))
    try:
        scene.step(3)
    finally:
        mujoco.set_mjcb_control(None)


@pytest.mark.filterwarnings("ignore:.*forces may be wrong")
def test_a_wall_is_stable_at_every_step():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="pad" pos="0 0 0.1"><freejoint/><geom size="0.01" contype="0"/></body>'
        '<site name="wall" pos="0 0 0.1"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    fixed = MujocoFingertip(model, data, SimulatedFingertip(pipe()), pad="wall", target="pad")
    assert 0 < fixed.stable_step_s() < 1
    moved = MujocoFingertip(model, data, SimulatedFingertip(pipe()), pad="pad", target="wall")
    assert 0 < moved.stable_step_s() < 1
    with pytest.raises(DataError, match="deep in a gel"):
        moved.wrenches(1e-3)
    assert SimulatedFingertip(pipe()).stable_step_s(math.inf, math.inf) == math.inf


LEDGE = """<mujoco><option timestep="0.001"/><worldbody>
<body name="finger" pos="0 0 0.1"><joint type="slide" axis="0 0 1" stiffness="1e6" damping="1000"/>
<geom type="box" size="0.004 0.0125 0.010" pos="-0.004 0 0" mass="1"/>
<geom type="box" size="0.03 0.0125 0.002" pos="0.026 0 -0.012" mass="0.1"/>
<site name="pad" xyaxes="0 -1 0 0 0 -1"/></body>
<body name="obj" pos="0.0125 0 0.11"><freejoint/><geom type="box" size="0.0124 0.02 0.02" mass="0.3"/>
<site name="held" xyaxes="0 -1 0 0 0 -1"/></body></worldbody></mujoco>"""


def test_what_the_finger_carries_beside_its_pad_does_not_press_on_the_pad():
    """An object on a ledge of the finger, clear of the pad, showed its whole weight as normal force."""
    model = mujoco.MjModel.from_xml_string(LEDGE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    size = {"shape": "box", "diameter_mm": 24.8, "width_mm": 40.0, "length_mm": 40.0, "grip_height_mm": 20.0}
    tip = SimulatedFingertip(CellOptions(**EVEN, **size))
    scene = MujocoScene(model, data, [MujocoFingertip(model, data, tip, pad="pad", target="held")], mode="see")
    scene.step(600)
    assert tip.truth().normal_force_n < 0.01


def test_a_ball_is_one_point_to_touch_grid_and_a_growing_patch_to_a_fingertip():
    """MuJoCo's own tactile sensor, mujoco #1922."""
    cells, patches = [], []
    for load_n in (1.0, 6.0):
        model = mujoco.MjModel.from_xml_string(
            f"""
<mujoco>
  <extension><plugin plugin="mujoco.sensor.touch_grid"/></extension>
  <worldbody>
    <geom type="box" size="0.0125 0.0101 0.002"/>
    <site name="pad" pos="0 0 0.002"/>
    <body pos="0 0 0.0222"><freejoint/><geom type="sphere" size="0.02" mass="{load_n / 9.81}"/></body>
  </worldbody>
  <sensor>
    <plugin name="grid" plugin="mujoco.sensor.touch_grid" objtype="site" objname="pad">
      <config key="size" value="16 16"/><config key="fov" value="45 45"/><config key="nchannel" value="3"/>
    </plugin>
  </sensor>
</mujoco>"""
        )
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 1500)
        grid = data.sensor("grid").data.reshape(3, 16, 16)[0]
        assert grid.sum() == pytest.approx(-load_n, rel=0.01)
        cells.append(np.count_nonzero(grid))
        ball = {"shape": "sphere", "diameter_mm": 40.0, "length_mm": 40.0, "grip_height_mm": 20.0, "fidelity": "auto"}
        tip = SimulatedFingertip(CellOptions(**ball))
        tip.step(Pose.of((0, 0, 0)), Pose.of((0, 0, 0.02)), 2e-3, normal_n=load_n)
        patches.append(tip.gel.contact_fraction(tip.gel_state(), 0.0186, 0.0143))
    assert cells == [1, 1]
    assert patches[0] > 0.05
    assert patches[1] > 1.5 * patches[0]
