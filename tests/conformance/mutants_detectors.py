"""Detectors with one mistake each."""

from __future__ import annotations

import datetime
import logging
import math
import os
import random
import socket
import threading
import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from catching import caught
from honest import HonestDetector, speed_of

from lsds.contracts import Detection
from lsds.testing import algorithms as every
from lsds.testing import slip_answers


class Blurred(HonestDetector):
    """An honest detector, to whose score `extra` is added."""

    def update(self, observation):
        found = super().update(observation)
        return replace(found, score=found.score + self.extra(observation))


@caught("detector", slip_answers.check_detections_are_sound, "report slip above the threshold, and none below")
class DecidesAgainstItsScore(HonestDetector):
    def update(self, observation):
        found = super().update(observation)
        return found if found.slip is None else replace(found, slip=not found.slip)


@caught("detector", slip_answers.check_detector_survives_what_is_lacking, "discard NaN before it reaches")
class SmoothsNanForEver(HonestDetector):
    def reset(self):
        super().reset()
        self.smooth = 0.0

    def update(self, observation):
        # The features of a first frame lack their velocities only.
        known = observation.features.values[np.isfinite(observation.features.values)]
        self.smooth = 0.7 * self.smooth + 0.3 * (float(known.mean()) if len(known) else math.nan)
        found = super().update(observation)
        return found if math.isfinite(self.smooth) else Detection(None, math.nan, 4e-3, 0.0)


@caught("detector", every.check_reset_equals_a_new_build, "after reset")
class KeepsStateOverReset(HonestDetector):
    def reset(self):
        self.last = getattr(self, "last", 0.0)


@caught("detector", every.check_is_deterministic, "two builds answer the same inputs differently")
class UsesGlobalRandomNumbers(Blurred):
    def extra(self, observation):
        return 1e-4 * np.random.random()  # noqa: NPY002


@caught("detector", every.check_is_deterministic, "two builds answer the same inputs differently")
class UsesAnUnseededGenerator(Blurred):
    def extra(self, observation):
        return 1e-4 * np.random.default_rng().random()


@caught("detector", every.check_is_deterministic, "two builds answer the same inputs differently")
class UsesTheClockOfTheRig(Blurred):
    def extra(self, observation):
        return 1e-20 * self.context.clock.now()


@caught("detector", every.check_leaves_global_state, "random state")
class SeedsTheGlobalGenerator(Blurred):
    def extra(self, observation):
        np.random.seed(1)  # noqa: NPY002
        return 0.0


@caught("detector", every.check_leaves_global_state, "the state of random")
class DrawsFromRandom(Blurred):
    def extra(self, observation):
        return 0.0 * random.random()


@caught("detector", every.check_leaves_global_state, "error state")
class SilencesNumpy(Blurred):
    def extra(self, observation):
        np.seterr(invalid="ignore")
        return 0.0


@caught("detector", every.check_leaves_global_state, "numpy's global random state")
class DrawsFromNumpy(Blurred):
    def extra(self, observation):
        return 0.0 * np.random.random()  # noqa: NPY002


@caught("detector", every.check_leaves_global_state, "numpy's global random state")
class SeedsOnReset(HonestDetector):
    def __init__(self, options, context):
        self.last = 0.0

    def reset(self):
        super().reset()
        np.random.seed(1)  # noqa: NPY002


@caught("detector", every.check_leaves_global_state, "the level of the root logger")
class SetsTheLevelOfTheRootLogger(Blurred):
    def extra(self, observation):
        logging.getLogger().setLevel(logging.DEBUG)
        return 0.0


@caught("detector", every.check_leaves_global_state, "the handlers of the root logger")
class ConfiguresLogging(Blurred):
    def extra(self, observation):
        logging.basicConfig()
        return 0.0


@caught("detector", every.check_leaves_global_state, "the filters of the root logger")
class FiltersTheRootLogger(Blurred):
    def extra(self, observation):
        logging.getLogger().addFilter(logging.Filter("mutant"))
        return 0.0


@caught("detector", every.check_leaves_global_state, "the level below which logging is disabled")
class DisablesLogging(Blurred):
    def extra(self, observation):
        logging.disable(logging.WARNING)
        return 0.0


@caught("detector", every.check_leaves_global_state, "environment")
class SetsTheEnvironment(Blurred):
    def extra(self, observation):
        os.environ["LSDS_MUTANT"] = "1"
        return 0.0


