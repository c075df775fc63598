"""The objects of the protocols: fifteen training objects, five held-out objects, and the pipe of the demonstration.

For each object: its thickness, and the squeeze that gives a force. The numbers are those of the simulated
cell (`[cell.simulated] object`); on another cell they are starting values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import ConfigError, ConfigIssue
from lsds.registry.backends import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

FORCES_N = (1.0, 3.0, 9.0)
"""Normal forces per finger at which a plan lists its squeezes, N; chosen."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Thickness between the pads and length along the slide (mm), minimum normal force per finger that carries the
    object (N), and the squeeze (mm) at which each finger presses with each of `FORCES_N`."""

    thickness_mm: float
    length_mm: float
    needed_n: float
    closure_mm: tuple[float, float, float]

    def aperture_m(self, force_n: float) -> float:
        """Return the aperture at which each finger presses with a force (N): by a power law between the known
        points."""
        known = np.log(self.closure_mm)
        forces = np.log(FORCES_N)
        at = math.log(force_n)
        slopes = np.diff(known) / np.diff(forces)
        side = 0 if at < forces[1] else 1
        closure_mm = math.exp(known[1] + slopes[side] * (at - forces[1]))
        return max(0.0, self.thickness_mm - closure_mm) * 1e-3

    def force_n(self, aperture_m: float) -> float:
        """Return the force (N) at an aperture, the inverse; 0 without contact."""
        closure_mm = self.thickness_mm - aperture_m * 1e3
        if closure_mm <= 0:
            return 0.0
        known, forces = np.log(self.closure_mm), np.log(FORCES_N)
        slopes = np.diff(forces) / np.diff(known)
        at = math.log(closure_mm)
        return math.exp(forces[1] + slopes[0 if at < known[1] else 1] * (at - known[1]))


PLANS: dict[str, Plan] = {
    "pvc-pipe": Plan(25, 150, 2.675, (0.76, 1.88, 4.96)),
    "book": Plan(22, 200, 2.289, (0.6, 1.72, 5.08)),
    "scissors": Plan(8, 170, 0.981, (1.08, 2.72, 6.92)),
    "plank": Plan(18, 250, 2.044, (0.44, 1.32, 3.88)),
    "sponge": Plan(40, 110, 0.103, (3.04, 9.04, 26.8)),
    "duster": Plan(38, 130, 0.561, (1.16, 3, 8.6)),
    "can": Plan(45, 120, 3.433, (0.72, 1.84, 4.88)),
    "bottle": Plan(44, 200, 3.270, (0.8, 2.08, 5.56)),
    "ball": Plan(40, 40, 0.368, (1.28, 2.68, 6.04)),
    "marble": Plan(24, 24, 0.245, (1.4, 2.88, 6.36)),
    "marker-pen": Plan(18, 140, 0.294, (0.8, 2, 5.16)),
    "screwdriver": Plan(30, 100, 0.654, (0.92, 2.04, 5.08)),
    "battery": Plan(34, 61, 1.526, (0.72, 1.84, 4.84)),
    "glue-stick": Plan(21, 90, 0.268, (0.76, 1.96, 5.04)),
    "cardboard-box": Plan(40, 150, 1.509, (0.6, 1.8, 5.32)),
    "tape-roll": Plan(45, 50, 0.654, (0.68, 1.76, 4.68)),
    "ruler": Plan(4, 300, 0.294, (0.44, 1.32, 3.84)),
    "phone": Plan(9, 150, 1.358, (0.44, 1.28, 3.84)),
    "steel-block": Plan(20, 60, 5.518, (0.48, 1.4, 4.16)),
    "candle": Plan(22, 200, 0.981, (0.76, 1.96, 5.04)),
    "wooden-dowel": Plan(12, 250, 0.327, (0.84, 2.12, 5.44)),
}

UNSEEN = ("book", "scissors", "plank", "sponge", "duster")
"""The paper's five held-out objects."""
PIPE = "pvc-pipe"
SEEN = tuple(name for name in PLANS if name not in (*UNSEEN, PIPE))
"""The fifteen training objects."""


def check_objects(names: Sequence[str]) -> None:
    """Raise ConfigError for objects of a study that are not in the catalogue."""
    unknown = [name for name in names if name not in PLANS]
    if unknown:
        known = f"there are {', '.join(PLANS)}"
        issues = [ConfigIssue("objects", f"no object '{name}'", did_you_mean(name, PLANS) or known) for name in unknown]
        raise ConfigError("options of the study", issues)
