"""Kinematics, profiles and moves: exact where they end, within limits on the way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.wire.ur.controller import CYCLE_S, Controller
from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.functions import Library, waiting
from lsds_mocks.wire.ur.kinematics import MODELS, Kinematics
from lsds_mocks.wire.ur.modes import SafetyMode
from lsds_mocks.wire.ur.motion.profile import profile, timed_profile
from lsds_mocks.wire.ur.options import UrOptions
from lsds_mocks.wire.ur.pose_math import compose, difference, inverse, norm, rotation_of, vector_of
from lsds_mocks.wire.ur.script.compiler import compile_script

angles = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6)
vectors = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3)


class Arm:
    """A controller that runs a program to its end and keeps what the joints did."""

    def __init__(self, **options):
        self.controller = Controller(UrOptions(**options), Environment(options.get("floor_m")), Library)

    def run(self, body, cycles=5000):
        self.controller.start(compile_script(f"def f():\n{body}\nend", waiting()))
        track = [list(self.controller.arm.q)]
        for _ in range(cycles):
            self.controller.cycle()
            track.append(list(self.controller.arm.q))
            if self.controller.program is None and not self.controller.arm.moving:
                break
        return np.array(track)


def speeds(track):
    return np.diff(track, axis=0) / CYCLE_S


@pytest.mark.parametrize("name", MODELS)
@settings(max_examples=60)
@given(q=angles)
def test_every_inverse_solution_leads_to_the_pose_and_one_is_where_we_were(name, q):
    arm = Kinematics(MODELS[name])
    pose = arm.flange(q)
    solutions = arm.solutions(pose, q)
    for solution in solutions:
        shift, turn = difference(pose, arm.flange(solution))
        # With a straight elbow an angle is known only to the square root of the arithmetic's precision.
        assert norm(shift) < 1e-7
        assert norm(turn) < 1e-6
    if abs(math.sin(q[4])) > 1e-3:
        assert min(max(abs(a - b) for a, b in zip(s, q, strict=True)) for s in solutions) < 1e-5


@settings(max_examples=60)
@given(q=angles)
def test_the_jacobian_is_the_derivative_of_the_pose(q):
    arm = Kinematics(MODELS["ur5e"])
    jacobian = arm.jacobian(q, arm.flange(q)[:3])
    for joint in range(6):
        moved = list(q)
        moved[joint] += 1e-6
        shift, turn = difference(arm.flange(q), arm.flange(moved))
        assert np.allclose(np.array([*shift, *turn]) / 1e-6, jacobian[:, joint], atol=1e-4)


def test_the_pose_is_the_one_that_the_makers_simulator_shows():
    q = [-1.6007, -1.7271, -2.2030, -0.8080, 1.5951, -0.0310]
    assert Kinematics(MODELS["ur5e"]).flange(q) == pytest.approx(
        [-0.14397, -0.43562, 0.20203, -0.00122, 3.11628, 0.03889], abs=2e-4
    )


@given(a=vectors, b=vectors, va=vectors, vb=vectors)
def test_poses_compose_and_invert(a, b, va, vb):
    first, second = [*a, *va], [*b, *vb]
    back = compose(inverse(first), compose(first, second))
    shift, turn = difference(second, back)
    assert norm(shift) < 1e-8
    assert norm(turn) < 1e-6


@given(v=vectors)
def test_a_rotation_vector_survives_its_matrix(v):
    turn = norm(v)
    again = vector_of(rotation_of(v))
    assert norm(again) <= math.pi + 1e-9
    assert np.allclose(rotation_of(again), rotation_of(v), atol=1e-6), turn


@given(length=st.floats(1e-4, 5), speed=st.floats(0.01, 3), acceleration=st.floats(0.05, 40))
def test_a_profile_covers_its_length_within_its_limits(length, speed, acceleration):
    way = profile(length, speed, acceleration)
    times = np.linspace(0, way.duration_s, 400)
    at = np.array([way.share(t) * length for t in times])
    v = np.diff(at) / np.diff(times)
    assert at[0] == 0
    assert at[-1] == pytest.approx(length)
    assert v.min() > -1e-6
    assert v.max() <= speed * (1 + 1e-6)
    assert np.abs(np.diff(v) / np.diff(times)[0]).max() <= acceleration * 1.01 + 1e-6


@given(length=st.floats(1e-3, 5), duration=st.floats(0.1, 10), acceleration=st.floats(0.05, 40))
def test_a_timed_profile_takes_its_time(length, duration, acceleration):
    way = timed_profile(length, duration, acceleration)
    assert way.duration_s == duration
    assert way.share(duration) == 1.0
    assert way.share(duration / 2) == pytest.approx(0.5, abs=1e-6)


def test_movej_ends_exactly_and_keeps_its_speed_and_acceleration():
    arm = Arm()
    q = list(arm.controller.arm.q)
    target = [q[0] + 0.5, q[1] - 0.2, *q[2:]]
    track = arm.run(f"movej({target}, a=2.0, v=0.8)")
    assert track[-1] == pytest.approx(target, abs=1e-12)
    v = speeds(track)
    assert np.abs(v).max() <= 0.8 * (1 + 1e-9)
    assert np.abs(np.diff(v, axis=0) / CYCLE_S).max() <= 2.0 * 1.01
    assert len(track) * CYCLE_S == pytest.approx(0.5 / 0.8 + 0.4 + 0.03, abs=0.02)


def test_movel_goes_straight_and_turns_nothing():
    arm = Arm()
    start = arm.controller.tcp_pose
    track = arm.run("p0 = get_actual_tcp_pose()\np0[2] = p0[2] + 0.1\np0[1] = p0[1] - 0.05\nmovel(p0, a=0.5, v=0.2)")
    poses = np.array([arm.controller.kinematics.flange(q) for q in track])
    way = poses[:, :3] - start[:3]
    along = np.array([0, -0.05, 0.1]) / np.linalg.norm([0, -0.05, 0.1])
    off = way - np.outer(way @ along, along)
    assert np.abs(off).max() < 1e-9
    assert np.abs(poses[:, 3:] - start[3:]).max() < 1e-9
    assert poses[-1, :3] - start[:3] == pytest.approx([0, -0.05, 0.1], abs=1e-12)
    assert np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1).max() / CYCLE_S <= 0.2 * (1 + 1e-6)


def test_a_move_in_a_given_time_takes_it():
    arm = Arm()
    q = list(arm.controller.arm.q)
    track = arm.run(f"movej({[q[0] + 0.3, *q[1:]]}, t=2.0)")
    assert len(track) * CYCLE_S == pytest.approx(2.03, abs=0.02)


def test_what_a_joint_cannot_do_in_the_time_takes_longer():
    arm = Arm()
    q = list(arm.controller.arm.q)
    track = arm.run(f"movej({[q[0] + 2.0, *q[1:]]}, t=0.1)")
    assert np.abs(speeds(track)).max() <= math.pi * (1 + 1e-6)
    assert track[-1][0] == pytest.approx(q[0] + 2.0)


def test_a_blend_never_stops_at_the_corner_and_ends_exactly():
    arm = Arm()
    body = """
      a = get_actual_tcp_pose()
      b = pose_add(a, p[0, -0.1, 0, 0, 0, 0])
      c = pose_add(b, p[0.1, 0, 0, 0, 0, 0])
      movel(b, a=0.5, v=0.1, r=0.02)
      movel(c, a=0.5, v=0.1)
    """
    start = arm.controller.tcp_pose
    track = arm.run(body)
    poses = np.array([arm.controller.kinematics.flange(q) for q in track])
    v = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1) / CYCLE_S
    under_way = v[60:-80]
    assert under_way.min() > 0.02
    assert poses[-1, :3] == pytest.approx([start[0] + 0.1, start[1] - 0.1, start[2]], abs=1e-9)
    corner = np.array([start[0], start[1] - 0.1, start[2]])
    assert 0.0005 < np.linalg.norm(poses[:, :3] - corner, axis=1).min() < 0.02


def test_movec_stays_on_its_circle():
    arm = Arm()
    body = """
      a = get_actual_tcp_pose()
      movec(pose_add(a, p[0.05, -0.05, 0, 0, 0, 0]), pose_add(a, p[0.1, 0, 0, 0, 0, 0]), a=0.5, v=0.1)
    """
    start = np.array(arm.controller.tcp_pose[:3])
    poses = np.array([arm.controller.kinematics.flange(q)[:3] for q in arm.run(body)])
    radius = np.linalg.norm(poses - (start + np.array([0.05, 0, 0])), axis=1)
    assert np.abs(radius - 0.05).max() < 1e-9
    assert poses[-1] == pytest.approx(start + np.array([0.1, 0, 0]), abs=1e-9)


def test_speedl_goes_at_its_speed_and_brakes_when_the_script_drops_it():
    arm = Arm()
    track = arm.run("speedl([0, 0, 0.05, 0, 0, 0], a=0.5, t=0.5)")
    z = np.array([arm.controller.kinematics.flange(q)[2] for q in track])
    v = np.diff(z) / CYCLE_S
    assert v[150:200] == pytest.approx(0.05, abs=1e-4)
    assert not arm.controller.arm.moving
    assert np.abs(np.diff(v) / CYCLE_S).max() < 10


@pytest.mark.parametrize("slider", [1.0, 0.25])
def test_speedj_has_one_acceleration_in_each_stretched_step(slider):
    arm = Arm()
    arm.controller.io.slider = slider
    arm.controller.start(compile_script("def f():\n  speedj([0.1,0,0,0,0,0], 0.5, 0.02)\n  stopj(4)\nend", waiting()))
    seen = set()
    for _ in range(round(10 / slider) - 1):
        arm.controller.cycle()
        seen.add(arm.controller.arm.qdd[0])
    assert seen == {0.5}
    assert arm.controller.arm.qd[0] == pytest.approx(0.01, abs=0.0011)


def test_stopj_ends_at_exactly_zero():
    arm = Arm()
    arm.run("speedj([0.3, 0.2, 0, 0, 0, 0.1], 2, 0.3)\nstopj(4)")
    assert arm.controller.arm.qd == [0.0] * 6


def test_servoj_settles_on_its_target_without_overshoot():
    arm = Arm()
    q = list(arm.controller.arm.q)
    servo = f"servoj({[q[0] + 0.05, *q[1:]]}, t=0.002, lookahead_time=0.1, gain=300)"
    track = arm.run(f"i = 0\nwhile i < 600:\n  {servo}\n  i = i + 1\nend")
    assert track[-1][0] == pytest.approx(q[0] + 0.05, abs=1e-5)
    assert track[:, 0].max() <= q[0] + 0.05 + 1e-6


def test_a_pose_out_of_reach_ends_in_a_protective_stop_where_the_arm_stands_still():
    arm = Arm()
    track = arm.run("movel(p[2, 0, 0.5, 0, 3.1, 0])")
    assert arm.controller.safety is SafetyMode.PROTECTIVE_STOP
    assert np.abs(track[-1] - track[0]).max() < 0.2
    assert not arm.controller.unlock()
    for _ in range(2501):
        arm.controller.cycle()
    assert arm.controller.safety is SafetyMode.PROTECTIVE_STOP, "an unlock that was refused is not remembered"
    assert arm.controller.unlock()
    assert arm.controller.safety is SafetyMode.NORMAL


def test_force_mode_rests_on_the_floor_with_the_force_asked_for():
    height = Arm().controller.tcp_pose[2]
    arm = Arm(floor_m=height - 0.01)
    body = """
      force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, -10, 0, 0, 0], 2, [1, 1, 0.1, 1, 1, 1])
      sleep(4)
      textmsg("force ", get_tcp_force())
      end_force_mode()
    """
    arm.run(body)
    texts = [m.text for m in arm.controller.messages if hasattr(m, "text")]
    force = next(float(t.split(",")[2]) for t in texts if t.startswith("force"))
    assert force == pytest.approx(10, rel=0.05)


@settings(max_examples=15)
@given(
    steps=st.lists(
        st.tuples(st.sampled_from(["speedj", "speedl", "movej", "stopj", "wait"]), st.floats(-1, 1)), max_size=6
    )
)
def test_joints_never_jump_whatever_follows_what(steps):
    lines = []
    for kind, x in steps:
        lines.append(
            {
                "speedj": f"speedj([{x}, {-x}, 0, 0, {x / 2}, 0], 3.0, 0.1)",
                "speedl": f"speedl([0, {x / 10}, {x / 10}, 0, 0, {x / 5}], 1.0, 0.1)",
                "movej": f"q = get_actual_joint_positions()\nq[0] = q[0] + {x / 3}\nmovej(q, a=3.0, v=1.0)",
                "stopj": "stopj(5)",
                "wait": "sleep(0.05)",
            }[kind]
        )
    track = Arm().run("\n".join(lines) or "sync()", cycles=2500)
    assert np.abs(np.diff(speeds(track), axis=0)).max(initial=0) < 0.15
