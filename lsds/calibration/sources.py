"""Sources of calibration frames: recordings, a rig that moves by itself, or a sensor and a person's hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from lsds.calibration.watched import Phase, WatchedPhase
from lsds.clock import VirtualClock, nanoseconds
from lsds.config.own import own_section
from lsds.contracts import BuildContext
from lsds.errors import ConfigError, ConfigIssue, CutOff, DataError, LsdsError, naming
from lsds.registry import PluginHost
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.session.track import UNASKED, engine_of, only_watching

if TYPE_CHECKING:
    from lsds.config import BackendSection, RigConfig
    from lsds.contracts import Detector

_LOADED = ("take up", "lift", "shake", "lower")
"""Stages of the job `shake` in which the load changes."""
SHAKE: dict[str, object] = {"closer_mm": 2.5, "still_s": 8.0, "shakes": 20}
"""Default options of the job `shake` here: they give some 150 moving and 1200 still frames."""
SLIPPED_M = 1e-4
"""Maximum true slip of the object in the firm grip, m."""
SLID_M = 1e-3
"""Minimum true slip of the object in the usual grip that counts as a slide, m."""


def built(config: RigConfig, names: Sequence[str]) -> dict[str, Detector]:
    """Return the detectors of those names, with the options that the config has for them. Raises PluginError."""
    host, context = PluginHost(), BuildContext(VirtualClock(), config.seed)
    section = config.section("detector")
    options = {name: section.model_copy(update={"backend": name}).options() for name in names}
    return {name: host.build("detector", name, options[name], context) for name in names}


def require_recordings(names: Sequence[str]) -> None:
    """Raise DataError that names all missing recordings: files, folders, patterns."""
    paths = {name: Path(name).expanduser() for name in names}
    missing = [name for name, path in paths.items() if not path.exists() and not any(path.parent.glob(path.name))]
    if missing:
        raise DataError(f"{', '.join(missing)}: no such file or folder; check the path")


def is_real(config: RigConfig) -> bool:
    """Return whether the first sensor is real, neither simulated nor a recording."""
    return not Rig(only_watching(config)).virtual


def watched_recording(
    source: str,
    phase: Phase,
    config: Path | None,
    overrides: Sequence[str],
    detectors: Mapping[str, Detector],
    warn: Callable[[str], object],
) -> WatchedPhase:
    """Watch a recording: a video, a folder of images, or a pattern. Raises DataError that names it.

    Of a recording that is cut off, the frames before the cut are used, and `warn` gets a line about it.
    """
    watched = WatchedPhase(source, phase)
    for detector in detectors.values():
        detector.reset()
    try:
        engine = engine_of(source, config, (*overrides, *UNASKED, "calibration=[]"))
        for cycle in engine:
            watched.take(cycle, detectors, engine.perception.metres_per_px)
    except LsdsError as error:
        if not (isinstance(error, CutOff) and len(watched)):
            raise DataError(naming(source, error)) from error
        warn(f"warning: {naming(source, error)}; the {len(watched)} frames before it are used")
    if not len(watched):
        raise DataError(f"{source}: no usable frame after the reference")
    return watched


def watched_rig(
    config: RigConfig, firm_mm: float | None, detectors: Mapping[str, Detector], say: Callable[[str], object]
) -> list[WatchedPhase]:
    """Run a simulated rig: shake a firmly held object, then lift another with the grip of the config.

    The config's `[job.shake]` sets the motion; the rig grips `firm_mm` closer, if given. The controller is off. A real
    rig is refused: its gripper would open between the two runs, and the object would not be put back.
    Raises ConfigError, DataError if the object slips while it is shaken, and any error that ends a run.
    """
    rig = Rig(config)
    if not rig.virtual or rig.own_cell is None:
        issue = ConfigIssue("gripper.backend", "only a simulated rig moves by itself here", "add --by-hand")
        raise ConfigError("the rig", [issue])
    still, load, slide = WatchedPhase("still", "still"), WatchedPhase("shaken", "load"), WatchedPhase("lifted", "slide")
    by_stage = {"still": still, **dict.fromkeys(_LOADED, load)}
    options = SHAKE | config.section("job").model_copy(update={"backend": "shake"}).options()
    if firm_mm is not None:
        options["closer_mm"] = firm_mm
    closer = f"{options['closer_mm']:g} mm closer than usual"
    say(f"gripping {closer}, holding still, lifting, shaking, setting down")
    if _moved(config, own_section("shake", options), by_stage, detectors, most_m=SLIPPED_M) > SLIPPED_M:
        raise DataError(
            f"gripped {closer}, the object slipped or was not held at all, so no file is written (grip more firmly: a "
            "larger --firm-mm, or job.shake.closer_mm in the config)"
        )
    say("gripping as the config does, and lifting: it should slide")
    slides: dict[str, WatchedPhase] = dict.fromkeys(("take up", "lift", "hold"), slide)
    if _moved(config, own_section("lift"), slides, detectors) < SLID_M:
        say("the object did not slide, so the detected share of slip is unknown: choose a smaller task.first_squeeze_m")
        return [still, load]
    return [still, load, slide]


def _moved(
    config: RigConfig,
    job: BackendSection,
    phases: Mapping[str, WatchedPhase],
    detectors: Mapping[str, Detector],
    most_m: float = math.inf,
) -> float:
    """Run a job, watch its stages, and return the true slip of the object in them, m.

    It is infinite if the object is not in the grip. The run ends at a slip of more than `most_m`.
    """
    slipped_m, begun_m = 0.0, None
    sections = {"job": job}
    open_loop = {"controller": config.section("controller").model_copy(update={"enabled": False})}
    for detector in detectors.values():
        detector.reset()
    with Rig(config.model_copy(update=sections | open_loop)) as rig:
        rig.arm_devices()
        engine = Engine(rig)
        for cycle in engine:
            phase = phases.get(cycle.stage)
            if phase is None or not cycle.leads or rig.own_cell is None:
                continue
            phase.take(cycle, detectors, engine.perception.metres_per_px)
            truth = rig.own_cell.truth()
            begun_m = truth.slip_distance_m if begun_m is None else begun_m
            slipped_m = truth.slip_distance_m - begun_m if truth.normal_force_n > 0 else math.inf
            if slipped_m > most_m:
                break
    return slipped_m


class Part(NamedTuple):
    """A part of a manual calibration: the request to the person, its duration, and its phase (None: a pause)."""

    ask: str
    duration_s: float
    phase: Phase | None


def by_hand(seconds: float) -> tuple[Part, ...]:
    """Return the parts after the untouched gel has been recorded, with about `seconds` for each phase."""
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
    """Watch the sensor while a person moves the object; no device moves. Raises any error that ends the run."""
    watched = {part.phase: WatchedPhase(part.ask, part.phase) for part in parts if part.phase is not None}
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
            if phase is not None and cycle.leads:
                watched[phase].take(cycle, detectors, engine.perception.metres_per_px)
    return [each for each in watched.values() if len(each)]
