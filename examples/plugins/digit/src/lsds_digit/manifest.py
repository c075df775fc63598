"""The backends of this distribution. lsds imports the modules that they name when they are used."""

from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return all backends."""
    return [
        BackendSpec(
            "sensor",
            "digit",
            factory="lsds_digit.sensor:build",
            options="lsds_digit.options:Options",
            summary="DIGIT fingertip on USB, by serial number or index",
            requires=("cv2",),
        ),
        BackendSpec(
            "sensor",
            "mock-digit",
            factory="lsds_digit.mock:build",
            options="lsds_digit.options:MockOptions",
            summary="DIGIT fingertip without markers in the simulated cell",
            requires=("cv2", "numba"),
            extra="sim",
            virtual_time=True,
            in_cell=True,
        ),
    ]
