"""Study `asked`: detectors and estimators in every frame of simulated trials."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from lsds_research.studies.asked.study import _slips, _speeds
from lsds_research.studies.asked.trial import AskedTrial

from lsds.cli.main import main


def trial(protocol, slip, velocity, said, told):
    slip, velocity, said, told = (np.array(values, float) for values in (slip, velocity, said, told))
    return AskedTrial("can", protocol, f"can__{protocol}", slip, velocity, {"d": said}, {"e": told.reshape(-1, 6)})


def test_alarms_are_counted_beside_slides_and_where_only_the_load_changes():
    still = [(0.0, 0.0, 0.0)] * 4
    nothing = [[0.0] * 6] * 4
    slide = trial("severity", [1, 1, 0, 0], still, [1, math.nan, 1, 0], nothing)
    load = trial("loads", [0, 0, 0, 0], still, [0, 0, 0, 1], nothing)
    row = _slips("d", "can", [slide, load])
    assert (row["found"], row["per_100_sliding"], row["per_100_loads"], row["load_frames"]) == (0.5, 50, 25, 4)
    assert row["answered"] == pytest.approx(7 / 8)


def test_an_estimator_that_abstains_counts_as_saying_zero():
    velocity = [(0.0, 0.02, 0.0), (0.0, 0.04, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)]
    told = [[0, 0.03, 0, 0.01, 0.1, 0.03], [math.nan] * 6, [0, 0, 0.8, 0.001, 0.05, 0.0], [0, 0, 0, 0.001, 0.1, 0.0]]
    row = _speeds("e", "can", [trial("severity", [1, 1, 1, 0], velocity, [0] * 4, told)])
    assert row["moving_mae_cm_s"] == pytest.approx((1 + 4) / 2)
    assert row["moving_zero_cm_s"] == pytest.approx(3)
    assert row["mae_cm_s"] == pytest.approx(5 / 4)
    assert (row["moving_coverage"], row["answered"]) == (1.0, 0.75)
    assert row["angular_error"] == pytest.approx(20)
    assert row["turning_coverage"] == 0.0
    assert math.isnan(row["load_mae_cm_s"])


def test_the_command_asks_what_is_installed(tmp_path, capsys):
    told = tmp_path / "told.json"
    names = ("--object", "book", "--quick", "--detector", "imprint", "--estimator", "imprint", "--jobs", "1")
    assert main(["study", "asked", *names, "--json", str(told)]) == 0
    assert "simulated" in capsys.readouterr().out
    result = json.loads(told.read_text())
    assert result["figures_are"] == "simulated"
    assert result["failures"] == {}
    (row,) = [row for row in result["detectors"] if row["object"] == "book"]
    assert row["per_100_loads"] <= 2
    assert row["load_frames"] > 100


def test_an_object_without_a_plan_and_an_unknown_backend_are_said(capsys):
    assert main(["study", "asked", "--object", "bal", "--detector", "imprint", "--estimator", "imprint"]) != 0
    assert "ball" in capsys.readouterr().err
    assert main(["study", "asked", "--detector", "imprnt"]) != 0
    assert "imprint" in capsys.readouterr().err
