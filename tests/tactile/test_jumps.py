"""Jumps of a pad, or a part of it, by exactly one pitch, and anchors that hold a deformed gel."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_plugins.trackers.dotted import association
from tactile.following import Bench, bump
from tactile.render import pad_positions

PADS = {
    "35": {"rows": 5, "cols": 7, "pitch": (40.0, 40.0)},
    "63": {},
    "130": {"rows": 10, "cols": 13, "pitch": (22.0, 21.0)},
    "35 of a larger pad": {"rows": 11, "cols": 13, "pitch": (48.0, 46.0)},
    "130 of a larger pad": {"rows": 16, "cols": 18, "pitch": (24.0, 24.0)},
}
PARTS = {
    "whole": lambda rest: rest[:, 0] > -1e3,
    "half": lambda rest: rest[:, 0] > 160,
    "third": lambda rest: rest[:, 1] > 160,
}


def jumped(pad, part, missing, seed):
    """Three frames after a part of the pad has jumped by exactly one pitch, and a share of its dots is missing."""
    rest = pad_positions(**PADS[pad])
    rest = rest[((rest > -60) & (rest < np.array([380, 300]))).all(axis=1)]
    pitch = PADS[pad].get("pitch", (33.0, 32.0))
    bench = Bench("lk", None, rest, **({"diameter": 8.0} if pitch[0] < 30 else {}))
    rng = np.random.default_rng(seed)
    displacement = np.zeros_like(rest)
    direction = [(1, 0), (-1, 0), (0, 1), (0, -1)][seed % 4]
    displacement[PARTS[part](rest)] = np.array(direction) * pitch
    painted = rng.choice(len(rest), int(missing * len(rest)), replace=False)
    bench.move(0 * displacement)
    return [bench.move(displacement, painted=painted) for _ in range(3)]


@pytest.mark.parametrize("missing", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("pad", PADS)
def test_anchors_believe_no_marker_after_a_jump_of_one_pitch(pad, part, missing, monkeypatch):
    """All dots are at places of rest then: what is flagged without anchors stays flagged."""
    for seed in range(4):
        with_anchors = jumped(pad, part, missing, seed)
        with monkeypatch.context() as patch:
            patch.setattr(association, "ANCHORED", 2.0)
            without = jumped(pad, part, missing, seed)
        assert [step.wrong_unflagged for step in with_anchors] == [step.wrong_unflagged for step in without]


@pytest.mark.parametrize("missing", [0.0, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("pad", ["35", "63"])
def test_a_whole_pad_in_view_is_never_wrong_after_a_jump_of_one_pitch(pad, missing):
    """Where the pad ends in view, a line of dots in the wrong place shows."""
    assert sum(step.wrong_unflagged for seed in range(4) for step in jumped(pad, "whole", missing, seed)) == 0


def test_a_gel_that_is_dragged_in_one_place_keeps_the_markers_that_rest():
    """The rest is anchored; where dots lie between places of rest, the gel is deformed and has not jumped."""
    bench = Bench("lk")
    weight = bump(bench.rest, 55.0)
    bench.move(0 * weight)
    kept = []
    for number in range(1, 9):
        angle = 0.9 * number
        kept.append(bench.move(26.0 * weight * [np.cos(angle), np.sin(angle)]).kept)
        assert bench.at
    assert min(kept) > 0.6 * len(bench.rest)


def test_dots_a_whole_pitch_away_are_no_sign_of_a_deformed_gel():
    """Half of the pad one pitch off and the rest at home: nothing lies between the places of rest."""
    pad = Bench("lk").tracker._lattice
    shown = pad.home_px.copy()
    shown[: pad.count // 2, 0] += pad.pitch_px
    best = association._Hypothesis(0.0, 0, np.arange(pad.count), shown)
    seen = association._Seen(np.arange(pad.count), pad.extend(pad.home_px), shown, pad, pad.home_px, None)
    assert not association._anchored(best, seen).any()
