"""Choice of the fingers that a gripper mock drives: its own, or those of a plant shared with other mocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lsds_mocks.link.alone import LoneFingers
from lsds_mocks.link.remote import RemoteFingers

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds.contracts.plant_links import FingerLink
    from lsds_mocks.wire.robotiq.options import RobotiqOptions


def clearing(options: RobotiqOptions, link: FingerLink) -> Callable[[bool], None]:
    """Return the function that removes the object for an activation (True) and puts it back afterwards (False)."""
    if isinstance(link, LoneFingers) and not options.object_stays:
        return link.set_aside
    return lambda _: None


def finger_link(options: RobotiqOptions, clock: Clock) -> FingerLink:
    """Return the link for the options. Raises ConnectFailed if there is no plant at the address."""
    if options.cell:
        return RemoteFingers(options.cell)
    aperture = options.stroke_mm if options.aperture_mm is None else options.aperture_mm
    return LoneFingers(
        clock,
        aperture_m=aperture * 1e-3,
        object_m=None if options.object_mm is None else options.object_mm * 1e-3,
        hollow_m=None if options.hollow_mm is None else options.hollow_mm * 1e-3,
        stiffness_n_m=options.stiffness_n_mm * 1e3,
    )
