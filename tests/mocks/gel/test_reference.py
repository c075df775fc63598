"""The finite elastic pad against reference solutions on a 0.12 mm grid, where their files are at hand."""

import os
from pathlib import Path

import numpy as np
import pytest
from lsds_mocks.gel.auto.gel import AutoGel
from lsds_mocks.gel.field.gel import FieldGel
from lsds_research.studies.gel.run_scene import lead, rms_m
from lsds_research.studies.gel.scenes import reference_scenes

DIRECTORY = Path(os.environ.get("LSDS_DATA", "")) / "contact_reference"
pytestmark = pytest.mark.skipif(
    "LSDS_DATA" not in os.environ or not DIRECTORY.is_dir(),
    reason="needs reference solutions: set LSDS_DATA to a folder that holds contact_reference/",
)


def load(name):
    with np.load(DIRECTORY / f"{name}.npz") as file:
        return {key: file[key].astype(float) for key in file}


def dots(reference):
    return reference["marker_xy_mm"] * 1e-3, reference["marker_u_mm"].transpose(0, 2, 1) * 1e-3


@pytest.mark.parametrize("parts", [1, 20])
@pytest.mark.parametrize(
    ("name", "rms_um", "percent"),
    [("sphere", 2.0, 1.0), ("torsion", 2.0, 1.0), ("pipe", 3.5, 1.0), ("block", 3.5, 3.0)],
)
def test_dots_forces_and_stuck_area(name, rms_um, percent, parts):
    scene, reference = reference_scenes()[name], load(name)
    xy, truth = dots(reference)
    trace = lead(FieldGel(scene.shape, fine=2, follows=False), scene, xy, parts)
    assert rms_m(trace, truth)[0] < rms_um * 1e-6
    assert trace.forces[:, 3] == pytest.approx(reference["normal_N"], rel=percent / 100)
    pull, most = reference["tangential_N"], np.abs(reference["tangential_N"]).max()
    if name != "torsion":
        assert trace.forces[:, :2] == pytest.approx(pull, abs=percent / 100 * most)
    else:
        torque = reference["torque_Nmm"] * 1e-3
        assert trace.forces[:, 2] == pytest.approx(torque, abs=0.015 * np.abs(torque).max())
    if parts == 1:  # what slid at any time in a frame is what the reference counts
        stuck, contact = reference["stick_mm2"][1:], reference["contact_mm2"][0]
        assert trace.stuck_m2[1:] * 1e6 == pytest.approx(stuck, abs=0.1 * contact)


@pytest.mark.parametrize("name", ["sphere", "torsion", "pipe", "block"])
@pytest.mark.parametrize("tolerance_um", [3.0, 6.0, 12.0])
def test_the_choosing_gel_meets_its_tolerance(name, tolerance_um):
    scene, reference = reference_scenes()[name], load(name)
    xy, truth = dots(reference)
    trace = lead(AutoGel(scene.shape, tolerance_m=tolerance_um * 1e-6, follows=False), scene, xy)
    assert rms_m(trace, truth)[0] < tolerance_um * 1e-6
