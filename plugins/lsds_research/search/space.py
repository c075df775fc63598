"""The space of scenarios: config keys with their ranges, and the mapping from the unit cube to a config."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lsds.config.overrides import parse_override
from lsds.config.reading import read_toml
from lsds.errors import ConfigIssue, DataError
from lsds_research.collecting.objects import PLANS

GREATEST_END = 1e15
"""Greatest absolute value of an end of a range: up to this one a double holds every whole number."""
Value = str | float | int | bool
Scenario = dict[str, Value]
"""Config keys that differ from their defaults."""


@dataclass(frozen=True, slots=True)
class Axis:
    """A config key: a range (logarithmic if its ends are positive and differ by more than a factor of 5), or choices.
    `usual` is the value in scenarios in which the key has no effect."""

    key: str
    low: float = 0.0
    high: float = 1.0
    choices: tuple[Value, ...] = ()
    usual: Value = 0.0
    whole: bool = False

    def value(self, u: float) -> Value:
        """Return the value at a position between 0 and 1."""
        u = min(max(u, 0.0), 1.0)
        if self.choices:
            return self.choices[min(int(u * len(self.choices)), len(self.choices) - 1)]
        # A whole number has the share of the range up to the next one, so the last has one, too.
        high = self.high + self.whole
        if self.low > 0 and self.high > 5 * self.low:
            found = self.low * math.exp(u * math.log(high / self.low))
        else:
            found = self.low + u * (high - self.low)
        if self.whole:
            return min(math.floor(found), int(self.high))
        # The saved value must equal the value that was run, to the last digit. Narrow ranges need more digits.
        size = max(abs(self.low), abs(self.high))
        digits = 4 + math.floor(math.log10(size / (self.high - self.low))) if size > self.high - self.low else 4
        return min(max(float(f"{found:.{digits}g}"), self.low), self.high)


DEFAULT = (
    Axis("cell.simulated.object", choices=tuple(PLANS), usual="pvc-pipe"),
    Axis("cell.simulated.friction_scale", 0.6, 1.6, usual=1.0),
    Axis("cell.simulated.finger_stiffness_n_mm", 2.5, 10.0, usual=5.0),
    Axis("cell.simulated.modulus_mpa", 0.12, 0.32, usual=0.2),
    Axis("cell.simulated.turned_deg", -20.0, 20.0, usual=0.0),
    Axis("cell.simulated.chatter_amplitude", 0.0, 0.5, usual=0.25),
    Axis("cell.simulated.vibration_um", 0.0, 20.0, usual=3.0),
    Axis("sensor.mock-gelsight-mini.gel", 1, 1000, usual=1, whole=True),
    Axis("sensor.mock-gelsight-mini.noise", 0.5, 3.0, usual=1.0),
    Axis("sensor.mock-gelsight-mini.wear", 0.0, 1.0, usual=0.0),
    Axis("sensor.mock-gelsight-mini.rate_hz", 15.0, 40.0, usual=25.0),
    Axis("sensor.mock-gelsight-mini.latency_ms", 15.0, 60.0, usual=25.0),
    Axis("gripper.mock-hand-e.latency_ms", 5.0, 120.0, usual=40.0),
    Axis("gripper.mock-hand-e.command_loss", 0.0, 0.2, usual=0.0),
    Axis("task.first_squeeze_m", 5e-4, 3e-3, usual=1e-3),
    Axis("task.lift_speed_m_s", 0.01, 0.1, usual=0.038),
    Axis("task.lift_acceleration_m_s2", 0.3, 1.0, usual=0.5),
    Axis("seed", 0, 1000, usual=0, whole=True),
)
"""Config keys of the default search, with their ranges."""


def point_to_scenario(space: Sequence[Axis], point: Iterable[float]) -> Scenario:
    """Return the scenario at a point of the unit cube."""
    return {axis.key: axis.value(float(u)) for axis, u in zip(space, point, strict=True)}


def values_of(settings: Iterable[str]) -> dict[str, Any]:
    """Return the values of settings by their config keys; texts that are no settings are left out."""
    parsed = (parse_override(text) for text in settings)
    return {".".join(one[0]): one[1] for one in parsed if not isinstance(one, ConfigIssue)}


def read_space(path: Path) -> tuple[Axis, ...]:
    """Return the space that a TOML file describes: `"task.lift_speed_m_s" = [0.01, 0.1]`, or a list of choices.

    A list of two numbers is a range, of integers if both are integers. Any other list is one of choices, of which the
    first is usual. Raises DataError with the key.
    """
    entries = flat(read_toml(path))
    twice = next((key for key, count in Counter(key for key, _ in entries).items() if count > 1), None)
    if twice:
        raise DataError(f"{path}, {twice}: has two ranges, one of them in a table; leave one out")
    space = tuple(_axis(path, key, entry) for key, entry in entries)
    if not space:
        raise DataError(f'{path}: no key with a range (write "task.lift_speed_m_s" = [0.01, 0.1])')
    return space


def flat(tables: Mapping[str, Any], before: str = "") -> list[tuple[str, Any]]:
    """Return the config keys of tables, "task.lift_s", with their values."""
    found: list[tuple[str, Any]] = []
    for key, value in tables.items():
        found += flat(value, f"{before}{key}.") if isinstance(value, Mapping) else [(before + key, value)]
    return found


def _axis(path: Path, key: str, entry: Any) -> Axis:
    if not isinstance(entry, list) or len(entry) < 2:
        raise DataError(f"{path}, {key}: {entry!r} is no range (write [least, greatest], or a list of choices)")
    usual = next((axis.usual for axis in DEFAULT if axis.key == key), None)
    if len(entry) == 2 and all(isinstance(end, int | float) and not isinstance(end, bool) for end in entry):
        low, high = entry
        if not all(abs(end) <= GREATEST_END for end in entry):
            raise DataError(f"{path}, {key}: an end of the range is no number up to {GREATEST_END:g}")
        if not low < high:
            raise DataError(f"{path}, {key}: the least value {low} is not below the greatest {high}")
        whole = isinstance(low, int) and isinstance(high, int)
        return Axis(key, low, high, usual=low if usual is None else usual, whole=whole)
    return Axis(key, choices=tuple(entry), usual=entry[0] if usual is None or usual not in entry else usual)
