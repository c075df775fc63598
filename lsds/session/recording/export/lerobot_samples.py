"""A recording at a constant rate: what was known at each instant, and what was commanded until the next.

Streams of a recording have their own rates, and a dataset has one. Each sample holds the latest values that the engine
knew at its instant, as a policy would have had them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import NS_PER_S
from lsds.errors import DataError
from lsds.session.recording.export.content import parsed
from lsds.session.recording.export.lerobot_features import (
    ACTION,
    FIELD,
    LOAD,
    STATE,
    FingerLayout,
    Layout,
    displacement_key,
    image_key,
    load_key,
)
from lsds.session.recording.messages import ARM, CORRECTION, GRIPPER, IMAGE, JOB

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.session.recording.reader import Raw

Sample = dict[str, Any]
"""A value per feature: (N,) float32, or the bytes of a compressed image."""


def samples(messages: Iterator[Raw], layout: Layout, rate_hz: int, path: Path) -> Iterator[tuple[int, Sample]]:
    """Yield (messages read so far, sample) from the first instant at which every stream has a value.

    The action of a sample is the last command before the next one. Raises DataError for a damaged message.
    """
    latest = _Latest(layout)
    begin_ns, number, read = None, 0, 0
    waiting: Sample | None = None
    for read, raw in enumerate(messages, 1):
        while begin_ns is not None and raw.now_ns > begin_ns + number * NS_PER_S // rate_hz:
            if waiting is not None:
                yield read, waiting | {ACTION: latest.action()}
            waiting = latest.observation()
            number += 1
        try:
            latest.take(raw)
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{path}: a message of {raw.topic} at {raw.now_ns} ns is damaged: {error!r}") from error
        if begin_ns is None and latest.complete():
            begin_ns = raw.now_ns
    if waiting is not None:
        yield read, waiting | {ACTION: latest.action()}


class _Latest:
    """The latest value of each stream. A component that becomes unknown keeps its last known value."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._images: dict[str, Raw] = {}
        self._fields: dict[str, NDArray[np.float64]] = {}
        self._loads: dict[str, NDArray[np.float64]] = {
            finger.name: np.full(3, np.nan) for finger in layout.fingers if finger.load
        }
        self._aperture_m = self._target_m = self._command_m = math.nan
        self._pose = np.full(7 * layout.arm, np.nan)
        self._twist = np.zeros(6 * layout.arm)
        self._takers = {GRIPPER: self._gripper, ARM: self._arm, JOB: self._job, CORRECTION: self._correction}
        self._fingers: dict[str, tuple[FingerLayout, Any]] = {}
        for finger in layout.fingers:
            self._fingers[IMAGE.format(finger.name)] = (finger, self._image)
            self._fingers[FIELD.format(finger.name)] = (finger, self._field)
            self._fingers[LOAD.format(finger.name)] = (finger, self._load)

    def take(self, raw: Raw) -> None:
        """Take in a message. Raises KeyError, TypeError or ValueError for one of another form."""
        if raw.topic in self._takers:
            self._takers[raw.topic](raw.value)
        elif raw.topic in self._fingers:
            finger, taker = self._fingers[raw.topic]
            taker(finger, raw)

    def complete(self) -> bool:
        """Return whether every stream has a value."""
        fingers = self._layout.fingers
        numbers = [np.array([self._aperture_m]), self._pose, *self._loads.values()]
        return all(finger.name in self._images and finger.name in self._fields for finger in fingers) and all(
            np.isfinite(each).all() for each in numbers
        )

    def observation(self) -> Sample:
        """Return the values of all observations."""
        found: Sample = {image_key(name): parsed(raw).data for name, raw in self._images.items()}
        found[STATE] = np.array([self._aperture_m, *self._pose], np.float32)
        found |= {displacement_key(name): each.astype(np.float32) for name, each in self._fields.items()}
        return found | {load_key(name): each.astype(np.float32) for name, each in self._loads.items()}

    def action(self) -> NDArray[np.float32]:
        """Return the commanded aperture (m), and twist (m/s, rad/s) if there is an arm.

        Before the first command it is the target that the gripper states, or its aperture.
        """
        known = [each for each in (self._command_m, self._target_m, self._aperture_m) if math.isfinite(each)]
        return np.array([known[0], *self._twist], np.float32)

    def _gripper(self, value: Any) -> None:
        self._aperture_m = _kept(value["aperture_m"], self._aperture_m)
        self._target_m = _kept(value["target_m"], self._target_m)

    def _arm(self, value: Any) -> None:
        pose = value["tcp_pose"]
        self._pose = _updated(self._pose, [*pose["position_m"], *pose["quaternion_xyzw"]])

    def _job(self, value: Any) -> None:
        self._command_m = _kept(value["held_m"], self._command_m)
        if self._layout.arm:
            twist = value["wanted"]["twist"]
            self._twist = np.zeros(6) if twist is None else np.array([*twist["linear_m_s"], *twist["angular_rad_s"]])

    def _correction(self, value: Any) -> None:
        self._command_m = _kept(value["sent_m"], self._command_m)

    def _image(self, finger: FingerLayout, raw: Raw) -> None:
        self._images[finger.name] = raw

    def _field(self, finger: FingerLayout, raw: Raw) -> None:
        # A marker that has not been found yet counts as at rest.
        last = self._fields.get(finger.name, np.zeros(2 * finger.markers))
        self._fields[finger.name] = _updated(last, np.array(raw.value["displacement_m"], float).ravel())

    def _load(self, finger: FingerLayout, raw: Raw) -> None:
        if finger.load:
            value = raw.value
            now = [*value["shear_n"], value["torque_nm"]]
            self._loads[finger.name] = _updated(self._loads[finger.name], now)


def _kept(value: float | None, last: float) -> float:
    return last if not isinstance(value, int | float) or not math.isfinite(value) else float(value)


def _updated(last: NDArray[np.float64], now: Any) -> NDArray[np.float64]:
    found = np.array(now, float)
    if found.shape != last.shape:
        raise ValueError(f"{found.size} numbers, not {last.size}")
    return np.where(np.isfinite(found), found, last)
