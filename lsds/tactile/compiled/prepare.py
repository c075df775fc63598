"""One-time compilation of the frame path, so that no frame waits for it."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import Frame
from lsds.tactile.compiled.registration import registered
from lsds.tactile.depth import DepthEstimator
from lsds.tactile.imprint.carrying import CarriedGel
from lsds.tactile.imprint.layers import Layers
from lsds.tactile.imprint.motion import sharpness
from lsds.tactile.imprint.registration import Registration
from lsds.tactile.imprint.relief import ReliefMaker

if TYPE_CHECKING:
    from numpy.typing import NDArray


@cache
def prepare() -> None:
    """Compile the functions, or load them from the cache; print a notice if that takes long."""
    kept = getattr(getattr(registered, "stats", None), "cache_path", None)
    if kept is None or not any(Path(kept).glob("registration.registered-*.nbi")):
        print("compiling the frame path, once on this machine: some 20 s", file=sys.stderr, flush=True)
    frames = [Frame(_image(seq), seq, seq) for seq in range(2)]
    DepthEstimator(frames[0], 1e-4, compiled=True).measure(frames[1])
    sharpness(frames[0], compiled=True)
    maker = ReliefMaker(compiled=True)
    first, second = (Layers(maker.relief(frame), compiled=True) for frame in frames)
    xy = np.array([[x, y] for y in (20.0, 40.0, 60.0) for x in (20.0, 50.0, 80.0)])
    gel = CarriedGel(xy, 0.01 * xy, 20.0, (_SIZE[1], _SIZE[0]), compiled=True)
    Registration(first, second, gel, (24.0, 16.0), 2.0).slipped()


#: Height and width of the image that is processed, px; chosen large enough for a depth map at every scale.
_SIZE = (64, 96)


def _image(seed: int) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(60, 180, (*_SIZE, 3), np.uint8)
