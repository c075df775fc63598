"""Faults with one mistake each."""

from __future__ import annotations

import logging
import threading
from dataclasses import replace

import numpy as np
from catching import LEFT, caught_fault
from honest_faults import DimFault, GoneFault, HonestFault, Late, LateFault, Offset, OffsetFault, Options
from pydantic import Field

from lsds.errors import ConfigError, ConfigIssue
from lsds.testing import fault_traces, faults


@caught_fault(faults.check_afflicts_a_part_of_a_rig, "'camera', which is no part of a rig")
class NamesNoPart(OffsetFault):
    target = "camera"


@caught_fault(faults.check_afflicts_a_part_of_a_rig, "moment is None")
class HasNoMoment(OffsetFault):
    def __init__(self, options, context):
        super().__init__(options, context)
        self.moment = None


@caught_fault(faults.check_afflicts_a_part_of_a_rig, "target and moment were")
class ChangesItsMoment(OffsetFault):
    @property
    def on(self):
        found = super().on
        if found:
            self.moment = "hold"
        return found


@caught_fault(faults.check_every_severity_builds, "severity 5: building it raised IndexError")
class HasFourSeverities(OffsetFault):
    def __init__(self, options, context):
        super().__init__(options, context)
        self.level = (0.1, 0.2, 0.3, 0.4)[options.severity - 1]


class Unlimited(Options):
    severity: int = Field(default=3)


class Limits(OffsetFault):
    OPTIONS = Unlimited


@caught_fault(faults.check_other_severities_are_refused, "severity -1 is accepted")
class TakesAnySeverity(Limits):
    pass


@caught_fault(faults.check_other_severities_are_refused, "severity 0 raised IndexError")
class FailsOnAnUnknownSeverity(Limits):
    def __init__(self, options, context):
        super().__init__(options, context)
        if options.severity in (-1, 6):
            raise ConfigError("fault", [ConfigIssue("severity", "is invalid", "1 to 5")])
        if options.severity == 0:
            raise IndexError("tuple index out of range")


@caught_fault(faults.check_other_severities_are_refused, "refused with 2 problems, of severity, level")
class RefusesTwice(Limits):
    def __init__(self, options, context):
        super().__init__(options, context)
        if not 1 <= options.severity <= 5:
            raise ConfigError("fault", [ConfigIssue("severity", "is invalid"), ConfigIssue("level", "is invalid")])


class ReadsOnly:
    """A gripper that can be read only."""

    def __init__(self, part, fault):
        self.part, self.fault = part, fault
        self.connect, self.arm, self.read = part.connect, part.arm, part.read


@caught_fault(faults.check_part_keeps_its_contract, "the gripper with the fault lacks .*command.*spec")
class LosesTheOtherMembers(OffsetFault):
    wrapper = ReadsOnly


@caught_fault(faults.check_part_keeps_its_contract, r"around\(None\) returned NoneType")
class ReturnsNoObserver(HonestFault):
    target = "observer"

    def around(self, part):
        return part


class OwnSpec(Offset):
    @property
    def spec(self):
        return replace(self.part.spec, stroke_m=0.1) if self.fault.on else self.part.spec


@caught_fault(faults.check_passes_on_what_it_leaves, "after the fault has begun, spec is")
class ChangesTheSpec(OffsetFault):
    wrapper = OwnSpec


class Unstoppable(Offset):
    def stop(self):
        pass


@caught_fault(faults.check_passes_on_what_it_leaves, r"stop\(\) does not reach the part")
class KeepsItFromStopping(OffsetFault):
    wrapper = Unstoppable


@caught_fault(faults.check_nothing_changes_before_its_moment, r"before its moment 'lift'.* read\(\) at")
class BeginsAtOnce(OffsetFault):
    on = True


@caught_fault(faults.check_nothing_changes_before_its_moment, r"before its moment 'lift'.* read\(\) at")
class BeginsWithAnyStage(OffsetFault):
    @property
    def on(self):
        from lsds.contracts.stages import shared_stages

        return bool(shared_stages(self.context).names)


class Slower(Offset):
    def command(self, command):
        self.part.command(replace(command, speed_m_s=0.01))
        return command


@caught_fault(faults.check_nothing_changes_before_its_moment, "before its moment")
class SlowsCommandsFromTheStart(OffsetFault):
    wrapper = Slower


@caught_fault(faults.check_takes_effect, "nothing has changed 1.5 s after its moment 'lift'")
class NeverBegins(OffsetFault):
    on = False


