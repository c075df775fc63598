"""The header of a recording: what one has to know about the rig in order to run it again."""

from __future__ import annotations

import json
import platform
from dataclasses import dataclass, field
from importlib import metadata
from typing import TYPE_CHECKING

import cv2

from lsds.clock import utc_s
from lsds.config.dump import dump_config
from lsds.contracts import ArmSpec, GripperSpec, SensorSpec
from lsds.errors import DataError
from lsds.registry.backends import OWN_DISTRIBUTION, prefix_of
from lsds.session.recording.codec import from_json, to_json

if TYPE_CHECKING:
    from lsds.runtime.rig import Rig

FORMAT = 1
"""Version of the recordings that this version writes; it reads all versions up to it."""
NAME = "lsds"
"""Name of the metadata record that holds the header."""
SUMMARY = "lsds.summary"
"""Name of the metadata record at the end of the file that holds the summary of the run."""


@dataclass(frozen=True, slots=True)
class RecordedFinger:
    """A finger of the recorded rig."""

    name: str
    opposite: bool
    spec: SensorSpec


@dataclass(frozen=True, slots=True)
class RecordingHeader:
    """`config` is the rig's configuration as TOML; `live`: frames came from a running cell, not from a video;
    `started_ns` is the rig's clock at `started_utc_s`, seconds since 1970."""

    lsds: str
    config: str
    fingers: tuple[RecordedFinger, ...]
    gripper: GripperSpec | None
    arm: ArmSpec | None
    simulated: bool
    live: bool
    started_ns: int
    started_utc_s: float
    versions: dict[str, str] = field(default_factory=dict)
    format: int = FORMAT

    @classmethod
    def of(cls, rig: Rig) -> RecordingHeader:
        """Return the header for a run of a rig that is connected."""
        fingers = tuple(RecordedFinger(own.name, own.opposite, own.sensor.spec) for own in rig.fingers)
        versions = {"python": platform.python_version(), "opencv": cv2.__version__}
        for name in sorted({backend.distribution for backend in rig.backends.values()} | {"numpy", "onnxruntime"}):
            try:
                versions[prefix_of(name)] = metadata.version(name)
            except metadata.PackageNotFoundError:
                continue
        return cls(
            metadata.version(OWN_DISTRIBUTION),
            dump_config(rig.config),
            fingers,
            None if rig.gripper is None else rig.gripper.spec,
            None if rig.arm is None else rig.arm.spec,
            rig.own_cell is not None,
            not rig.is_recording,
            rig.clock.now(),
            utc_s(),
            versions,
        )

    def as_metadata(self) -> dict[str, str]:
        """Return the header as the text values of a metadata record."""
        return {name: json.dumps(to_json(getattr(self, name))) for name in type(self).__dataclass_fields__}

    @classmethod
    def from_metadata(cls, values: dict[str, str], where: str) -> RecordingHeader:
        """Return the header in a metadata record. Raises DataError."""
        try:
            parsed = {name: json.loads(text) for name, text in values.items()}
            version = int(parsed["format"])
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{where}: the header of the recording is damaged: {error!r}") from error
        if version > FORMAT:
            raise DataError(
                f"{where}: written by lsds {parsed.get('lsds')} in format {version}; this version reads up to {FORMAT} "
                "(install a newer lsds)"
            )
        found: RecordingHeader = from_json(cls, parsed, f"{where}: header")
        return found
