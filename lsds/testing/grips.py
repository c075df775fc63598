"""Inputs of a controller: sound ones of a grip that slips and rests, and ones that lack something."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

from lsds.contracts import ABSTAINED, Detection, FingerCycle, Frame, GripInput, SlipEstimate
from lsds.testing.stimulus import FRAME_NS, Name, cycles

TOUCH_M, HELD_M, STROKE_M = 0.030, 0.0285, 0.05
"""Aperture at touch, the one held, and the gripper's stroke."""
ABSTAINS = Detection(None, math.nan, 0.5, 0.0)
QUIET, SLIPS = Detection(False, 0.1, 0.5, 0.8), Detection(True, 0.9, 0.5, 0.8)
AT_REST = SlipEstimate((0.0, 0.0), (1e-3, 1e-3), 0.0, 0.05, 0.0, 1e-3)
SLIDES = SlipEstimate((0.0, 8e-3), (1e-3, 1e-3), 0.1, 0.05, 8e-3, 1e-3)
NAN_ESTIMATE = SlipEstimate((math.nan,) * 2, (math.nan,) * 2, math.nan, math.nan, math.nan, math.nan)
NOT_MEASURED = "no aperture is measured"
RESTS = 30
"""Frames at the end of a sequence in which the grip is at rest."""


@cache
def grip_inputs(name: Name) -> tuple[GripInput, ...]:
    """Return the inputs of a sequence: contact, slip, and then a grip at rest for a time."""
    seen = list(cycles(name))
    seen += [_later(seen[8], len(seen) + i) for i in range(RESTS)]
    return tuple(_input(cycle, i, slips=name != "untouched" and 10 <= i < 20) for i, cycle in enumerate(seen))


def sound_grips(name: Name) -> tuple[GripInput, ...]:
    """Return two seconds of inputs that follow `grip_inputs(name)`: the grip goes on resting."""
    return tuple(_at(grip_inputs(name)[-1], i) for i in range(1, 51))


@cache
def degraded_grips(name: Name) -> dict[str, tuple[GripInput, ...]]:
    """Return inputs that follow `grip_inputs(name)`, each lasting for two seconds, by what is wrong with them."""
    last = grip_inputs(name)[-1]
    lacking = {
        "the detection abstains": replace(last, detection=ABSTAINS, estimate=ABSTAINED),
        "the detection abstains and the estimate is NaN": replace(last, detection=ABSTAINS, estimate=NAN_ESTIMATE),
        "the detection abstains and the estimate is at rest": replace(last, detection=ABSTAINS, estimate=AT_REST),
        "slip is detected and the estimate abstains": replace(last, detection=SLIPS, estimate=ABSTAINED),
        "slip is detected and the estimate is NaN": replace(last, detection=SLIPS, estimate=NAN_ESTIMATE),
        "no finger has seen anything": replace(last, fingers=(), detection=ABSTAINS, estimate=ABSTAINED),
        NOT_MEASURED: replace(last, measured_aperture_m=math.nan, frame_aperture_m=math.nan),
        "the frame interval is NaN": replace(last, dt_s=math.nan),
        "the touch is not known and the detection abstains": replace(
            last, touch_m=math.nan, detection=ABSTAINS, estimate=ABSTAINED
        ),
    }
    series = {what: tuple(_at(state, i) for i in range(1, 51)) for what, state in lacking.items()}
    return {**series, "the same frame comes again and again": (replace(last, dt_s=0.0),) * 50}


def _input(cycle: FingerCycle, i: int, *, slips: bool) -> GripInput:
    estimate = SLIDES if slips else AT_REST
    detection = SLIPS if slips else QUIET
    return GripInput(
        cycle.observation.t_ns,
        FRAME_NS * 1e-9 if i else math.nan,
        detection,
        estimate,
        aperture_m=HELD_M,
        measured_aperture_m=HELD_M,
        fingers=(replace(cycle, detection=detection, estimate=estimate),),
        touch_m=TOUCH_M,
        frame_aperture_m=HELD_M,
        resolution_m=2e-4,
    )


def _at(state: GripInput, i: int) -> GripInput:
    fingers = tuple(
        replace(_moved(finger, state.t_ns + i * FRAME_NS), detection=state.detection, estimate=state.estimate)
        for finger in state.fingers
    )
    return replace(state, t_ns=state.t_ns + i * FRAME_NS, fingers=fingers)


def _later(cycle: FingerCycle, i: int) -> FingerCycle:
    return _moved(cycle, (i + 1) * FRAME_NS)


def _moved(cycle: FingerCycle, t_ns: int) -> FingerCycle:
    seq = t_ns // FRAME_NS - 1
    tracks = replace(cycle.tracks, t_ns=t_ns, seq=seq)
    frame = Frame(cycle.frame.image, t_ns, seq)
    observation = replace(cycle.observation, t_ns=t_ns, seq=seq, frame=frame)
    return replace(cycle, frame=frame, tracks=tracks, observation=observation)
