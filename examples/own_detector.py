"""Your own detector on a recording, next to the shipped one.

python examples/own_detector.py clip.avi
"""

import sys

import lsds


class Area:
    """Slip where the contact area shrinks: a rule to try out, not one to trust."""

    def __init__(self, per_s: float) -> None:
        self.per_s = per_s

    def slips(self, seen: lsds.Observation) -> bool:
        """Decide on one frame."""
        return seen.features["area_rate"] < -self.per_s


if len(sys.argv) != 2:
    sys.exit(__doc__)
rule, own, shipped, frames = Area(per_s=0.5), 0, 0, 0
for cycle in lsds.watch(sys.argv[1]):
    frames += 1
    own += rule.slips(cycle.observation)
    shipped += cycle.detection.slip is True
print(f"{frames} frames: own rule {own}, shipped detector {shipped}")
