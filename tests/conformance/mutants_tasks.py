"""Controllers and jobs with one mistake each."""

from __future__ import annotations

import logging
import math
import random
import threading
from dataclasses import replace
from typing import ClassVar

from catching import caught
from honest import HonestController, HonestJob

from lsds.contracts import Grip, Twist
from lsds.testing import algorithms as every
from lsds.testing import corrections, wishes


@caught("controller", corrections.check_never_opens_on_what_is_lacking, "the detection abstains, frame 0: it opens")
class OpensOnAbstention(HonestController):
    def update(self, grip, wanted):
        return grip.commanded_m + 1e-4 if grip.detection.slip is None else super().update(grip, wanted)


@caught("controller", corrections.check_never_opens_on_what_is_lacking, "the estimate abstains, frame 0: it opens")
class OpensWithoutAnEstimate(HonestController):
    def update(self, grip, wanted):
        blind = grip.detection.slip and grip.estimate.abstained
        return grip.commanded_m + 1e-4 if blind else super().update(grip, wanted)


@caught("controller", corrections.check_never_opens_on_what_is_lacking, "no aperture is measured, frame 0: it opens")
class OpensWithoutAMeasuredAperture(HonestController):
    def update(self, grip, wanted):
        return 0.05 if math.isnan(grip.measured_m) else super().update(grip, wanted)


@caught("controller", corrections.check_never_opens_on_what_is_lacking, "again and again, frame 0: it opens")
class OpensOnAStaleFrame(HonestController):
    def update(self, grip, wanted):
        return super().update(grip if grip.dt_s != 0 else replace(grip, dt_s=0.04), wanted)


@caught("controller", corrections.check_apertures_are_sound, "returned nan")
class ReturnsNan(HonestController):
    def update(self, grip, wanted):
        closer_m = 0.1 * grip.estimate.speed_m_s
        return grip.commanded_m - closer_m if grip.detection.slip else super().update(grip, wanted)


@caught("controller", corrections.check_apertures_are_sound, "outside of the stroke")
class ClosesBelowZero(HonestController):
    def update(self, grip, wanted):
        return grip.commanded_m - 10 * 8e-3 if grip.detection.slip else super().update(grip, wanted)


@caught("controller", corrections.check_apertures_are_sound, "nearly closed, frame .*outside of the stroke")
class ClosesAThinObjectBelowZero(HonestController):
    def update(self, grip, wanted):
        return grip.commanded_m - 1e-3 if grip.detection.slip else super().update(grip, wanted)


@caught("controller", corrections.check_opens_only_as_declared, "a slip is intended, frame 0: it opens")
class OpensForASlide(HonestController):
    may_open = False

    def update(self, grip, wanted):
        if wanted.slide is not None:
            return grip.commanded_m + 5e-3
        return None


@caught("controller", corrections.check_limits_force_as_declared, "keep to wanted.fragile_n")
class ClaimsToLimitForce(HonestController):
    limits_force = True


@caught("controller", corrections.check_apertures_are_sound, "outside of the stroke")
class AnswersInTicks(HonestController):
    def update(self, grip, wanted):
        aperture_m = super().update(grip, wanted)
        return None if aperture_m is None else aperture_m / 2e-4


@caught("controller", corrections.check_apertures_are_sound, "not the change of it")
class AnswersInSteps(HonestController):
    def update(self, grip, wanted):
        return 2e-4 if grip.slips > 0.5 else None


@caught("controller", corrections.check_apertures_are_sound, "returned str '28 mm'")
class ReturnsText(HonestController):
    def update(self, grip, wanted):
        return "28 mm"


@caught("controller", corrections.check_apertures_are_sound, "raised IndexError")
class NeedsAFinger(HonestController):
    def update(self, grip, wanted):
        _ = grip.fingers[0]
        return super().update(grip, wanted)


@caught("controller", corrections.check_opens_only_as_declared, "does not declare it")
class OpensUndeclared(HonestController):
    may_open = False


