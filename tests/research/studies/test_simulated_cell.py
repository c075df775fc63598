"""Studies measure what they say, and draw it."""

import json

from click.testing import CliRunner

from lsds.cli.main import cli


def run(*arguments):
    return CliRunner().invoke(cli, ["study", *arguments], catch_exceptions=False)


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
    done = CliRunner().invoke(cli, ["study", "gel", "--scene", "spoon", "--plot", str(tmp_path / "g.png")])
    assert done.exit_code != 0
    assert "no scene 'spoon'" in str(done.exception) + done.output
