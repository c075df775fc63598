"""The backends of this distribution. lsds imports the modules that they name when they are used."""

from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return all backends."""
    return [
        BackendSpec(
            "gripper",
            "onrobot-rg2",
            factory="lsds_onrobot_rg2.gripper:build",
            options="lsds_onrobot_rg2.options:Options",
            summary="OnRobot RG2 over Modbus TCP",
            requires=("pymodbus",),
        ),
        BackendSpec(
            "gripper",
            "mock-onrobot-rg2",
            factory="lsds_onrobot_rg2.mock:build",
            options="lsds_onrobot_rg2.options:MockOptions",
            summary="OnRobot RG2 in the simulated cell",
            requires=("numba",),
            extra="sim",
            virtual_time=True,
            in_cell=True,
        ),
        BackendSpec(
            "wire_mock",
            "onrobot-rg2",
            factory="lsds_onrobot_rg2.server:Rg2Server",
            options="lsds_onrobot_rg2.server:ServerOptions",
            summary="Compute Box with an OnRobot RG2: Modbus TCP",
        ),
    ]
