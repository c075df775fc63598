"""The driver on the fake, in real time."""

from __future__ import annotations

from lsds.contracts import BuildContext

from lsds_franka_hand.fake import FakeHand, Fingers
from lsds_franka_hand.gripper import FrankaHand
from lsds_franka_hand.options import MockOptions

NAME = "mock-franka-hand"


def fingers_of(options: MockOptions, context: BuildContext) -> Fingers:
    """Return the fingers that all drivers of a rig share."""
    return context.shared(f"fingers of {NAME}", lambda: Fingers(context.clock, options.object_mm * 1e-3))


def build(options: MockOptions, context: BuildContext) -> FrankaHand:
    """Return the driver on the fake."""
    fingers = fingers_of(options, context)
    return FrankaHand(NAME, lambda: FakeHand(fingers), options, context.clock)
