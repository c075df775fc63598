"""Fit the normal force of an imprint: `python -m lsds_research.studies.grip.fit_normal` (some 4 minutes).

Random objects of development draws are lifted, and the estimate of every frame is compared with the true normal force.
The stiffness `lsds.tactile.contact_load.PRESSED_N_M3` is right when the estimate is right in the median of the objects.
It is fitted on half of the draws; the errors that are printed are those of the objects of the other half: of the
force, and of its growth between the least and the greatest force of a lift, which is what grip depends on.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.cli.threads import one_thread, processes
from lsds.session.run import run
from lsds.support.processes import spread
from lsds.tactile.contact_load import PRESSED_N_M3
from lsds_research.metrics import median_and_scatter
from lsds_research.studies.grip.random_objects import drawn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.contracts import Cycle

FITTED = (1001, 1002)
"""Development draws of random objects on which the stiffness is fitted."""
TRIED = (1003, 1004)
"""Development draws on which it is tried."""
OBJECTS = 16
"""Number of objects of each draw."""
LEAST_N = 0.05
"""Minimum true normal force of a frame that counts, N."""
STEADY_SHARE = 0.05
"""Maximum relative change of the true force over a frame that counts; chosen."""
FRAME_S = 0.04
"""Time of a frame, s."""
LEAST_FORCE_FRAMES = 5
"""Minimum number of frames of an object that counts; chosen."""
GROWN_RATIO = 1.5
"""Minimum ratio of the greatest force to the least in a lift whose growth counts; chosen."""


class Pressed(NamedTuple):
    """Of one object, its shape, and of each frame with an estimate the estimated and the true normal force (N)."""

    shape: str
    estimated_n: NDArray[np.float64]
    true_n: NDArray[np.float64]

    @property
    def error(self) -> float:
        """Median logarithm of the estimate over the true force."""
        return float(np.median(np.log(self.estimated_n / self.true_n)))

    @property
    def growth_error(self) -> float:
        """Logarithm of the estimated growth over the true one, NaN if the force hardly grows."""
        low, high = int(np.argmin(self.true_n)), int(np.argmax(self.true_n))
        if self.true_n[high] < GROWN_RATIO * self.true_n[low]:
            return math.nan
        ratio = self.estimated_n / self.true_n
        return math.log(ratio[high] / ratio[low])


def pressed(which: tuple[int, int]) -> Pressed:
    """Lift an object (draw, number) with the default controller."""
    each = drawn(*which)
    seen: dict[int, float] = {}

    def take(cycle: Cycle) -> None:
        for finger in cycle.fingers:
            load = finger.observation.load
            if load is not None and load.normal_n > 0:
                seen[finger.observation.t_ns] = load.normal_n

    session = run(None, each.lift("belief", each.squeeze_mm).overrides(), observe=take)
    t_s, force_n = np.array([(truth.t_ns * 1e-9, truth.normal_force_n) for truth in session.truths]).T
    at_s = np.array(list(seen), float) * 1e-9
    true_n, before_n = np.interp(at_s, t_s, force_n), np.interp(at_s - FRAME_S, t_s, force_n)
    counts = (true_n > LEAST_N) & (np.abs(true_n - before_n) < STEADY_SHARE * true_n)
    return Pressed(dict(each.cell)["shape"], np.array(list(seen.values()))[counts], true_n[counts])


def lifted(draws: Sequence[int]) -> list[Pressed]:
    """Lift the objects of some draws; those that show no normal force are left out."""
    which = [(draw, index) for draw in draws for index in range(OBJECTS)]
    found = (result for _, result in spread(pressed, which, processes()) if isinstance(result, Pressed))
    return [each for each in found if len(each.true_n) >= LEAST_FORCE_FRAMES]


def main() -> None:
    """Lift, fit, and print what was found (simulated)."""
    one_thread()
    fitted = lifted(FITTED)
    shift = float(np.median([each.error for each in fitted]))
    print(f"stiffness {PRESSED_N_M3 * math.exp(-shift):.3g} N/m^3 by {len(fitted)} objects; in use {PRESSED_N_M3:.3g}")
    tried = lifted(TRIED)
    for shape in sorted({each.shape for each in tried}):
        errors = np.array([each.error - shift for each in tried if each.shape == shape])
        growths = np.array([each.growth_error for each in tried if each.shape == shape])
        print(f"{shape}: error {median_and_scatter(errors)}; of the growth {median_and_scatter(growths)}")


if __name__ == "__main__":
    main()
