"""Random objects of the study `grip` that only a grip outside the model's validity holds."""

from __future__ import annotations

from lsds_research.studies.grip.options import GripOptions
from lsds_research.studies.grip.study import _within_validity


def row(controller, name, outcome, held=True):
    return {"controller": controller, "object": name, "outcome": outcome, "held": held}


def test_objects_that_a_firm_grip_holds_within_the_model_are_counted_apart():
    found = {
        str(number): each
        for number, each in enumerate(
            [
                row("off", "a", "held"),
                row("off", "a", "outside the model's validity"),
                row("off", "b", "outside the model's validity"),
                row("off", "c", "held"),
                row("belief", "a", "held"),
                row("belief", "b", "dropped", held=False),
                row("belief", "c", "dropped", held=False),
            ]
        )
    }
    rows = [each for each in found.values() if each["controller"] == "belief"]
    (note,) = _within_validity(found, rows, GripOptions(random=3, controllers=["belief"]))
    assert note == "objects that a firm grip holds within the model's validity: held by belief in 1 of 2 lifts"
    assert _within_validity(found, rows, GripOptions()) == []
