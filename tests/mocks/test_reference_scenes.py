"""The gel `winkler` against the finite-pad reference solution, where its files are at hand."""

import os

import pytest
import reference_scenes

DIRECTORY = os.path.join(os.environ.get("LSDS_DATA", ""), "contact_reference")


@pytest.mark.skipif(
    "LSDS_DATA" not in os.environ or not os.path.isdir(DIRECTORY),
    reason="needs reference solutions: set LSDS_DATA to a folder that holds contact_reference/",
)
@pytest.mark.parametrize(("scene", "bound_um"), [("sphere", 9), ("pipe", 26), ("block", 30), ("torsion", 15)])
def test_marker_field(scene, bound_um):
    errors = reference_scenes.errors(DIRECTORY, scene)
    assert errors["rms_um"] < bound_um
    assert abs(errors["normal"]) < 0.15
    if scene != "torsion":
        assert abs(errors["shear_first"]) < 0.12
        assert abs(errors["shear_last"]) < 0.12


@pytest.mark.parametrize("scene", ["sphere", "pipe", "block", "torsion"])
def test_scenes_end_in_full_slip_or_nearly(scene):
    gel, states, _ = reference_scenes.run(scene)
    assert len(states) == 15
    assert gel.stick_ratio < 0.35
