"""Studies measure what they say, and draw it."""

import json

import pytest
from click.testing import CliRunner
from lsds_research.studies.dynamics.integrators import IN_PRODUCT, SCHEMES, Setting, return_map
from lsds_research.studies.dynamics.study import drop

from lsds.cli.main import cli


@pytest.mark.parametrize("name", IN_PRODUCT)
@pytest.mark.parametrize("stiffness", [2.1e3, 16e3])
def test_the_products_integrators_hold_where_others_fail(name, stiffness):
    setting = Setting(stiffness_n_m=stiffness)
    exact, _ = drop(return_map(1.0), setting, 1e-4)
    for dt_ms, allowed_mm in ((0.5, 1.5), (2, 1.5), (8, 3), (40, 12)):
        fallen, created = drop(SCHEMES[name], setting, dt_ms * 1e-3)
        assert abs(fallen - exact) < allowed_mm * 1e-3
        assert created <= 1e-9


def test_lugre_never_lets_go_and_explicit_reset_makes_energy():
    setting = Setting()
    assert abs(drop(SCHEMES["LuGre, semi-implicit"], setting, 2e-3)[0]) < 1e-3
    assert drop(SCHEMES["Haessig-Friedland, explicit"], setting, 40e-3)[1] > 0.01


def run(*arguments):
    return CliRunner().invoke(cli, ["chart", *arguments], catch_exceptions=False)


def test_chart_dynamics(tmp_path):
    plot, table = tmp_path / "d.png", tmp_path / "d.csv"
    done = run("dynamics", "--reference-ms", "0.1", "--plot", str(plot), "--csv", str(table))
    assert done.exit_code == 0
    assert "simulated" in done.output
    assert plot.stat().st_size > 10_000
    assert len(table.read_text().splitlines()) == 1 + 2 * len(SCHEMES)


def test_chart_gel(tmp_path):
    plot, result = tmp_path / "g.png", tmp_path / "g.json"
    done = run(
        "gel", "--scene", "torsion", "--random", "0", "--repeats", "1", "--plot", str(plot), "--json", str(result)
    )
    assert done.exit_code == 0
    assert plot.stat().st_size > 10_000
    rows = {row["model"]: row for row in json.loads(result.read_text())["rows"]}
    assert {"winkler", "half-space 0.48", "layer 0.48", "pad 0.96", "pad 0.48"} <= set(rows)
    assert rows["pad 0.48"]["rms_um"] < rows["pad 0.96"]["rms_um"] < rows["winkler"]["rms_um"]
    assert rows["pad 0.48"]["rms_um"] < 3


def test_chart_optics(tmp_path):
    plot, result = tmp_path / "o.png", tmp_path / "o.json"
    done = run("optics", "--scene", "sphere", "--repeats", "1", "--plot", str(plot), "--json", str(result))
    assert done.exit_code == 0
    assert plot.stat().st_size > 10_000
    rows = {row["tier"]: row for row in json.loads(result.read_text())["rows"]}
    assert rows["full"]["l1_levels"] < rows["linear"]["l1_levels"] < rows["markers"]["l1_levels"]
    assert rows["linear"]["l1_levels"] < 2
    assert rows["linear"]["psnr_db"] > 45
    assert all(row["frame_us"] >= row["image_us"] > 0 for row in rows.values())


def test_an_unknown_scene_is_one_clear_error(tmp_path):
    done = CliRunner().invoke(cli, ["chart", "gel", "--scene", "spoon", "--plot", str(tmp_path / "g.png")])
    assert done.exit_code != 0
    assert "no scene 'spoon'" in str(done.exception) + done.output
