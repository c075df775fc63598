"""Lifts: delay of the gripper against the margin of the law, or the gain of the PD controller."""

from __future__ import annotations

from functools import partial

from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_plugins.controllers.belief import BeliefOptions
from lsds_plugins.controllers.pd import PdOptions

from lsds.support.extras import importable
from lsds_research.stability.delay_margin import delay_margin_s
from lsds_research.stability.grid import Axis, Curve
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy

PD_GAIN = PdOptions().kp
"""Proportional gain of the PD controller at the default margin of the belief, ticks per cm/s: that of the paper."""
DEFAULT_MARGIN = BeliefOptions().margin
"""Default margin of the belief."""
CAMERA_MS = GelSightOptions().latency_ms
"""Delay of the simulated camera, ms: the part of the loop's delay that is not the gripper's."""
MARGINS = (1.03, DEFAULT_MARGIN, 1.2, 1.35, 1.5)
"""Margins of the full map; chosen around the default."""


def measure(method: str, delay_ms: float, margin: float, seed: int) -> float:
    """Return the slip of the pipe (mm)."""
    settings: dict[str, float] = {"gripper.mock-hand-e.latency_ms": delay_ms}
    if method == "belief":
        settings["controller.belief.margin"] = margin
    elif method == "pd":
        settings["controller.pd.kp"] = PD_GAIN * margin / DEFAULT_MARGIN
    return slip_mm(lifted(method, seed, settings))


def curves() -> tuple[Curve, ...]:
    """Return the greatest delay of the gripper at which the linear loop of `pd` is stable, in ms, by margin.

    It is the delay margin of the loop without the camera's own delay, and below 0 if the camera alone takes longer.
    """
    if not importable("control"):
        return ()
    left = [(1e3 * delay_margin_s(margin / DEFAULT_MARGIN) - CAMERA_MS, margin) for margin in MARGINS]
    return (("pd", "limit of the linear loop", left),)


def remarks() -> tuple[str, ...]:
    """Return the delay margin of the linear loop, which no point of the map respects."""
    if not importable("control"):
        return ()
    margins = [1e3 * delay_margin_s(margin / DEFAULT_MARGIN) for margin in MARGINS]
    least, most = min(margins), max(margins)
    return (
        f"pd: the linear loop has a delay margin of {least:.1f} to {most:.1f} ms (python-control), less than the "
        "camera's own delay: beyond it the law overshoots, and static friction ends the slip, not the loop",
    )


MAP = slip_map(
    "loop-delay",
    "Lift of the pipe: slip by delay of the gripper and margin (belief), or gain in units of default / "
    f"{DEFAULT_MARGIN:g} (pd)",
    Axis("delay of the gripper", "ms", (20, 40, 80, 120, 160, 200, 300, 400), (40, 120, 300), (40, 200)),
    Axis("margin", "", MARGINS, (DEFAULT_MARGIN, 1.35), (DEFAULT_MARGIN,)),
    measure,
    remarks=remarks,
    curves=curves,
)
study = partial(StabilityStudy, MAP)