@caught("controller", every.check_reset_equals_a_new_build, "after reset")
class RemembersTheQuietTime(HonestController):
    def reset(self):
        self.quiet_s = getattr(self, "quiet_s", 0.0)

    def update(self, grip, wanted):
        aperture_m = super().update(grip, wanted)
        self.quiet_s = max(self.quiet_s, 0.3)
        return aperture_m


@caught("job", wishes.check_first_step_is_answered, "did not return within")
class NeverEndsItsFirstStep(HonestJob):
    def step(self, now):
        threading.Event().wait(wishes.BOUND_S + 0.5)
        return super().step(now)


@caught("job", wishes.check_first_step_is_answered, "wants Twist")
class MovesAtOnce(HonestJob):
    def step(self, now):
        return replace(super().step(now), twist=Twist((0.0, 0.0, 0.01)))


@caught("job", wishes.check_first_step_is_answered, "first step: step\\(\\) raised ValueError")
class NeedsAGripperState(HonestJob):
    def step(self, now):
        if now.gripper is None:
            raise ValueError("nothing was read")
        return super().step(now)


@caught("job", wishes.check_wants_are_sound, "returned NoneType")
class ReturnsNone(HonestJob):
    def step(self, now):
        return None


@caught("job", wishes.check_wants_are_sound, "not all finite")
class WantsNan(HonestJob):
    speed_m_s = math.nan


@caught("job", wishes.check_wants_are_sound, "done is 'yes'")
class DoneIsText(HonestJob):
    def step(self, now):
        return replace(super().step(now), done="yes")


@caught("job", wishes.check_wants_are_sound, "raised KeyError")
class FailsInTheLift(HonestJob):
    def step(self, now):
        wanted = super().step(now)
        if wanted.stage == "lift":
            raise KeyError("arm")
        return wanted


@caught("job", wishes.check_stages_are_declared, "'lift' is not in stages")
class ForgetsAStage(HonestJob):
    stages = ("reference", "grasp", "done")


@caught("job", wishes.check_wants_are_within_limits, "speed of the twist")
class LiftsInMillimetres(HonestJob):
    speed_m_s = 50.0


@caught("job", wishes.check_wants_are_within_limits, "grip.force_n is 500")
class CrushesTheObject(HonestJob):
    def step(self, now):
        wanted = super().step(now)
        return wanted if wanted.grip is None else replace(wanted, grip=Grip(0.029, 0.05, 500.0))


@caught("job", wishes.check_done_moves_nothing, "end the motion before")
class MovesWhenItIsDone(HonestJob):
    def step(self, now):
        wanted = super().step(now)
        return replace(wanted, twist=Twist((0.0, 0.0, 0.01))) if wanted.done else wanted


@caught("job", every.check_reset_equals_a_new_build, "after begin")
class GoesOnWhereItWas(HonestJob):
    def begin(self, setting):
        self.task, self.since_ns = setting.task, setting.t_ns
        self.stage = self.stage or "reference"


@caught("job", every.check_instances_share_nothing, "next to another one")
class SharesItsStage(HonestJob):
    shared: ClassVar = {}

    def begin(self, setting):
        super().begin(setting)
        self.shared["stage"] = self.stage

    def step(self, now):
        self.stage = self.shared["stage"]
        wanted = super().step(now)
        self.shared["stage"] = self.stage
        return wanted


@caught("controller", every.check_leaves_global_state, "the state of random")
class SeedsRandom(HonestController):
    def reset(self):
        super().reset()
        random.seed(3)


@caught("job", every.check_leaves_global_state, "the level of the root logger")
class TurnsLoggingUp(HonestJob):
    def begin(self, setting):
        super().begin(setting)
        logging.getLogger().setLevel(logging.INFO)


@caught("job", every.check_leaves_global_state, "the handlers of the root logger")
class AddsAHandler(HonestJob):
    def step(self, now):
        logging.getLogger().addHandler(logging.NullHandler())
        return super().step(now)
