"""Checks of controllers: apertures are sound, and missing inputs never open the gripper."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from numbers import Real
from typing import Any

from lsds.contracts import GripEstimate, GripTask, Slide
from lsds.testing.bench import Bench
from lsds.testing.feeding import build
from lsds.testing.grips import (
    NOT_MEASURED,
    STROKE_M,
    degraded_grips,
    grip_inputs,
    nearly_closed_grips,
    pressed_grips,
    sound_grips,
)
from lsds.testing.stimulus import Name

NEARLY_CLOSED = "the fingers are nearly closed"
"""Place of an answer to `nearly_closed_grips`."""
SLIDE_M_S = 5e-3
"""Speed of an intended slip, m/s; chosen."""
NAMES: tuple[Name, ...] = ("slides", "turns")
APERTURE_ROUNDING_M = 1e-9
"""Maximum difference of equal apertures, m: rounding."""


def check_apertures_are_sound(bench: Bench) -> None:
    """Every answer is None or a finite absolute aperture within the gripper's stroke, whatever is lacking."""
    for where, grip, aperture_m in _answers(bench):
        if aperture_m is None:
            continue
        assert isinstance(aperture_m, Real), (
            f"{where}: update() returned {type(aperture_m).__name__} {aperture_m!r}; return metres or None"
        )
        assert not isinstance(aperture_m, bool), f"{where}: update() returned {aperture_m}; return metres or None"
        assert math.isfinite(aperture_m), (
            f"{where}: update() returned {aperture_m}; return None to leave the gripper as it is"
        )
        assert 0 <= float(aperture_m) <= STROKE_M, (
            f"{where}: update() returned {aperture_m:.4f} m, outside of the stroke 0 to {STROKE_M} m; clamp it, and "
            "answer in metres"
        )
        if where.startswith(NEARLY_CLOSED):
            continue
        # A grip of the kit never needs more than a few millimetres; zero closes as far as the force limit allows.
        assert float(aperture_m) == 0 or float(aperture_m) > grip.commanded_m / 2, (
            f"{where}: update() returned {float(aperture_m) * 1e3:.3f} mm at a commanded aperture of "
            f"{grip.commanded_m * 1e3:.2f} mm; return the aperture to move to, not the change of it"
        )


def check_never_opens_on_what_is_lacking(bench: Bench) -> None:
    """An input that is missing, abstains, is NaN or stale never asks for a larger aperture than the one commanded."""
    for name in NAMES:
        rests = _after(bench, name)
        sound = [rests.update(*given) for given in sound_grips(name)]
        for what, inputs in degraded_grips(name).items():
            controller = _after(bench, name)
            for i, given in enumerate(inputs):
                aperture_m = _asked(controller, given, what)
                # A controller that needs no measured aperture may open as it would with one.
                as_sound = sound[i] if what == NOT_MEASURED else None
                commanded_m = given[0].commanded_m
                most_m = max(commanded_m, commanded_m if as_sound is None else as_sound)
                assert not _is_wider(aperture_m, most_m), (
                    f"sequence {name!r}, then {what}, frame {i}: it opens from {commanded_m * 1e3:.2f} to "
                    f"{aperture_m * 1e3:.2f} mm; open only on a sound input that shows no slip, otherwise return None"
                )


def check_opens_only_as_declared(bench: Bench) -> None:
    """A controller without a true `may_open` never asks for a larger aperture than the one commanded."""
    if getattr(build(bench), "may_open", False):
        return
    for where, grip, aperture_m in (*_answers(bench), *_intended(bench)):
        assert not _is_wider(aperture_m, grip.commanded_m), (
            f"{where}: it opens from {grip.commanded_m * 1e3:.2f} to {aperture_m * 1e3:.2f} mm and does not declare "
            "it; give it an attribute may_open"
        )


def check_limits_force_as_declared(bench: Bench) -> None:
    """A controller with a true `limits_force` closes no further on a fragile object that the imprint shows to be
    pressed by more than it withstands."""
    if not getattr(build(bench), "limits_force", False):
        return
    controller = build(bench)
    for i, (grip, wanted) in enumerate(pressed_grips("slides")):
        aperture_m = controller.update(grip, wanted)
        assert aperture_m is None or not float(aperture_m) < grip.commanded_m - APERTURE_ROUNDING_M, (
            f"frame {i}: it closes from {grip.commanded_m * 1e3:.2f} to {float(aperture_m) * 1e3:.2f} mm with "
            f"{grip.normal_n:g} N on an object that withstands {wanted.fragile_n:g} N; keep to wanted.fragile_n, or "
            "declare limits_force = False"
        )


def _is_wider(aperture_m: Any, most_m: float) -> bool:
    return isinstance(aperture_m, Real) and float(aperture_m) > most_m + APERTURE_ROUNDING_M


def _after(bench: Bench, name: Name) -> Any:
    """Return a new controller that has processed a sequence."""
    controller = build(bench)
    for given in grip_inputs(name):
        controller.update(*given)
    return controller


def _intended(bench: Bench) -> Iterator[tuple[str, GripEstimate, Any]]:
    """Yield the answers to a task with an intended slip, and to one that probes."""
    for what, changes in (("a slip is intended", {"slide": Slide(SLIDE_M_S)}), ("the job probes", {"probes": True})):
        controller = build(bench)
        for i, (grip, wanted) in enumerate(grip_inputs("slides")):
            yield f"{what}, frame {i}", grip, controller.update(grip, replace(wanted, **changes))


def _answers(bench: Bench) -> Iterator[tuple[str, GripEstimate, Any]]:
    for name in NAMES:
        controller = build(bench)
        for i, given in enumerate(grip_inputs(name)):
            yield f"sequence {name!r}, frame {i}", given[0], controller.update(*given)
        for what, inputs in degraded_grips(name).items():
            controller = _after(bench, name)
            for i, given in enumerate(inputs):
                yield f"sequence {name!r}, then {what}, frame {i}", given[0], _asked(controller, given, what)
    controller = build(bench)
    for i, given in enumerate(nearly_closed_grips("slides")):
        yield f"{NEARLY_CLOSED}, frame {i}", given[0], controller.update(*given)


def _asked(controller: Any, given: tuple[GripEstimate, GripTask], what: str) -> Any:
    try:
        return controller.update(*given)
    except Exception as error:
        raise AssertionError(
            f"{what}: update() raised {type(error).__name__}: {error}; return None to leave the gripper as it is"
        ) from error


CONTROLLER_CHECKS = (
    check_limits_force_as_declared,
    check_apertures_are_sound,
    check_never_opens_on_what_is_lacking,
    check_opens_only_as_declared,
)
