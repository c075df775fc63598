"""The backends of this distribution. lsds imports the modules that they name when they are used."""

from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return all backends."""
    return [
        BackendSpec(
            "gripper",
            "franka-hand",
            factory="lsds_franka_hand.gripper:build",
            options="lsds_franka_hand.options:Options",
            summary="Franka Hand by libfranka's blocking commands",
        ),
        BackendSpec(
            "gripper",
            "mock-franka-hand",
            factory="lsds_franka_hand.mock:build",
            options="lsds_franka_hand.options:MockOptions",
            summary="Franka Hand on a fake, in real time and without a cell",
        ),
    ]
