"""Trackers against rendered truth: run a path, count what is right, flagged and wrong without a flag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lsds_plugins.trackers.dotted.backends import centroid, lucas_kanade
from tactile.render import pad_positions, render
from tactile.scenes import frame

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext

FOLLOWERS = {"lk": lucas_kanade, "centroid": centroid}
WRONG_PX = 3.0


@dataclass
class Step:
    """One frame: error (N,) px of every track, NaN where lost, and its tracks in the truth's order."""

    error_px: np.ndarray
    valid: np.ndarray
    flags: np.ndarray

    @property
    def wrong_unflagged(self):
        return int(np.count_nonzero(self.error_px[self.valid] > WRONG_PX))

    @property
    def kept(self):
        return int(np.count_nonzero(self.valid))


def build(name):
    return FOLLOWERS[name](None, BuildContext(VirtualClock(), 0))


class Bench:
    """A tracker that has seen the undeformed pad `rest` (N, 2); `look` are options of the renderer."""

    def __init__(self, name, pad=(7, 9), rest=None, **look):
        self.look = look
        self.rest = pad_positions() if rest is None else rest
        self.tracker = build(name)
        self.reference = self.tracker.start(frame(render(self.rest, seed=9_999, **look), 0), pad)
        squared = ((self.reference.xy_px[:, None] - self.rest[None]) ** 2).sum(-1)
        self.dot = squared.argmin(1)
        self.at = 0

    def show(self, image, truth_px=None, gap=1):
        self.at += gap
        tracks = self.tracker.update(frame(image, self.at))
        truth = np.full((len(self.rest), 2), np.nan) if truth_px is None else truth_px
        error = np.hypot(*(tracks.xy_px - truth[self.dot]).T)
        return Step(error, tracks.valid, tracks.flags)

    def move(self, displacement_px, gap=1, painted=(), **look):
        """Show the pad displaced; dots `painted` over (indices) are not drawn."""
        truth = self.rest + displacement_px
        drawn = np.delete(truth, list(painted), axis=0)
        return self.show(render(drawn, seed=self.at, **self.look, **look), truth, gap)


def rms(steps):
    """RMS error per coordinate (px) of the tracks that the tracker stands by."""
    error = np.concatenate([step.error_px[step.valid] for step in steps])
    return float(np.sqrt(np.mean(error**2) / 2))


def bump(rest, sigma_px, centre=(160, 120)):
    """Weights (N, 1) of a displacement that is felt around one place."""
    return np.exp(-((rest - np.asarray(centre)) ** 2).sum(1, keepdims=True) / (2 * sigma_px**2))


def directions(count=8):
    angle = np.arange(count) * 2 * np.pi / count
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def jumps(name, travels=range(16, 45, 4), pad=(7, 9)):
    """One-frame jumps of the whole pad: {travel: (tracks, wrong, wrong without a flag, all-flagged)}.

    A track is wrong where the tracker, made to answer, would be off: lost or flagged ones count as wrong, too.
    """
    bench = Bench(name, pad)
    table = {}
    for travel in travels:
        tracks = right = unflagged = 0
        for way in directions():
            bench.tracker.reset()
            bench.at = 0
            step = bench.move(travel * way)
            tracks += len(step.valid)
            unflagged += step.wrong_unflagged
            right += step.kept - step.wrong_unflagged
        table[travel] = (tracks, tracks - right, unflagged)
    return table
