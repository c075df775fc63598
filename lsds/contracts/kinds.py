"""Every kind of backend, one entry each: adding a kind is adding an entry here.

The order is the order in which a rig builds its parts: the cell first, as simulated devices live in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

from lsds.contracts.algorithms import Controller, Detector, Estimator, Tracker
from lsds.contracts.command import Command
from lsds.contracts.devices import Arm, Cell, Gripper, PoseSource, TactileSensor
from lsds.contracts.fault import Fault
from lsds.contracts.job import Job
from lsds.contracts.learning import Learner
from lsds.contracts.study import Study
from lsds.contracts.wire import WireMock

Kind = str
"""Name of a kind of backend, a key of `KINDS`."""


@dataclass(frozen=True, slots=True)
class KindSpec:
    """The properties of a kind.

    `contract` is the Protocol of its backends; `purpose` a one-line description. `default` is the backend used if a
    config does not name one; a kind without a default has no section in a config. `optional` kinds may be "none".
    A `device` has a life cycle and is brought up with the rig. `late` kinds are built when first used: a rig is
    complete without one.
    """

    contract: type
    purpose: str
    default: str = ""
    optional: bool = False
    device: bool = False
    late: bool = False


KINDS: MappingProxyType[Kind, KindSpec] = MappingProxyType(
    {
        "cell": KindSpec(Cell, "The plant shared by simulated devices", default="simulated", optional=True),
        "sensor": KindSpec(TactileSensor, "The tactile fingertip", default="mock-gelsight-mini", device=True),
        "gripper": KindSpec(Gripper, "The gripper", default="mock-hand-e", optional=True, device=True),
        "arm": KindSpec(Arm, "The arm", default="mock-ur5e", optional=True, device=True),
        "pose_source": KindSpec(
            PoseSource, "Measures poses of bodies (ground truth)", default="none", optional=True, device=True
        ),
        "tracker": KindSpec(Tracker, "Tracks the markers of the gel from frame to frame", default="lk"),
        "detector": KindSpec(Detector, "Decides whether the object slips", default="fused"),
        "estimator": KindSpec(Estimator, "Estimates the slip velocity", default="fused"),
        "controller": KindSpec(Controller, "Computes an aperture from slip", default="belief"),
        "job": KindSpec(Job, "The task of a run: commands wanted of arm and gripper", default="lift", late=True),
        "fault": KindSpec(Fault, "An injected fault of a part; [[faults]] of a config names it"),
        "wire_mock": KindSpec(WireMock, "A server that speaks a device's protocol; lsds mock runs it"),
        "study": KindSpec(Study, "Measures speed against accuracy; lsds study runs it"),
        "learner": KindSpec(Learner, "Fits a detector or an estimator; lsds learn train runs it"),
        "command": KindSpec(Command, "A command of lsds; its factory names a click.Command, which is not called"),
    }
)

CONFIG_KINDS: tuple[Kind, ...] = tuple(name for name, kind in KINDS.items() if kind.default)
"""Kinds that have a section in a rig's config, in the order in which a rig builds them."""

DEVICE_KINDS: tuple[Kind, ...] = tuple(name for name, kind in KINDS.items() if kind.device)
"""Kinds that have a life cycle, in the order in which they are brought up."""

OPTIONAL_KINDS: frozenset[Kind] = frozenset(name for name, kind in KINDS.items() if kind.optional)
"""Kinds for which a config may say `backend = "none"`."""
