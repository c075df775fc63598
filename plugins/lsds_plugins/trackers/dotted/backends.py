"""Trackers of printed dots: one way of following, two ways of measuring."""

from __future__ import annotations

from lsds.contracts import BuildContext
from lsds_plugins.trackers.dotted.follow import DotFollower
from lsds_plugins.trackers.dotted.localise import Centroid, LucasKanade


def lucas_kanade(options: None, context: BuildContext) -> DotFollower:
    """Return the tracker `lk`."""
    return DotFollower(LucasKanade())


def centroid(options: None, context: BuildContext) -> DotFollower:
    """Return the tracker `centroid`."""
    return DotFollower(Centroid())
