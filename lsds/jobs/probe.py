"""Probe: let the controller open the fingers until the object begins to slip, just above what it stood on.

An object that begins to slip in the air falls by a centimetre before any camera and gripper can answer. Right after its
load has been taken up, it falls by what it was lifted: a millimetre or two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import nanoseconds

if TYPE_CHECKING:
    from lsds.contracts import Situation

PROBE_LIFT_M_S = 0.003
"""Speed of lifting before probing, m/s; chosen: the load is taken up within a millimetre or two."""
FINGERS_REST_S = 0.8
"""Time for which the fingers must rest after a motion before probing ends, s; chosen."""
NEVER_MOVED_S = 2.5
"""Time after which probing ends if the fingers have not moved, s; chosen."""
MOST_PROBE_S = 10.0
"""Maximum duration of probing, s; chosen."""
STILL_M = 5e-5
"""Maximum change of the aperture of resting fingers, m; chosen: about a quarter of a Hand-E's tick."""


class Probe:
    """Tells when the controller has found what it can find: the fingers rest."""

    def __init__(self, start_ns: int) -> None:
        self._start_ns = self._moved_ns = start_ns
        self._aperture_m: float | None = None
        self._rest_s = NEVER_MOVED_S

    def step(self, now: Situation) -> bool:
        """Return whether it is over."""
        aperture = None if now.gripper is None else now.gripper.aperture_m
        if aperture is not None and (self._aperture_m is None or abs(aperture - self._aperture_m) > STILL_M):
            self._rest_s = NEVER_MOVED_S if self._aperture_m is None else FINGERS_REST_S
            self._aperture_m, self._moved_ns = aperture, now.t_ns
        rests = now.t_ns - self._moved_ns > nanoseconds(self._rest_s)
        return rests or now.t_ns - self._start_ns > nanoseconds(MOST_PROBE_S)
