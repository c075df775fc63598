"""Faults of tracker, detector, estimator and controller: each is a function of what `update` returned."""

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

Change = Callable[[Any, "Told"], Any]


class Told(Around):
    """A brain whose answers are changed while the fault is on; `earlier` are its last true answers."""

    def __init__(self, part: Any, plan: Plan, change: Change) -> None:
        super().__init__(part, plan)
        self.plan = plan
        self.earlier: deque[Any] = deque(maxlen=32)
        self._change = change

    def update(self, *given: Any) -> Any:
        """Return the answer to an input, changed while the fault is on."""
        answer = self._part.update(*given)
        self.earlier.append(answer)
        return self._change(answer, self) if self.plan.on else answer

    def reset(self) -> None:
        """Forget the past."""
        self._part.reset()
        self.earlier.clear()
        self.plan.restart()


def _raises(answer: Any, told: Told) -> Any:
    raise ZeroDivisionError("float division by zero")


def _late(answer: Any, told: Told) -> Any:
    return told.earlier[max(0, len(told.earlier) - 1 - round(told.plan.level))]


def _constant(value: Any) -> Change:
    return lambda answer, told: value


def _tracker_nan(tracks: MarkerTracks, told: Told) -> MarkerTracks:
    return replace(tracks, xy_px=np.full_like(tracks.xy_px, np.nan))


def _tracker_loses(tracks: MarkerTracks, told: Told) -> MarkerTracks:
    lost = told.plan.rng.random(len(tracks.valid)) < told.plan.level
    flags = np.where(lost, 1, tracks.flags).astype(np.uint8)
    return replace(tracks, xy_px=np.where(lost[:, None], np.nan, tracks.xy_px), valid=tracks.valid & ~lost, flags=flags)


def _tracker_wrong(tracks: MarkerTracks, told: Told) -> MarkerTracks:
    return replace(tracks, xy_px=tracks.xy_px[::2], valid=tracks.valid[::2], flags=tracks.flags[::2])


def _detector_nan(detection: Detection, told: Told) -> Detection:
    return Detection(detection.slip, math.nan, math.nan, math.nan)


def _detector_silent(detection: Detection, told: Told) -> Detection:
    return Detection(False, 0.0, detection.threshold, 1.0)


def _detector_alarms(detection: Detection, told: Told) -> Detection:
    return Detection(True, 2 * detection.threshold, detection.threshold, 1.0) if told.plan.happens() else detection


def _estimator_nan(estimate: SlipEstimate, told: Told) -> SlipEstimate:
    nan = math.nan
    return SlipEstimate((nan, nan), (nan, nan), nan, nan, nan, nan)


def _estimator_scale(estimate: SlipEstimate, told: Told) -> SlipEstimate:
    level = told.plan.level
    x, y = estimate.velocity_m_s
    return replace(
        estimate,
        velocity_m_s=(level * x, level * y),
        angular_rad_s=level * estimate.angular_rad_s,
        speed_m_s=level * estimate.speed_m_s,
    )


tracker_raises = fault(partial(Told, change=_raises), "brains:tracker_raises")
tracker_nan = fault(partial(Told, change=_tracker_nan), "brains:tracker_nan")
tracker_loses = fault(partial(Told, change=_tracker_loses), "brains:tracker_loses")
tracker_wrong = fault(partial(Told, change=_tracker_wrong), "brains:tracker_wrong")
detector_raises = fault(partial(Told, change=_raises), "brains:detector_raises")
detector_none = fault(partial(Told, change=_constant(None)), "brains:detector_none")
detector_nan = fault(partial(Told, change=_detector_nan), "brains:detector_nan")
detector_late = fault(partial(Told, change=_late), "brains:detector_late")
detector_silent = fault(partial(Told, change=_detector_silent), "brains:detector_silent")
detector_alarms = fault(partial(Told, change=_detector_alarms), "brains:detector_alarms")
estimator_raises = fault(partial(Told, change=_raises), "brains:estimator_raises")
estimator_wrong = fault(partial(Told, change=_constant([0.0, 0.0])), "brains:estimator_wrong")
estimator_nan = fault(partial(Told, change=_estimator_nan), "brains:estimator_nan")
estimator_late = fault(partial(Told, change=_late), "brains:estimator_late")
estimator_scale = fault(partial(Told, change=_estimator_scale), "brains:estimator_scale")
controller_raises = fault(partial(Told, change=_raises), "brains:controller_raises")
controller_wrong = fault(partial(Told, change=_constant("closer")), "brains:controller_wrong")
controller_nan = fault(partial(Told, change=_constant(math.nan)), "brains:controller_nan")
controller_late = fault(partial(Told, change=_late), "brains:controller_late")
