"""`lsds calibrate grip`: a known weight calibrates the dots' displacement in newtons."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner

from lsds.calibration.answer import AnswerTimer
from lsds.calibration.friction import _compared as compared_friction
from lsds.calibration.grip import BEFORE, CARRIED, _compared, lifted_weight
from lsds.cli.calibrate import calibrate
from lsds.config import load_config
from lsds.contracts import ContactLoad, Grip, GripperState, Situation, Wanted
from lsds.errors import ConfigError, DataError
from lsds.session.track import only_watching


def loads(*forces_n):
    return [ContactLoad((0.01, force), 0.0, 0.01, 0.001) for force in forces_n]


def test_the_simulated_cell_finds_its_gel_and_the_config_takes_the_file(tmp_path, installed_host):
    out = tmp_path / "grip.toml"
    result = CliRunner().invoke(calibrate, ["grip", "--out", str(out), "--json", "-"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    # Of this gel and object, by the cell's own truth.
    assert found["weight_n"] == pytest.approx(2.93, abs=0.1)
    assert 15 < found["shear_kpa_mm"] < 30
    assert found["before_kpa_mm"] == 27.2
    # A frame of 40 ms, 25 ms of the camera, 40 ms of the gripper, and the steps in which they are looked at.
    assert 0.105 < found["answer_s"] < 0.14
    assert 0 < found["noise"] < 0.1
    config = load_config(None, [f'calibration=["{out}"]'])
    assert config.grip.answer_s == pytest.approx(found["answer_s"], abs=1e-3)
    assert config.grip.noise == 0.1, "one object does not show how loads differ between objects"
    assert config.tactile.shear_kpa_mm == pytest.approx(found["shear_kpa_mm"], abs=1e-3)
    own = load_config(None, [f'calibration=["{out}"]', "tactile.shear_kpa_mm=30.0"])
    assert own.tactile.shear_kpa_mm == 30.0, "the config's own value overrides the file"


def test_a_weight_that_is_given_counts_as_that_of_the_cell_does(tmp_path, installed_host):
    out = tmp_path / "grip.toml"
    result = CliRunner().invoke(calibrate, ["grip", "--mass-g", "299", "--out", str(out), "--json", "-"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["weight_n"] == pytest.approx(2.93, abs=0.01)
    assert 0.105 < found["answer_s"] < 0.14


def test_two_fingers_share_the_weight_and_one_carries_half():
    both = {name: loads(*[0.1] * 20) for name in ("left", "right")}
    carried = {"left": loads(*[2.0, 2.02] * 10), "right": loads(*[1.0, 1.02] * 10)}
    found = _compared({BEFORE: both, CARRIED: carried}, 5.64, 10.0)
    assert found.shear_kpa_mm == pytest.approx(20.0, rel=0.02)
    assert found.shares["left"] == pytest.approx(2 * found.shares["right"], rel=0.1)
    assert sum(found.shares.values()) == pytest.approx(1.0)
    one = _compared({BEFORE: {"left": both["left"]}, CARRIED: {"left": carried["left"]}}, 3.8, 10.0)
    assert one.shear_kpa_mm == pytest.approx(10.0, rel=0.02)


@pytest.mark.parametrize(
    ("carried", "message"),
    [
        (loads(2.0), "fewer than 10 frames"),
        (loads(*[0.1] * 20), "shows no load"),
        (loads(*[1.0, 3.0] * 10), "did it slip or swing"),
    ],
)
def test_a_lift_without_information_gives_one_error(carried, message):
    with pytest.raises(DataError, match=message):
        _compared({BEFORE: {"left": loads(*[0.1, 0.12] * 10)}, CARRIED: {"left": carried}}, 3.0, 27.2)


def test_a_rig_that_cannot_lift_is_refused(installed_host):
    config = only_watching(load_config(None, []))
    with pytest.raises(ConfigError, match="a weight has to be lifted"):
        lifted_weight(config, 3.0, print)


def test_a_slide_shows_static_over_kinetic_friction(tmp_path, installed_host):
    out = tmp_path / "friction.toml"
    result = CliRunner().invoke(calibrate, ["grip", "--slide", "--out", str(out), "--json", "-"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    # The simulated friction: 0.55 at rest, and 0.45 to 0.49 at 1 cm/s, by 8 % from place to place.
    assert 1.1 < found["kinetic"] < 1.3
    assert load_config(None, [f'calibration=["{out}"]']).grip.kinetic == pytest.approx(found["kinetic"], abs=1e-3)


def test_a_slide_needs_no_weight(tmp_path, installed_host):
    result = CliRunner().invoke(
        calibrate, ["grip", "--slide", "--mass-g", "300", "--out", str(tmp_path / "friction.toml")]
    )
    assert result.exit_code == 2
    assert "--slide needs no --mass-g" in result.output


@pytest.mark.parametrize(
    ("seen", "message"),
    [
        ([0.5] * 5, "only 5 frames"),
        ([0.0] * 40, "moves with the fingers"),
        ([0.1 * at for at in range(40)] + [4.0] * 40, "never gave way"),
    ],
)
def test_a_slide_that_shows_nothing_gives_one_error(seen, message):
    with pytest.raises(DataError, match=message):
        compared_friction(seen)


def test_one_wrong_frame_is_no_static_friction():
    seen = [0.05 * at for at in range(20)] + [0.8] * 10 + [9.0] + [0.8] * 30
    assert compared_friction(seen).static_n == pytest.approx(0.95, abs=0.06)


class Steps:
    """A job that wants a list of grips, one for each step."""

    def __init__(self, *apertures_m):
        self.wanted = iter(apertures_m)

    def begin(self, setting):
        pass

    def step(self, now):
        return Wanted("close", grip=Grip(next(self.wanted), 0.05, 60.0))


def at_ms(t_ms, aperture_m, moving=False):
    return Situation(t_ms * 1_000_000, gripper=GripperState(t_ms * 1_000_000, 0, aperture_m, aperture_m, moving))


def test_the_gripper_is_timed_from_a_new_command_until_it_moves():
    timer = AnswerTimer(Steps(0.03, 0.03, 0.03, 0.03))
    for t_ms, aperture_m in ((0, 0.04), (8, 0.04), (40, 0.04), (48, 0.0395)):
        timer.step(at_ms(t_ms, aperture_m))
    assert timer.answer(0.04).gripper_s == pytest.approx(0.048)


def test_a_gripper_that_is_under_way_or_never_moves_is_not_timed():
    timer = AnswerTimer(Steps(0.03, 0.02, 0.02))
    for t_ms, aperture_m, moving in ((0, 0.04, True), (8, 0.039, False), (2000, 0.039, False)):
        timer.step(at_ms(t_ms, aperture_m, moving))
    assert math.isnan(timer.answer(0.04).gripper_s)
