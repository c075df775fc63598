"""The messages of a recording: topics, schemas, and how an event becomes messages.

Inputs are what `lsds replay` runs again; outputs are what it compares. Messages whose schema begins with "foxglove."
are protobuf of well-known types, for viewers; all others are JSON of the contracts' types.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, NamedTuple

from lsds.contracts import (
    ArmState,
    CellTruth,
    ContactLoad,
    Cycle,
    Detection,
    GripperState,
    SlipEstimate,
)
from lsds.contracts.events import (
    ArmRead,
    Corrected,
    FramesRead,
    GripperRead,
    JobStepped,
    PosesRead,
    TruthKnown,
)
from lsds.session.recording.codec import schema_of, to_json

if TYPE_CHECKING:
    from lsds.contracts import FingerCycle, Frame, GripEstimate
    from lsds.contracts.events import Published

FRAMES, GRIPPER, ARM, POSES, JOB, CORRECTION, TRUTH = (
    "/input/frames",
    "/gripper/state",
    "/arm/state",
    "/poses",
    "/job",
    "/correction",
    "/truth",
)
CYCLE, FUSED_DETECTION, FUSED_ESTIMATE, GRIP = "/cycle", "/detection", "/estimate", "/grip"
IMAGE = "/finger/{}/image"

GRIP_FIELDS = (
    "t_ns",
    "dt_s",
    "bridged",
    "commanded_m",
    "measured_m",
    "aperture_m",
    "touch_m",
    "squeeze_m",
    "load_n",
    "load_n_s",
    "greatest_n",
    "rising_m",
    "stale",
    "normal_n",
    "reach_m",
    "limit_n",
    "limit_std_n",
    "slips",
    "slip_m_s",
    "complete",
)
"""Fields of `GripEstimate` that are recorded in `/grip`; what the fingers show has its own topics."""


@dataclass(frozen=True, slots=True)
class FrameRead:
    """A frame of a poll; its image is the one of the finger with this number."""

    finger: str
    t_ns: int
    seq: int
    redrawn: bool


@dataclass(frozen=True, slots=True)
class Poll:
    """The frames of a poll, without their images."""

    now_ns: int
    depends: bool
    frames: tuple[FrameRead, ...]


SCHEMAS: dict[str, Any] = {
    FRAMES: schema_of(Poll),
    GRIPPER: schema_of(GripperState),
    ARM: schema_of(ArmState),
    POSES: schema_of(PosesRead) | {"title": "Poses"},
    JOB: schema_of(JobStepped) | {"title": "Stepped"},
    CORRECTION: schema_of(Corrected) | {"title": "Correction"},
    TRUTH: schema_of(CellTruth),
    FUSED_DETECTION: schema_of(Detection),
    FUSED_ESTIMATE: schema_of(SlipEstimate),
    "detection": schema_of(Detection),
    "estimate": schema_of(SlipEstimate),
    "load": schema_of(ContactLoad),
}
"""JSON schemas by topic, or by the last part of a finger's topic; others are objects without a stated form."""


class Message(NamedTuple):
    """One message: `t_ns` is the time at which its content was true, `now_ns` that at which it was known.

    `value` is a value of the contracts, or a dictionary of such, of numbers and of arrays.
    """

    topic: str
    value: Any
    now_ns: int
    t_ns: int


class Image(NamedTuple):
    """One image to be compressed, as `Message`."""

    topic: str
    frame: Frame
    finger: str
    now_ns: int


def messages_of(event: Published) -> Iterator[Message | Image]:
    """Yield the messages of an event, images first."""
    if isinstance(event, Cycle):
        yield from _outputs(event)
        return
    now_ns = event.now_ns
    match event:
        case FramesRead(_, frames, depends):
            for finger, frame in frames:
                yield Image(IMAGE.format(finger), frame, finger, now_ns)
            reads = tuple(FrameRead(finger, frame.t_ns, frame.seq, frame.redrawn) for finger, frame in frames)
            yield Message(FRAMES, Poll(now_ns, depends, reads), now_ns, reads[0].t_ns)
        case GripperRead(_, state):
            yield Message(GRIPPER, state, now_ns, state.t_ns)
        case ArmRead(_, arm):
            yield Message(ARM, arm, now_ns, arm.t_ns)
        case PosesRead(_, sample):
            yield Message(POSES, event, now_ns, now_ns if sample is None else sample.t_ns)
        case JobStepped():
            # A wish may be infinite, which only the slow encoder keeps.
            yield Message(JOB, to_json(event), now_ns, now_ns)
        case Corrected():
            yield Message(CORRECTION, event, now_ns, now_ns)
        case TruthKnown(_, truth):
            yield Message(TRUTH, truth, now_ns, truth.t_ns)


def _outputs(cycle: Cycle) -> Iterator[Message]:
    now_ns = cycle.t_ns
    for finger in cycle.fingers:
        for name, value in _finger(finger):
            yield Message(f"/finger/{finger.finger}/{name}", value, now_ns, finger.frame.t_ns)
    t_ns = cycle.frame.t_ns
    yield Message(FUSED_DETECTION, cycle.detection, now_ns, t_ns)
    yield Message(FUSED_ESTIMATE, cycle.estimate, now_ns, t_ns)
    yield Message(GRIP, grip_values(cycle.grip), now_ns, t_ns)
    state = {
        "t_ns": now_ns,
        "stage": cycle.stage,
        "acting": cycle.acting,
        "fingers": [finger.finger for finger in cycle.fingers],
        "command_m": cycle.command_m,
        "held_m": cycle.held_m,
        "measured_m": cycle.measured_m,
        "leads": cycle.leads,
    }
    yield Message(CYCLE, state, now_ns, t_ns)


def grip_values(grip: GripEstimate) -> dict[str, Any]:
    """Return the numbers of a grip."""
    return {name: getattr(grip, name) for name in GRIP_FIELDS}


def _finger(finger: FingerCycle) -> Iterator[tuple[str, Any]]:
    """Yield what was computed from one finger's frame, by the last part of its topic."""
    observation, tracks = finger.observation, finger.tracks
    frame = {"t_ns": observation.t_ns, "seq": observation.seq}
    yield "tracks", {**frame, "xy_px": tracks.xy_px, "flags": tracks.flags}
    if finger.skipped:
        yield "skipped", frame
    field = observation.field
    moved, speed = field.displacement_m, field.velocity_m_s
    yield "field", {**frame, "dt_s": field.dt_s, "displacement_m": moved, "velocity_m_s": speed}
    features = observation.features
    values = dict(zip(features.names, features.values.tolist(), strict=True))
    yield "features", {**frame, "lost_share": observation.lost_share, **values}
    # Only if an algorithm has used it: a recorder must not make the loop compute more.
    imprint = getattr(observation.imprint, "known", None)
    if imprint is not None:
        yield "imprint", {**frame, **{each.name: getattr(imprint, each.name) for each in fields(imprint)}}
    if observation.load is not None:
        yield "load", observation.load
    yield "detection", finger.detection
    yield "estimate", finger.estimate
