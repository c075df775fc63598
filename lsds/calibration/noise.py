"""How far imprint and gel err: learnt where nothing slips.

Where nothing slips, the imprint's motion against the gel is an error of the size that
`lsds.tactile.imprint.uncertainty` states. By a share of the dots' motion the gel under the object is in doubt; and by a
fraction of a pixel the camera trembles where nothing moves. Both are those for which the errors are the likeliest, by a
Student distribution with four degrees of freedom.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.tactile.imprint.uncertainty import GEL_SHARE, LEAST_M, likelihood

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.tactile.imprint.motion import ImprintMotion

SHARES, STILLS_M = np.geomspace(0.03, 0.6, 12), LEAST_M * np.geomspace(0.25, 4, 9)
"""The values that are tried."""
LEAST_MATCH = 0.5
"""Where the imprint was found again worse than this, its motion is not known."""
LEAST_FRAMES, MOST_FRAMES = 50, 1500
"""Fewer do not tell; more tell nothing new, and are thinned out."""
MOVES_M = 4 * LEAST_M
"""Of a gel that moves by less than this the share of its motion tells nothing."""


class ImprintNoise(NamedTuple):
    """The gel is in doubt by `gel_share` of the dots' motion, and `still_m` where nothing moves (m)."""

    gel_share: float = GEL_SHARE
    still_m: float = LEAST_M


def imprint_noise(motions: Sequence[ImprintMotion | None]) -> ImprintNoise | None:
    """Return the likeliest noise; None where the imprint was seen in too few frames to tell.

    Where the gel moved in too few of them, its share is the usual one.
    """
    known = [motion for motion in motions if motion is not None and motion.match >= LEAST_MATCH]
    if len(known) < LEAST_FRAMES:
        return None
    known = known[:: -(-len(known) // MOST_FRAMES)]

    def told(noise: ImprintNoise) -> float:
        return sum(likelihood(motion, *noise) for motion in known)

    # One after the other, twice: the two hardly depend on each other, as one counts where nothing moves.
    noise = ImprintNoise()
    moves = sum(motion.dots_m > MOVES_M for motion in known) >= LEAST_FRAMES
    for _ in range(2):
        if moves:
            noise = max((noise._replace(gel_share=float(share)) for share in SHARES), key=told)
        noise = max((noise._replace(still_m=float(still)) for still in STILLS_M), key=told)
    return noise
