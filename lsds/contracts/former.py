"""Contract 1 of a controller, for one release: `update(state)` with a `GripInput`."""

from __future__ import annotations

import inspect
import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lsds.contracts.algorithms import Controller
from lsds.contracts.grip import GripEstimate, GripTask

if TYPE_CHECKING:
    from lsds.contracts.finger import FingerCycle
    from lsds.contracts.values import Detection, Slide, SlipEstimate


@dataclass(frozen=True, slots=True)
class GripInput:
    """The input of a controller written for contract 1. New ones get a `GripEstimate` and a `GripTask`.

    `aperture_m` is the one last commanded, `frame_aperture_m` that at the time of the newest frame, and
    `measured_aperture_m` the newest. `grip` is the estimate of the grip.
    """

    t_ns: int
    dt_s: float
    detection: Detection
    estimate: SlipEstimate
    aperture_m: float
    measured_aperture_m: float
    fingers: tuple[FingerCycle, ...] = ()
    touch_m: float = math.nan
    frame_aperture_m: float = math.nan
    probes: bool = False
    fragile_n: float = math.inf
    resolution_m: float = 0.0
    slide: Slide | None = None
    grip: GripEstimate | None = None


class FormerController:
    """Runs a controller of contract 1 as a `Controller`."""

    def __init__(self, controller: Any) -> None:
        self._controller = controller

    @property
    def may_open(self) -> bool:
        """Whether it declares `may_open`."""
        return bool(getattr(self._controller, "may_open", False))

    @property
    def limits_force(self) -> bool:
        """Whether it declares `minds_force`, the name in contract 1."""
        return bool(getattr(self._controller, "minds_force", False))

    @property
    def held_back(self) -> bool:
        """Whether `fragile_n` limited the last update."""
        return bool(getattr(self._controller, "held_back", False))

    def update(self, grip: GripEstimate, wanted: GripTask) -> float | None:
        """Return the aperture (m) to command, or None to leave the gripper as it is."""
        state = GripInput(
            t_ns=grip.t_ns,
            dt_s=grip.dt_s,
            detection=grip.detection,
            estimate=grip.estimate,
            aperture_m=grip.commanded_m,
            measured_aperture_m=grip.measured_m,
            fingers=grip.fingers,
            touch_m=grip.touch_m,
            frame_aperture_m=grip.aperture_m,
            probes=wanted.probes,
            fragile_n=wanted.fragile_n,
            resolution_m=wanted.resolution_m,
            slide=wanted.slide,
            grip=grip,
        )
        aperture_m: float | None = self._controller.update(state)
        return aperture_m

    def reset(self) -> None:
        """Forget the past."""
        self._controller.reset()


def as_controller(controller: Any, label: str) -> Controller:
    """Return a controller of the present contract; one of contract 1 is wrapped, with a FutureWarning.

    That warning is shown to the users of a cell, too.
    """
    if not _takes_one(controller):
        present: Controller = controller
        return present
    warnings.warn(
        f"{label}: update(state) is contract 1 and will not run with lsds 0.3; write update(grip, wanted), see "
        "docs/compatibility.md",
        FutureWarning,
        stacklevel=2,
    )
    return FormerController(controller)


def _takes_one(controller: Any) -> bool:
    try:
        signature = inspect.signature(controller.update)
    except (AttributeError, TypeError, ValueError):
        return False
    return _accepts(signature, 1) and not _accepts(signature, 2)


def _accepts(signature: inspect.Signature, count: int) -> bool:
    try:
        signature.bind(*(None,) * count)
    except TypeError:
        return False
    return True
