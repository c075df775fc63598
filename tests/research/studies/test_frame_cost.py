"""Study `frame`: every part and step is timed and drawn, the imprint as a separate part."""

import json

from click.testing import CliRunner

from lsds.cli.main import cli

PARTS = ("image to command", "perception", "imprint", "detector", "estimator", "grip belief", "controller")
STEPS = ("views", "tracker (with its views)", "field", "depth and contact", "features")
OF_IMPRINT = ("relief", "edges", "gel carried along", "registration")


def test_study_frame(tmp_path):
    plot, result = tmp_path / "f.png", tmp_path / "f.json"
    arguments = ["study", "frame", "--repeats", "1", "--plot", str(plot), "--json", str(result)]
    done = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert done.exit_code == 0
    assert "simulated" in done.output
    assert plot.stat().st_size > 10_000
    found = json.loads(result.read_text())
    parts = {part["name"].strip(): part for part in (found["total"], *found["parts"])}
    assert list(parts) == [*PARTS, *STEPS, *(f"imprint: {step}" for step in OF_IMPRINT)]
    assert parts["imprint"]["runs"] == parts["imprint: relief"]["runs"] == found["frames"]
    assert parts["imprint: registration"]["runs"] < found["frames"], "the first frame has none before it"
    assert all(part["p50_us"] > 0 for part in parts.values())
    assert {row["name"] for row in found["trackers"]} >= {"lk", "centroid", "blobs, nearest"}
