"""The life cycle of a camera device: it is opened and closed with its thread, and nothing moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

from lsds.contracts.lifecycle import LifecycleGuard, MotionlessLife
from lsds_drivers.cameras.pump import FramePump, PumpLimits, Work, stale_limit
from lsds_drivers.cameras.times import ExposureTimes

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_drivers.cameras.options import StreamOptions
    from lsds_drivers.cameras.source import FrameSource

T = TypeVar("T")


class CameraDevice(MotionlessLife, Generic[T]):
    """The part of a `Device` that is independent of the picture processing."""

    def __init__(
        self, device: str, source: FrameSource, work: Work[T], options: StreamOptions, context: BuildContext
    ) -> None:
        self._device = device
        self._guard = LifecycleGuard(device)
        self._pump = FramePump(
            device,
            source,
            work,
            context.clock,
            limits=PumpLimits(
                connect_timeout_s=options.connect_timeout_s,
                stale_after_s=stale_limit(options.stale_after_ms),
                skip=options.skip_frames,
            ),
            times=ExposureTimes(options.stamps, options.delay_ms * 1e-3),
        )

    @property
    def measured_rate_hz(self) -> float | None:
        """Measured picture rate; None before the second picture."""
        return self._pump.measured_rate_hz

    @property
    def times_from_device(self) -> bool:
        """True if pictures have the device's time stamp, false if that of their arrival."""
        return self._pump.times_from_device

    @property
    def lost(self) -> int:
        """Number of times the camera was lost since `connect`."""
        return self._pump.lost

    def connect(self) -> None:
        """Open the camera and wait for its first good picture. Raises ConnectFailed."""
        with self._guard.connecting():
            self._prepare()
            self._pump.start()

    def close(self) -> None:
        """End the thread and release the camera."""
        with self._guard.closing() as first:
            if first:
                self._pump.close()

    def _prepare(self) -> None:
        """Prepare opening the camera. Raises ConnectFailed."""
