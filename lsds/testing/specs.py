"""Checks of what a device declares about itself."""

from __future__ import annotations

import math
from typing import Any

from lsds.contracts.values import ArmSpec, GripperSpec, SensorSpec
from lsds.testing.bench import Bench

_TYPES = {"sensor": SensorSpec, "gripper": GripperSpec, "arm": ArmSpec}
_FIELDS: dict[str, dict[str, tuple[float, float]]] = {
    "sensor": {"width_px": (1, 20_000), "height_px": (1, 20_000), "rate_hz": (0.1, 10_000)},
    "gripper": {"stroke_m": (1e-3, 1.0)},
    "arm": {"speed_m_s": (1e-3, 20.0), "acceleration_m_s2": (1e-3, 500.0), "reach_m": (0.05, 10.0)},
}
"""Plausible ranges in SI units."""
GEL_M = (0.5e-3, 0.2)
"""Plausible width of the gel that a tactile sensor sees, m."""


def check_spec_is_sound(bench: Bench) -> None:
    """The spec is finite, positive and plausible in SI units, with ranges in ascending order."""
    with bench.device() as device:
        spec = device.spec
    wanted = _TYPES[bench.kind]
    assert isinstance(spec, wanted), f"spec is {type(spec).__name__}, not {wanted.__name__}; return a {wanted.__name__}"
    for name, (low, high) in _FIELDS[bench.kind].items():
        value = getattr(spec, name)
        assert _is_number(value), f"spec.{name} is {value!r}, not a finite number"
        assert low <= value <= high, f"spec.{name} is {value}, not between {low} and {high}; units are SI (m, s, N)"
    if bench.kind == "sensor":
        _sensor(spec)
    elif bench.kind == "gripper":
        _gripper(spec)


def check_spec_stays_the_same(bench: Bench) -> None:
    """The spec is the same every time while the device is connected."""
    with bench.device() as device:
        first = device.spec
        for _ in range(5):
            bench.read(device)
            bench.advance(0.05)
            now = device.spec
            assert now == first, f"the spec was {first} and is {now}; compute it once, in the constructor or in arm()"


def _sensor(spec: Any) -> None:
    for name in ("width_px", "height_px"):
        assert isinstance(getattr(spec, name), int), f"spec.{name} is {getattr(spec, name)!r}, not a whole number"
    scale = spec.metres_per_px
    assert _is_number(scale), f"spec.metres_per_px is {scale!r}, not a finite number"
    width_m = scale * spec.width_px
    assert GEL_M[0] <= width_m <= GEL_M[1], (
        f"spec.metres_per_px = {scale} makes the gel {width_m:g} m wide, and {GEL_M[0]} to {GEL_M[1]} m are plausible; "
        "give metres per pixel, not millimetres"
    )
    if spec.pad is not None:
        sound = isinstance(spec.pad, tuple) and len(spec.pad) == 2 and all(isinstance(n, int) for n in spec.pad)
        assert sound, f"spec.pad is {spec.pad!r}, not (rows, columns) or None"
        assert min(spec.pad) >= 2, f"spec.pad is {spec.pad!r}; a grid has two rows and columns or more"


def _gripper(spec: Any) -> None:
    assert _is_number(spec.resolution_m), f"spec.resolution_m is {spec.resolution_m!r}, not a finite number"
    assert 0 < spec.resolution_m <= spec.stroke_m / 4, (
        f"spec.resolution_m is {spec.resolution_m}, not above 0 and below a quarter of the stroke ({spec.stroke_m} m)"
    )
    for name, highest in (("speed_m_s", 5.0), ("force_n", 5000.0)):
        found = getattr(spec, name)
        sound = isinstance(found, tuple) and len(found) == 2 and all(map(_is_number, found))
        assert sound, f"spec.{name} is {found!r}, not (lowest, highest) of finite numbers"
        low, high = found
        assert 0 <= low <= high, f"spec.{name} is {found}: the lowest is not between 0 and the highest"
        assert 0 < high <= highest, f"spec.{name} ends at {high}, not between 0 and {highest}; units are m/s and N"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


SPEC_CHECKS = (check_spec_is_sound, check_spec_stays_the_same)
