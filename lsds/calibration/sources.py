"""Where frames to calibrate on come from: recordings, a rig that moves by itself, or a sensor and a person's hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from lsds.calibration.watched import Phase, WatchedPhase
from lsds.clock import VirtualClock, nanoseconds
from lsds.contracts import BuildContext
from lsds.engine import Engine
from lsds.errors import ConfigError, ConfigIssue, DataError, LsdsError, naming
from lsds.plugins import PluginHost
from lsds.rig import Rig
from lsds.tracking import UNASKED, engine_of, only_watching

if TYPE_CHECKING:
    from lsds.config import RigConfig
    from lsds.contracts import Detector

_LOADED = ("lift", "shake", "lower")
"""Stages of the job `shake` in which the load changes."""


def built(config: RigConfig, names: Sequence[str]) -> dict[str, Detector]:
    """Return the detectors of those names, with the options that the config has for them. Raises PluginError."""
    host, context = PluginHost(), BuildContext(VirtualClock(), config.seed)
    section = config.section("detector")
    options = {name: section.model_copy(update={"backend": name}).options() for name in names}
    return {name: host.build("detector", name, options[name], context) for name in names}


def watched_recording(
    source: str, phase: Phase, config: Path | None, overrides: Sequence[str], detectors: Mapping[str, Detector]
) -> WatchedPhase:
    """Watch a recording: a video, a folder of images, or a pattern. Raises DataError that names it."""
    told = WatchedPhase(source, phase)
    for detector in detectors.values():
        detector.reset()
    try:
        engine = engine_of(source, config, (*overrides, *UNASKED))
        for cycle in engine:
            told.take(cycle, detectors, engine.perception.metres_per_px)
    except LsdsError as error:
        raise DataError(naming(source, error)) from error
    if not len(told):
        raise DataError(f"{source}: no usable frame after the reference")
    return told


def watched_rig(
    config: RigConfig, firm_mm: float, detectors: Mapping[str, Detector], say: Callable[[str], object]
) -> list[WatchedPhase]:
    """Let a simulated rig move by itself: shake a firmly held object, then lift another as its config grips it.

    It grips `firm_mm` closer while it shakes. The controller is off. A real rig is refused: between the two runs its
    gripper would have to open, and nobody would have put the object back. Raises ConfigError, and what ends a run.
    """
    if not Rig(config).virtual:
        issue = ConfigIssue("gripper.backend", "only a simulated rig moves by itself here", "add --by-hand")
        raise ConfigError("the rig", [issue])
    still, load, slide = WatchedPhase("still", "still"), WatchedPhase("shaken", "load"), WatchedPhase("lifted", "slide")
    by_stage = {"still": still, **dict.fromkeys(_LOADED, load)}
    say(f"gripping {firm_mm:g} mm closer than usual, holding still, lifting, shaking, setting down")
    _moved(config, {"backend": "shake", "shake": {"closer_mm": firm_mm}}, by_stage, detectors)
    say("gripping as the config does, and lifting: it should slide")
    _moved(config, {"backend": "lift"}, {"lift": slide, "hold": slide}, detectors)
    return [each for each in (still, load, slide) if len(each)]


def _moved(
    config: RigConfig, job: dict[str, object], phases: Mapping[str, WatchedPhase], detectors: Mapping[str, Detector]
) -> None:
    sections = {"job": type(config.section("job")).model_validate(job)}
    open_loop = {"controller": config.section("controller").model_copy(update={"enabled": False})}
    for detector in detectors.values():
        detector.reset()
    with Rig(config.model_copy(update=sections | open_loop)) as rig:
        rig.arm_devices()
        engine = Engine(rig)
        for cycle in engine:
            phase = phases.get(cycle.stage)
            if phase is not None and cycle.leads:
                phase.take(cycle, detectors, engine.perception.metres_per_px)


class Part(NamedTuple):
    """A part of what a person does: what is asked for, for how long, and what it shows (None: a pause)."""

    ask: str
    duration_s: float
    phase: Phase | None


def by_hand(seconds: float) -> tuple[Part, ...]:
    """Return what a person is asked to do, about `seconds` for each phase, once the untouched gel was seen."""
    return (
        Part("put the object into the grip and close it firmly", 15.0, None),
        Part("hold it still", seconds, "still"),
        Part("wriggle it: pull, push, twist, lift, without letting it slide", 2.0, None),
        Part("wriggle it", 2 * seconds, "load"),
        Part("now pull it slowly through the grip, several times", 3.0, None),
        Part("pull", seconds, "slide"),
    )


def watched_hand(
    config: RigConfig, parts: Sequence[Part], detectors: Mapping[str, Detector], say: Callable[[str], object]
) -> list[WatchedPhase]:
    """Watch the sensor while a person moves the object; no device moves. Raises what ends the run."""
    told = {part.phase: WatchedPhase(part.ask, part.phase) for part in parts if part.phase is not None}
    for detector in detectors.values():
        detector.reset()
    with Rig(only_watching(config)) as rig:
        rig.arm_devices()
        engine = Engine(rig)
        say("do not touch the gel")
        left, ends_ns = list(parts), None
        for cycle in engine:
            if ends_ns is None or cycle.t_ns >= ends_ns:
                if ends_ns is not None:
                    del left[0]
                if not left:
                    break
                say(f"{left[0].ask} ({left[0].duration_s:g} s)")
                ends_ns = cycle.t_ns + nanoseconds(left[0].duration_s)
            phase = left[0].phase
            if phase is not None:
                told[phase].take(cycle, detectors, engine.perception.metres_per_px)
    return [each for each in told.values() if len(each)]
