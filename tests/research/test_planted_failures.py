"""`lsds study search` finds mistakes that are planted: a wrong delay, a tracker that is fooled, a guard that opens.

A mistake counts as found if a scenario fails with it in a way in which it does not fail without it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from typing import Any, NamedTuple
from unittest.mock import PropertyMock, patch

import numpy as np
import pytest
from lsds_plugins.controllers.pd import PdController
from lsds_plugins.trackers.dotted import follow
from lsds_plugins.trackers.dotted.association import Association
from lsds_research.search.robustness import Limits, run_scenario

from lsds.cli.main import main
from lsds.safety.guard import Guard

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]
LITTLE = Limits(slip_m=0.03, peak=5.0)
"""The limits of `lsds study search`."""
LONG_TRAVEL = """
"cell.simulated.mass_kg" = [0.2, 1.5]
"cell.simulated.modulus_mpa" = [0.06, 0.2]
"cell.simulated.friction_scale" = [1.0, 1.6]
"cell.simulated.shove_n" = [0.0, 6.0]
"sensor.mock-gelsight-mini.rate_hz" = [10.0, 40.0]
"sensor.mock-gelsight-mini.latency_ms" = [15.0, 40.0]
"task.lift_speed_m_s" = [0.02, 0.1]
"task.lift_acceleration_m_s2" = [0.3, 1.0]
"seed" = [0, 1000]
"""
"""Shoves on soft gels, fast lifts and slow cameras: markers travel by half of their distance between two frames."""
REPEATED = 16
"""Number of failures that are repeated without the mistake."""
OPENS_ON_SLIP = ("controller.backend=pd", "controller.pd.literal_sign=true")


def nearest(predicted_px, dots_px, lattice, trusted_px, hidden=None):
    """Match each marker with the nearest dot, as if dots did not repeat every pitch."""
    count = len(predicted_px)
    if not len(dots_px):
        return Association(np.full(count, -1), predicted_px, True, np.zeros(count, bool))
    squared = ((dots_px[None] - predicted_px[:, None]) ** 2).sum(axis=2)
    dot = squared.argmin(axis=1)
    found = squared[np.arange(count), dot] < (0.5 * lattice.pitch_px) ** 2
    at = np.where(found[:, None], dots_px[dot], predicted_px)
    return Association(np.where(found, dot, -1), at, False, np.ones(count, bool))


def without_alias_check() -> AbstractContextManager[Any]:
    return patch.object(follow, "associate", nearest)


def with_a_wrong_sign() -> AbstractContextManager[Any]:
    """Let a controller ask for opening on slip and not declare that it may: the guard has to keep the grip closed."""
    return patch.object(PdController, "may_open", PropertyMock(return_value=False))


def without_opening_rule() -> AbstractContextManager[Any]:
    sound = Guard.gripper

    def gripper(self, command, held_m, *, opens_by_m):
        return sound(self, command, held_m, opens_by_m=math.inf)

    both = ExitStack()
    both.enter_context(with_a_wrong_sign())
    both.enter_context(patch.object(Guard, "gripper", gripper))
    return both


class Planted(NamedTuple):
    """A mistake: how to plant it, the same without it, config keys of the mistake and of both, space, scenarios."""

    mistake: Callable[[], AbstractContextManager[Any]]
    sound: Callable[[], AbstractContextManager[Any]]
    wrong: tuple[str, ...]
    both: tuple[str, ...]
    space: str
    runs: int


PLANTED = {
    "a controller with the wrong delay": Planted(nullcontext, nullcontext, ("grip.answer_s=0.001",), (), "", 96),
    "a tracker without its alias check": Planted(without_alias_check, nullcontext, (), (), LONG_TRAVEL, 48),
    "a guard without the opening rule": Planted(without_opening_rule, with_a_wrong_sign, (), OPENS_ON_SLIP, "", 24),
}


def failures(margins):
    return {way for way, margin in margins.items() if margin < 0}


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_mistake_is_found(name, tmp_path):
    planted = PLANTED[name]
    file, space = tmp_path / "found.json", tmp_path / "space.toml"
    argv = ["study", "search", "--runs", str(planted.runs), "--most", "0", "--no-plot", "--json", str(file)]
    if planted.space:
        space.write_text(planted.space, encoding="utf-8")
        argv += ["--space", str(space)]
    for key in (*planted.both, *planted.wrong):
        argv += ["--with", key]
    with planted.mistake():
        # One process: others would not have the mistake.
        assert main([*argv, "--jobs", "1"]) == 0
    failed = [row for row in json.loads(file.read_text(encoding="utf-8"))["runs"] if row["margin"] < 0]
    with planted.sound():
        assert any(
            failures(row["margins"]) - failures(run_scenario((row["scenario"], LITTLE, planted.both))["margins"])
            for row in failed[:REPEATED]
        )
