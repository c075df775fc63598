"""One simulated trial, in every frame of which detectors and estimators are asked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from lsds_research.collecting.campaign import PRESETS
from lsds_research.collecting.drive import run_trial

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import LsdsError
from lsds.registry.host import PluginHost
from lsds.session.track import UNASKED

if TYPE_CHECKING:
    from lsds_research.collecting.trials import Trial
    from numpy.typing import NDArray

    from lsds.contracts import Cycle

    Floats = NDArray[np.float64]

SETTINGS = (*PRESETS["loads"], *UNASKED)


@dataclass(frozen=True, slots=True, eq=False)
class AskedTrial:
    """A trial of n frames: `slip` (n,) truly slips or not, `velocity` (n, 3) truly (m/s, m/s, rad/s).

    `said` (n,) by detector is 1, 0, or NaN where it abstains; `told` (n, 6) by estimator: x, y, turn, and standard
    deviations of speed and turn, NaN where it abstains, and the speed.
    """

    object: str
    protocol: str
    recording: str
    slip: Floats
    velocity: Floats
    said: dict[str, Floats]
    told: dict[str, Floats]


def ask(trial: Trial, detectors: Sequence[str], estimators: Sequence[str]) -> AskedTrial | str:
    """Run a trial; return what was said, or why it failed."""
    host, context = PluginHost(), BuildContext(VirtualClock(), trial.seed)
    built = {name: host.build("detector", name, {}, context) for name in detectors}
    speeds = {name: host.build("estimator", name, {}, context) for name in estimators}
    said: dict[str, list[float]] = {name: [] for name in detectors}
    told: dict[str, list[tuple[float, ...]]] = {name: [] for name in estimators}

    def take(cycle: Cycle) -> None:
        for name, detector in built.items():
            slip = detector.update(cycle.observation).slip
            said[name].append(math.nan if slip is None else float(slip))
        for name, estimator in speeds.items():
            own = estimator.update(cycle.observation)
            row = (*own.velocity_m_s, own.angular_rad_s, own.speed_std_m_s, own.angular_std_rad_s, own.speed_m_s)
            told[name].append((math.nan,) * len(row) if own.abstained else row)

    try:
        columns = run_trial(trial, None, SETTINGS, take)
    except LsdsError as error:
        return f"{trial.recording}: {error}"
    velocity = np.stack([columns[name] for name in ("velocity_x", "velocity_y", "angular_velocity_label")], axis=1)
    return AskedTrial(
        trial.object,
        trial.protocol,
        trial.recording,
        columns["slip"].astype(float),
        velocity.astype(float),
        {name: np.array(rows) for name, rows in said.items()},
        {name: np.array(rows).reshape(-1, 6) for name, rows in told.items()},
    )
