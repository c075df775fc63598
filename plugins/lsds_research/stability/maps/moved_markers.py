"""Stability map: the image of a gel with markers moves as a whole; shipped trackers and naive ones follow it."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from lsds.config import load_config
from lsds.contracts import Frame
from lsds.registry import PluginHost
from lsds.runtime.rig import Rig
from lsds.session.bring_up import bring_up
from lsds_research.studies.frame.cost import WRONG_PX
from lsds_research.studies.frame.peers import BlobNearest, PyramidFlow

if TYPE_CHECKING:
    from numpy.typing import NDArray

NAIVE = {"blobs, nearest": BlobNearest, "pyramidal LK": PyramidFlow}
INTERVAL_NS = 40_000_000
"""Time between two frames, ns: a camera at 25 Hz."""
COVER_PX = 11
"""Radius of the patch that covers a vanished marker."""
LIMIT_SHARE = 0.02
"""Accepted share of wrong markers without a flag: the motion fit is robust against a few outliers."""


@lru_cache(maxsize=8)
def still(seed: int) -> tuple[Frame, NDArray[np.uint8]]:
    """Return an untouched gel of the default cell, and the same surface without markers."""
    with bring_up(overrides=[f"seed={seed}", "job.backend=watch"]) as engine:
        frame = next(iter(engine)).frame
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * COVER_PX + 1, 2 * COVER_PX + 1))
    bare = cv2.GaussianBlur(cv2.morphologyEx(frame.image, cv2.MORPH_CLOSE, around), (0, 0), 3.0)
    return frame, np.asarray(bare, np.uint8)


def tracker_named(name: str) -> Any:
    """Return a new tracker."""
    if name in NAIVE:
        return NAIVE[name]()
    host = PluginHost()
    return host.build("tracker", name, {}, Rig(load_config(None, (), host=host), host).context)


def wrong_unflagged(method: str, shift_px: NDArray[np.float64], lost_share: float, seed: int) -> float:
    """Let the image jump by `shift_px` (x, y), back, and again, with a share of the markers covered.

    Returns the share of markers that are reported at another's place and not flagged, in the worst of these frames.
    """
    frame, bare = still(seed)
    tracker = tracker_named(method)
    reference = tracker.start(frame)
    tracker.update(Frame(frame.image, 0, 0))
    covered = np.random.default_rng(seed).permutation(reference.count)[: round(lost_share * reference.count)]
    height, width = frame.image.shape[:2]
    cover = np.zeros((height, width), np.uint8)
    for x, y in np.rint(reference.xy_px[covered]).astype(int):
        cv2.circle(cover, (int(x), int(y)), COVER_PX, 255, -1)
    image = np.where(cover[:, :, None] > 0, bare, frame.image)
    worst = 0.0
    for seq, times in enumerate((1, 0, 1), start=1):
        moved = times * shift_px
        move = np.array([[1.0, 0.0, moved[0]], [0.0, 1.0, moved[1]]])
        shown = cv2.warpAffine(image, move, (width, height), borderMode=cv2.BORDER_REPLICATE)
        tracks = tracker.update(Frame(np.asarray(shown, np.uint8), seq * INTERVAL_NS, seq))
        off = np.abs(tracks.xy_px - reference.xy_px - moved).max(axis=1)
        worst = max(worst, float(np.mean(tracks.valid & (off > WRONG_PX))))
    return worst
