"""Normal force from the fingers' closure: gel and finger in series, alike on both sides."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel


def squeeze(gel: GelModel, closure_m: float, finger_n_m: float, coverage: float = 1.0) -> tuple[float, float]:
    """Return indentation (m) and normal force (N) of one finger closed by `closure_m` beyond first touch.

    Solves d + N(d) / k = closure for the gel's own law N(d), which is convex and increasing, so Newton started from
    the far end falls onto the root without overshooting.
    """
    if closure_m <= 0 or coverage <= 0:
        return 0.0, 0.0
    depth = closure_m
    for _ in range(60):
        force = gel.normal_force(depth, coverage)
        step = 1e-6 * depth
        slope = 1.0 + (gel.normal_force(depth + step, coverage) - force) / (step * finger_n_m)
        change = (depth + force / finger_n_m - closure_m) / slope
        depth -= change
        if abs(change) < 1e-13:
            break
    return depth, gel.normal_force(depth, coverage)
