"""Answers to generators of points, for tests of certificates."""

from __future__ import annotations

import numpy as np


def answered(draw, margin):
    """Run a generator of points with a function for their margins; return its estimate and all points."""
    asked = []
    try:
        points = next(draw)
        while True:
            asked += points
            points = draw.send([margin(point) for point in points])
    except StopIteration as end:
        return end.value, np.array(asked)


def budget(runs):
    return lambda done: done / runs
