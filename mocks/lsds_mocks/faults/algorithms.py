"""Faults of tracker, detector, estimator and controller: each is a function of the value that `update` returned."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from lsds.contracts import Detection, MarkerTracks, SlipEstimate
from lsds_mocks.faults.made import fault
from lsds_mocks.faults.plan import Around, Plan

Change = Callable[[Any, "Altered"], Any]


class Altered(Around):
    """An algorithm whose output the fault changes while it is on; `earlier` holds its last unchanged outputs."""

    def __init__(self, part: Any, plan: Plan, change: Change) -> None:
        super().__init__(part, plan)
        self.plan = plan
        self.earlier: deque[Any] = deque(maxlen=32)
        self._change = change

    def update(self, *given: Any) -> Any:
        """Return the algorithm's output for an input, changed while the fault is on."""
        answer = self._part.update(*given)
        self.earlier.append(answer)
        return self._change(answer, self) if self.plan.on else answer

    def reset(self) -> None:
        """Reset the algorithm, the earlier outputs and the fault's random numbers."""
        self._part.reset()
        self.earlier.clear()
        self.plan.restart()


def _raises(answer: Any, altered: Altered) -> Any:
    raise ZeroDivisionError("float division by zero")


def _late(answer: Any, altered: Altered) -> Any:
    return altered.earlier[max(0, len(altered.earlier) - 1 - round(altered.plan.level))]


def _constant(value: Any) -> Change:
    return lambda answer, altered: value


def _tracker_nan(tracks: MarkerTracks, altered: Altered) -> MarkerTracks:
    return replace(tracks, xy_px=np.full_like(tracks.xy_px, np.nan))


def _tracker_loses(tracks: MarkerTracks, altered: Altered) -> MarkerTracks:
    lost = altered.plan.rng.random(len(tracks.valid)) < altered.plan.level
    flags = np.where(lost, 1, tracks.flags).astype(np.uint8)
    return replace(tracks, xy_px=np.where(lost[:, None], np.nan, tracks.xy_px), valid=tracks.valid & ~lost, flags=flags)


def _tracker_wrong(tracks: MarkerTracks, altered: Altered) -> MarkerTracks:
    return replace(tracks, xy_px=tracks.xy_px[::2], valid=tracks.valid[::2], flags=tracks.flags[::2])


def _detector_nan(detection: Detection, altered: Altered) -> Detection:
    return Detection(detection.slip, math.nan, math.nan, math.nan)


def _detector_silent(detection: Detection, altered: Altered) -> Detection:
    return Detection(False, 0.0, detection.threshold, 1.0)


def _detector_alarms(detection: Detection, altered: Altered) -> Detection:
    return Detection(True, 2 * detection.threshold, detection.threshold, 1.0) if altered.plan.happens() else detection


def _estimator_nan(estimate: SlipEstimate, altered: Altered) -> SlipEstimate:
    nan = math.nan
    return SlipEstimate((nan, nan), (nan, nan), nan, nan, nan, nan)


def _estimator_scale(estimate: SlipEstimate, altered: Altered) -> SlipEstimate:
    level = altered.plan.level
    x, y = estimate.velocity_m_s
    return replace(
        estimate,
        velocity_m_s=(level * x, level * y),
        angular_rad_s=level * estimate.angular_rad_s,
        speed_m_s=level * estimate.speed_m_s,
    )


tracker_raises = fault(partial(Altered, change=_raises), "algorithms:tracker_raises")
tracker_nan = fault(partial(Altered, change=_tracker_nan), "algorithms:tracker_nan")
tracker_loses = fault(partial(Altered, change=_tracker_loses), "algorithms:tracker_loses")
tracker_wrong = fault(partial(Altered, change=_tracker_wrong), "algorithms:tracker_wrong")
detector_raises = fault(partial(Altered, change=_raises), "algorithms:detector_raises")
detector_none = fault(partial(Altered, change=_constant(None)), "algorithms:detector_none")
detector_nan = fault(partial(Altered, change=_detector_nan), "algorithms:detector_nan")
detector_late = fault(partial(Altered, change=_late), "algorithms:detector_late")
detector_silent = fault(partial(Altered, change=_detector_silent), "algorithms:detector_silent")
detector_alarms = fault(partial(Altered, change=_detector_alarms), "algorithms:detector_alarms")
estimator_raises = fault(partial(Altered, change=_raises), "algorithms:estimator_raises")
estimator_wrong = fault(partial(Altered, change=_constant([0.0, 0.0])), "algorithms:estimator_wrong")
estimator_nan = fault(partial(Altered, change=_estimator_nan), "algorithms:estimator_nan")
estimator_late = fault(partial(Altered, change=_late), "algorithms:estimator_late")
estimator_scale = fault(partial(Altered, change=_estimator_scale), "algorithms:estimator_scale")
controller_raises = fault(partial(Altered, change=_raises), "algorithms:controller_raises")
controller_wrong = fault(partial(Altered, change=_constant("closer")), "algorithms:controller_wrong")
controller_nan = fault(partial(Altered, change=_constant(math.nan)), "algorithms:controller_nan")
controller_late = fault(partial(Altered, change=_late), "algorithms:controller_late")