class Small(DimFault.wrapper):
    def read(self):
        frame = self.part.read()
        return replace(frame, image=frame.image[::2, ::2]) if self.fault.on else frame


@caught_fault(faults.check_answers_keep_their_form, r"makes .*shape \(120, 160, 3\).*malformed = True")
class HalvesTheImage(DimFault):
    wrapper = Small


class Bare(DimFault.wrapper):
    def read(self):
        frame = self.part.read()
        return frame.image if self.fault.on else frame


@caught_fault(faults.check_answers_keep_their_form, "makes uint8 array of .*Frame")
class ReturnsTheImage(DimFault):
    wrapper = Bare


class Foreign(GoneFault.wrapper):
    def read(self):
        if self.fault.on:
            raise OSError("no route to host")
        return self.part.read()


@caught_fault(faults.check_answers_keep_their_form, "raised OSError: no route to host; raise an LsdsError")
class RaisesAForeignError(GoneFault):
    wrapper = Foreign


@caught_fault(fault_traces.check_fault_is_deterministic, r"two builds with the same seed differ: read\(\)")
class DrawsWithoutASeed(OffsetFault):
    def restart(self):
        self.rng = np.random.default_rng()


@caught_fault(fault_traces.check_builds_share_nothing, r"next to another one: read\(\)")
class SharesItsStream(OffsetFault):
    running = 0

    def __init__(self, options, context):
        super().__init__(options, context)
        type(self).running = 0

    def around(self, part):
        fault = self

        class Counted(Offset):
            def read(self):
                state = super().read()
                type(fault).running += fault.on
                return replace(state, aperture_m=state.aperture_m + 1e-6 * type(fault).running)

        return Counted(part, self)


class InPlace(DimFault.wrapper):
    def read(self):
        frame = self.part.read()
        if self.fault.on:
            frame.image[:] = frame.image // 2
        return frame


@caught_fault(fault_traces.check_leaves_the_values_of_others, "the fault modified image of the part's answer")
class DarkensInPlace(DimFault):
    wrapper = InPlace


class InputInPlace(Late):
    def update(self, observation):
        if self.fault.on:
            observation.field.velocity_m_s[:] = 0.0
        return self.part.update(observation)


@caught_fault(fault_traces.check_leaves_the_values_of_others, "modified field.velocity_m_s of its input")
class StillsTheFieldInPlace(LateFault):
    wrapper = InputInPlace


@caught_fault(fault_traces.check_fault_leaves_global_state, "numpy's global random state")
class SeedsTheGlobalGenerator(OffsetFault):
    def restart(self):
        super().restart()
        np.random.seed(self.context.seed)  # noqa: NPY002


@caught_fault(fault_traces.check_fault_leaves_global_state, "the handlers of the root logger")
class ConfiguresLogging(OffsetFault):
    def restart(self):
        super().restart()
        logging.basicConfig()


class SeedsAgain(Late):
    def reset(self):
        super().reset()
        np.random.seed(1)  # noqa: NPY002


@caught_fault(fault_traces.check_fault_leaves_global_state, "numpy's global random state")
class SeedsOnReset(LateFault):
    wrapper = SeedsAgain


@caught_fault(fault_traces.check_fault_leaves_global_state, "the fault started .*left-over")
class StartsAThread(OffsetFault):
    def restart(self):
        super().restart()
        end = threading.Event()
        LEFT.append(end.set)
        threading.Thread(target=end.wait, name="left-over", daemon=True).start()


class Remembers(Late):
    def reset(self):
        self.part.reset()
        self.fault.restart()


@caught_fault(fault_traces.check_reset_forgets, r"after a reset the detector .* update\(\)")
class RemembersTheLastAnswer(LateFault):
    wrapper = Remembers


class GoesOnDrawing(Late):
    def reset(self):
        self.part.reset()
        self.last = None


@caught_fault(fault_traces.check_reset_forgets, r"after a reset the detector .* update\(\)")
class ContinuesItsStream(LateFault):
    wrapper = GoesOnDrawing


class Alarms(Late):
    def reset(self):
        self.part.reset()

    def update(self, observation):
        answer = self.part.update(observation)
        happens = self.fault.on and self.fault.rng.random() < self.fault.options.severity / 5
        return replace(answer, slip=True, confidence=1.0) if happens else answer


@caught_fault(fault_traces.check_reset_forgets, r"after a reset the detector .* update\(\)")
class ContinuesAStreamThatTheWorstSeverityHides(LateFault):
    wrapper = Alarms
