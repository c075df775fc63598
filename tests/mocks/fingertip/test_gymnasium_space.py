"""The observation of a fingertip lies in its space."""

import sys

import numpy as np
import pytest
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.gymnasium_space import observation, observation_space
from lsds_mocks.fingertip.pose import Pose

from lsds.errors import MissingExtra
from tests.mocks.fingertip.lifts import EVEN


def pressed():
    tip = SimulatedFingertip(CellOptions(**EVEN))
    for y_m in np.linspace(0.0, 0.2e-3, 10):
        tip.step(Pose.of((0, 0, 0)), Pose.of((0, y_m, 12e-3)), 2e-3)
    return tip


def test_an_observation_lies_in_its_space():
    pytest.importorskip("gymnasium")
    tip = pressed()
    assert observation_space(tip).contains(observation(tip))


def test_it_holds_the_load_and_the_markers_motion():
    seen = observation(pressed())
    truth = pressed().truth()
    assert seen["force"] == pytest.approx([0.0, truth.force_n[1], -truth.normal_force_n], abs=1e-6)
    assert seen["force"][1] > 0.1
    assert 2.0 < seen["markers"][:, 1].max() < 4.0
    assert np.abs(seen["markers"][:, 1]).min() < 0.5


def test_without_gymnasium_the_space_is_an_error_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(MissingExtra, match=r"'lsds-tactile\[gymnasium\]'"):
        observation_space(pressed())
