"""Inputs of a controller: sound ones of a grip that slips and rests, and ones that lack something.

The beliefs in them are written down, as an engine would hold them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

from lsds.contracts import ABSTAINED, Detection, FingerCycle, Frame, GripEstimate, GripTask, SlipEstimate
from lsds.testing.stimulus import FRAME_NS, Name, cycles

TOUCH_M = 0.030
"""Aperture at touch, m."""
HELD_M = 0.0285
"""Held aperture, m."""
THIN_M = 4e-4
"""Aperture on a thin object, m."""
FRAGILE_N = 0.5
"""Normal force that a fragile object withstands, N."""
STROKE_M = 0.05
"""Stroke of the gripper, m."""
ABSTAINS = Detection(None, math.nan, 0.5, 0.0)
QUIET, SLIPS = Detection(False, 0.1, 0.5, 0.8), Detection(True, 0.9, 0.5, 0.8)
AT_REST = SlipEstimate((0.0, 0.0), (1e-3, 1e-3), 0.0, 0.05, 0.0, 1e-3)
SLIDES = SlipEstimate((0.0, 8e-3), (1e-3, 1e-3), 0.1, 0.05, 8e-3, 1e-3)
NAN_ESTIMATE = SlipEstimate((math.nan, math.nan), (math.nan, math.nan), math.nan, math.nan, math.nan, math.nan)
NOT_MEASURED = "no aperture is measured"
RESTS = 30
"""Frames at the end of a sequence in which the grip is at rest."""


Given = tuple[GripEstimate, GripTask]
"""The arguments of an update."""
WANTED = GripTask(resolution_m=2e-4)
REQUIRED_M = 1e-3
"""Squeeze that the grips of the kit require at every risk."""


@cache
def grip_inputs(name: Name) -> tuple[Given, ...]:
    """Return the inputs of a sequence: contact, slip, and then a grip at rest for a time."""
    seen = list(cycles(name))
    seen += [_later(seen[8], len(seen) + i) for i in range(RESTS)]
    return tuple((_grip(cycle, i, slips=name != "untouched" and 10 <= i < 20), WANTED) for i, cycle in enumerate(seen))


@cache
def nearly_closed_grips(name: Name) -> tuple[Given, ...]:
    """Return `grip_inputs(name)` of a thin object: the fingers are nearly closed."""
    touch_m = THIN_M + TOUCH_M - HELD_M
    return tuple(
        (replace(grip, commanded_m=THIN_M, measured_m=THIN_M, aperture_m=THIN_M, touch_m=touch_m), wanted)
        for grip, wanted in grip_inputs(name)
    )


@cache
def pressed_grips(name: Name) -> tuple[Given, ...]:
    """Return `grip_inputs(name)` of a fragile object that is pressed by more than it withstands."""
    return tuple(
        (replace(grip, normal_n=4 * FRAGILE_N), replace(wanted, fragile_n=FRAGILE_N))
        for grip, wanted in grip_inputs(name)
    )


def sound_grips(name: Name) -> tuple[Given, ...]:
    """Return two seconds of inputs that follow `grip_inputs(name)`: the grip remains at rest."""
    last = grip_inputs(name)[-1][0]
    return tuple((_at(last, i), WANTED) for i in range(1, 51))


@cache
def degraded_grips(name: Name) -> dict[str, tuple[Given, ...]]:
    """Return inputs that follow `grip_inputs(name)`, each lasting for two seconds, by what is wrong with them."""
    last = grip_inputs(name)[-1][0]
    lacking = {
        "the detection abstains": replace(last, detection=ABSTAINS, estimate=ABSTAINED),
        "the detection abstains and the estimate is NaN": replace(last, detection=ABSTAINS, estimate=NAN_ESTIMATE),
        "the detection abstains and the estimate is at rest": replace(last, detection=ABSTAINS, estimate=AT_REST),
        "slip is detected and the estimate abstains": replace(last, detection=SLIPS, estimate=ABSTAINED, slips=0.9),
        "slip is detected and the estimate is NaN": replace(last, detection=SLIPS, estimate=NAN_ESTIMATE, slips=0.9),
        "no finger has seen anything": replace(last, fingers=(), detection=ABSTAINS, estimate=ABSTAINED),
        NOT_MEASURED: replace(last, measured_m=math.nan, aperture_m=math.nan),
        "the frame interval is NaN": replace(last, dt_s=math.nan),
        "the touch is not known and the detection abstains": replace(
            last, touch_m=math.nan, detection=ABSTAINS, estimate=ABSTAINED
        ),
        "nothing is believed of the grip": GripEstimate(
            t_ns=last.t_ns, dt_s=last.dt_s, commanded_m=last.commanded_m, measured_m=last.measured_m
        ),
    }
    series = {what: tuple((_at(grip, i), WANTED) for i in range(1, 51)) for what, grip in lacking.items()}
    return {**series, "the same frame comes again and again": ((replace(last, dt_s=0.0), WANTED),) * 50}


def _grip(cycle: FingerCycle, i: int, *, slips: bool) -> GripEstimate:
    estimate = SLIDES if slips else AT_REST
    detection = SLIPS if slips else QUIET
    return GripEstimate(
        t_ns=cycle.observation.t_ns,
        dt_s=FRAME_NS * 1e-9 if i else math.nan,
        detection=detection,
        estimate=estimate,
        fingers=(replace(cycle, detection=detection, estimate=estimate),),
        commanded_m=HELD_M,
        measured_m=HELD_M,
        aperture_m=HELD_M,
        touch_m=TOUCH_M,
        squeeze_m=TOUCH_M - HELD_M,
        load_n=0.5,
        load_n_s=0.0,
        greatest_n=0.5,
        stale=False,
        limit_n=0.4 if slips else 0.8,
        limit_std_n=0.1,
        slips=0.9 if slips else 0.02,
        slip_m_s=estimate.speed_m_s,
        required_m=lambda risk, margin, load_n, braking: REQUIRED_M,
        complete=True,
    )


def _at(grip: GripEstimate, i: int) -> GripEstimate:
    fingers = tuple(
        replace(_moved(finger, grip.t_ns + i * FRAME_NS), detection=grip.detection, estimate=grip.estimate)
        for finger in grip.fingers
    )
    return replace(grip, t_ns=grip.t_ns + i * FRAME_NS, fingers=fingers)


def _later(cycle: FingerCycle, i: int) -> FingerCycle:
    return _moved(cycle, (i + 1) * FRAME_NS)


def _moved(cycle: FingerCycle, t_ns: int) -> FingerCycle:
    seq = t_ns // FRAME_NS - 1
    tracks = replace(cycle.tracks, t_ns=t_ns, seq=seq)
    frame = Frame(cycle.frame.image, t_ns, seq)
    observation = replace(cycle.observation, t_ns=t_ns, seq=seq, frame=frame)
    return replace(cycle, frame=frame, tracks=tracks, observation=observation)
