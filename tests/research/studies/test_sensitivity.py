"""The sensitivity study: each parameter varied alone, within its bounds, on the same lifts."""

from __future__ import annotations

from dataclasses import asdict

import pytest
from lsds_research.studies.grip import study as grip_study
from lsds_research.studies.grip.options import GripOptions
from lsds_research.studies.grip.sensitivity import variants
from lsds_research.studies.grip.study import GripStudy

from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.errors import DataError

pytestmark = pytest.mark.usefixtures("installed_host")


def test_every_variant_is_a_valid_config_and_differs_from_it():
    found = variants("belief", [])
    assert len({name for name, _, _ in found}) >= 15
    plain = load_config(None, ["controller.backend=belief"])
    for name, value, text in found:
        varied = load_config(None, ["controller.backend=belief", text])
        assert varied != plain, name
        table, key = name.rsplit(".", 1)
        options = varied.grip.model_dump() if table == "grip" else varied.section("controller").options()
        assert options[key] == pytest.approx(value)


def test_a_value_at_its_bound_is_varied_to_the_bound():
    values = [value for name, value, _ in variants("belief", []) if name == "grip.kinetic"]
    assert values == [1.0, 1.56]


def lifted(what):
    """A lift without a simulation: a small margin drops the object."""
    drops = any(text.startswith("controller.belief.margin=1.0") for text in what.settings)
    row = dict.fromkeys(("arrest_s", "change_slip_mm", "crushed", "fault", "steady_excess_n"))
    numbers = {"slip_mm": 1.0, "turned_deg": 0.0, "first_over_needed": 0.9, "peak_over_needed": 1.5}
    return asdict(what) | row | numbers | {
        "held": not drops, "outcome": "dropped" if drops else "held",
        "steady_over_needed": None if drops else 1.3, "closings_without_slip": 0
    }  # fmt: skip


def test_lifts_that_are_lost_by_a_value_are_counted(monkeypatch):
    monkeypatch.setattr(grip_study, "lift", lifted)
    options = GripOptions(objects=["pvc-pipe", "ball"], controllers=["belief"], sensitivity=True, jobs=1)
    result = GripStudy(options, BuildContext(VirtualClock())).run(lambda done, whole: None)
    rows = {(row["parameter"], row["value"]): row for row in result.rows}
    plain = rows["as it is", None]
    assert plain["held"] == 1.0
    smaller = rows["controller.belief.margin", 1.0]
    assert (smaller["held"], smaller["lost"]) == (0.0, f"{plain['runs']}, 0")
    assert all(row["held"] == 1.0 for key, row in rows.items() if key[0] != "controller.belief.margin")


@pytest.mark.parametrize("controllers", [[], ["belief", "pd"], ["off"]])
def test_it_asks_for_one_controller(controllers):
    options = GripOptions(controllers=controllers, sensitivity=True, jobs=1)
    with pytest.raises(DataError, match="--controller NAME once"):
        GripStudy(options, BuildContext(VirtualClock())).run(lambda done, whole: None)
