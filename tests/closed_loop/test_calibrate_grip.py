"""`lsds calibrate grip`: a known weight tells how many newtons the dots' displacement is."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from lsds.calibration.grip import BEFORE, CARRIED, _compared, lifted_weight
from lsds.cli.calibrate import calibrate
from lsds.config import load_config
from lsds.contracts import ContactLoad
from lsds.errors import ConfigError, DataError
from lsds.tracking import only_watching


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
    config = load_config(None, [f'calibration=["{out}"]'])
    assert config.tactile.shear_kpa_mm == pytest.approx(found["shear_kpa_mm"], abs=1e-3)
    own = load_config(None, [f'calibration=["{out}"]', "tactile.shear_kpa_mm=30.0"])
    assert own.tactile.shear_kpa_mm == 30.0, "what the config says itself counts more"


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
    ("carried", "says"),
    [
        (loads(2.0), "fewer than 10 frames"),
        (loads(*[0.1] * 20), "shows no load"),
        (loads(*[1.0, 3.0] * 10), "did it slip or swing"),
    ],
)
def test_a_lift_that_tells_nothing_gives_one_error(carried, says):
    with pytest.raises(DataError, match=says):
        _compared({BEFORE: {"left": loads(*[0.1, 0.12] * 10)}, CARRIED: {"left": carried}}, 3.0, 27.2)


def test_a_rig_that_cannot_lift_is_refused(installed_host):
    config = only_watching(load_config(None, []))
    with pytest.raises(ConfigError, match="a weight has to be lifted"):
        lifted_weight(config, 3.0, print)
