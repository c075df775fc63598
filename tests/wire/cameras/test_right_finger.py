"""The tactile camera's mock on either finger."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.placement import Placement
from lsds_mocks.gel.shapes import Sphere
from lsds_mocks.wire.cameras.gelsight_mini import GelView
from lsds_mocks.wire.cameras.options import GelSightMiniOptions

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext


class PressedGel:
    """A `GelLink` onto a ball pressed into the right half of the left finger's image."""

    def __init__(self):
        self.gel = FieldGel(Sphere(12e-3), fine=1)
        self._rest = self.gel.state()
        self.gel.place = Placement(4e-3, 0.0)
        self.gel.press(0.3e-3)
        self._pressed = self.gel.state()

    def at(self, t_ns):
        return self._pressed if t_ns else self._rest

    def close(self):
        pass


def test_the_right_fingers_picture_is_of_the_mirrored_gel():
    columns = {}
    for finger in ("left", "right"):
        options = GelSightMiniOptions(
            finger=finger, width=320, height=240, pad="none", noise=0.0, dim_start=False, optics="full"
        )
        view = GelView(options, PressedGel(), BuildContext(VirtualClock(), 0))
        rest, pressed = (view.picture(t_ns, 5, 5).astype(float) for t_ns in (0, 1))
        change = np.abs(pressed - rest).sum(axis=(0, 2))
        columns[finger] = change @ np.arange(320) / change.sum()
    # The lamps are not mirrored, so the change of colour does not lie quite evenly about the ball.
    assert columns["left"] == pytest.approx(159.5 + 64, abs=8)
    assert columns["right"] == pytest.approx(159.5 - 64, abs=8)
