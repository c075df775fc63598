"""Errors of imprint and gel, estimated from frames without slip.

Without slip, the measured motion of the imprint against the gel is an error, which `lsds.tactile.imprint.uncertainty`
models by two parameters. The gel's motion under the object is uncertain by a share of the markers' motion. At rest, the
image trembles by a fraction of a pixel. Both parameters maximise the likelihood of the errors, for a Student
distribution with four degrees of freedom.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.tactile.imprint.uncertainty import FAINT_STD_M, GEL_SHARE, likelihood

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.tactile.imprint.motion import ImprintMotion

SHARES = np.geomspace(0.03, 0.6, 12)
"""Values of `gel_share` that are tried."""
STILLS_M = FAINT_STD_M * np.geomspace(0.25, 4, 9)
"""Values of `still_m` that are tried, m."""
LEAST_MATCH = 0.5
"""Minimum match of the imprint for a known motion."""
LEAST_NOISE_FRAMES = 50
"""Minimum number of frames for an estimate."""
MOST_NOISE_FRAMES = 1500
"""Maximum number of frames that are used; more are thinned out."""
MOVES_M = 4 * FAINT_STD_M
"""Minimum motion of the markers in a frame that determines `gel_share`, m."""


class ImprintNoise(NamedTuple):
    """Uncertainty of the gel's motion: `gel_share` of the markers' motion, and `still_m` at rest (m)."""

    gel_share: float = GEL_SHARE
    still_m: float = FAINT_STD_M


def imprint_noise(motions: Sequence[ImprintMotion | None]) -> ImprintNoise | None:
    """Return the most likely noise; None if the imprint is known in too few frames.

    If the gel moved in too few of them, `gel_share` is the default.
    """
    known = [motion for motion in motions if motion is not None and motion.match >= LEAST_MATCH]
    if len(known) < LEAST_NOISE_FRAMES:
        return None
    known = known[:: -(-len(known) // MOST_NOISE_FRAMES)]

    def fit(noise: ImprintNoise) -> float:
        return sum(likelihood(motion, *noise) for motion in known)

    # Maximise one parameter after the other, twice: they hardly depend on each other.
    noise = ImprintNoise()
    moves = sum(motion.dots_m > MOVES_M for motion in known) >= LEAST_NOISE_FRAMES
    for _ in range(2):
        if moves:
            noise = max((noise._replace(gel_share=float(share)) for share in SHARES), key=fit)
        noise = max((noise._replace(still_m=float(still)) for still in STILLS_M), key=fit)
    return noise