@caught("detector", every.check_leaves_global_state, "started <Thread")
class StartsAThread(Blurred):
    def extra(self, observation):
        threading.Thread(target=threading.Event().wait, args=(0.5,), daemon=True).start()
        return 0.0


@caught("detector", every.check_answering_reads_no_clock, r"reads a clock: time\.time ")
class LooksAtTheWallClock(Blurred):
    def extra(self, observation):
        return 1e-3 if time.time() < 0 else 0.0


@caught("detector", every.check_answering_reads_no_clock, r"reads a clock: datetime\.now")
class LooksAtTheDate(Blurred):
    def extra(self, observation):
        return 1e-3 if datetime.datetime.now().year < 1990 else 0.0


@caught("detector", every.check_leaves_its_inputs, "it modified")
class ModifiesItsInput(HonestDetector):
    def update(self, observation):
        found = super().update(observation)
        np.nan_to_num(observation.features.values, copy=False)
        return found


@caught("detector", every.check_answers_in_time, "the median answer takes")
class Sleeps(Blurred):
    def extra(self, observation):
        time.sleep(0.045)
        return 0.0


@caught("detector", every.check_answering_does_no_io, "answering accessed open")
class OpensAFile(Blurred):
    def extra(self, observation):
        with open(os.devnull):
            return 0.0


@caught("detector", every.check_answering_does_no_io, r"answering accessed socket\.")
class OpensASocket(Blurred):
    def extra(self, observation):
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close()
        return 0.0


@caught("detector", every.check_instances_share_nothing, "next to another one")
class SharesStateInItsClass(HonestDetector):
    seen: ClassVar = [0.0]

    def reset(self):
        self.seen[0] = 0.0

    def update(self, observation):
        speed = speed_of(observation)
        if math.isnan(speed):
            return Detection(None, math.nan, 4e-3, 0.0)
        score, self.seen[0] = max(speed, self.seen[0]), speed
        return Detection(score > 4e-3, score, 4e-3, 0.5)


@dataclass(frozen=True)
class Open(Detection):
    """A detection that can be changed."""


@caught("detector", every.check_answers_do_not_change_later, "changed after it was returned")
class ReturnsOneObjectAgain(HonestDetector):
    def update(self, observation):
        found = super().update(observation)
        self.answer = getattr(self, "answer", Open(None, math.nan, 4e-3, 0.0))
        object.__setattr__(self.answer, "score", found.score)
        object.__setattr__(self.answer, "slip", found.slip)
        return self.answer


@caught("detector", slip_answers.check_detector_survives_what_is_lacking, "raised ValueError")
class RaisesOnNan(HonestDetector):
    def update(self, observation):
        if observation.seq > 0 and not np.isfinite(observation.features.values).any():
            raise ValueError("NaN")
        return super().update(observation)


@caught("detector", slip_answers.check_detector_survives_what_is_lacking, "the frame after it: .* score of nan")
class KeepsNan(HonestDetector):
    def update(self, observation):
        speed = speed_of(observation)
        self.last = 0.5 * self.last + 0.5 * (0.0 if observation.seq == 0 else speed)
        if math.isnan(speed):
            return Detection(None, math.nan, 4e-3, 0.0)
        return Detection(self.last > 4e-3, self.last, 4e-3, 0.5)


@caught("detector", slip_answers.check_detections_are_sound, "confidence is nan")
class NanConfidence(HonestDetector):
    def update(self, observation):
        return replace(super().update(observation), confidence=math.nan)


@caught("detector", slip_answers.check_detections_are_sound, "confidence is 2")
class ConfidenceOfTwo(HonestDetector):
    def update(self, observation):
        return replace(super().update(observation), confidence=2.0)


@caught("detector", slip_answers.check_detections_are_sound, "score of nan")
class DecidesWithoutAScore(HonestDetector):
    def update(self, observation):
        return replace(super().update(observation), slip=False, score=math.nan)


@caught("detector", slip_answers.check_detections_are_sound, "returned str 'slip'")
class ReturnsText(HonestDetector):
    def update(self, observation):
        return "slip"


@caught("detector", slip_answers.check_detections_are_sound, "slip is 1;")
class ReturnsOneForTrue(HonestDetector):
    def update(self, observation):
        return replace(super().update(observation), slip=1)


@caught("detector", slip_answers.check_detector_claims_no_slip_of_nothing, "reports slip with confidence 0.90")
class SlipOfNothing(HonestDetector):
    def update(self, observation):
        found = super().update(observation)
        return found if found.slip is not None else Detection(True, 1.0, 0.5, 0.9)
