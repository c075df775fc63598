"""The sensor in the simulated cell: its grain follows the gel, and a lift by dense flow holds."""

from __future__ import annotations

from pathlib import Path

import lsds
import numpy as np

from lsds_digit.drawing import GelDrawing
from lsds_digit.options import MockOptions

RIG = Path(__file__).resolve().parents[1] / "rig.toml"
SPEC = MockOptions().spec()


class Sheared:
    """A gel that is displaced as a whole by (x, y), in metres."""

    def __init__(self, xy_m: tuple[float, float]) -> None:
        self.normal_n, self.tangential_n = 0.0, (0.0, 0.0)
        self._xy_m = xy_m

    def displacement_m(self, xy_m: np.ndarray) -> np.ndarray:
        return np.tile(self._xy_m, (len(xy_m), 1))

    def depth_m(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        return np.zeros((len(y_m), len(x_m)), np.float32)

    def contact_fraction(self, width_m: float, height_m: float) -> float:
        return 0.0


def test_the_grain_moves_with_the_surface() -> None:
    drawing = GelDrawing(SPEC, [1])
    right_px, down_px = 4, 6
    shift = Sheared((right_px * SPEC.metres_per_px, down_px * SPEC.metres_per_px))
    rest = drawing.image(Sheared((0.0, 0.0)), 0).astype(float)
    moved = drawing.image(shift, 1).astype(float)
    inner = np.s_[40:280, 40:200]
    back = np.roll(moved, (-down_px, -right_px), (0, 1))
    assert np.abs(back[inner] - rest[inner]).mean() < 0.5 * np.abs(moved[inner] - rest[inner]).mean()


def test_lifts_by_dense_flow_hold() -> None:
    """Nothing detects slip on this gel, and one lift in eight closes by far too much (seed 0)."""
    outcomes = []
    for seed in range(4):
        session = lsds.run(RIG, overrides=["task.lift_s=1.0", f"seed={seed}"])
        assert session.fault is None
        assert session.summary["figures_are"] == "simulated"
        outcomes.append(session.summary["outcome"])
    assert outcomes.count("held") >= 3
