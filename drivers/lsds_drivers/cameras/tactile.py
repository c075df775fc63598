"""Camera-based fingertips: one `TactileSensor` class for all makes, which differ in picture conversion and spec."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import seconds
from lsds.contracts import Frame, SensorSpec
from lsds.errors import DataError, StaleData
from lsds.tactile.gate import RepeatedImage
from lsds_drivers.cameras.device import CameraDevice

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds_drivers.cameras.options import StreamOptions
    from lsds_drivers.cameras.picture import Picture
    from lsds_drivers.cameras.source import FrameSource


class CameraSensor(CameraDevice[Frame]):
    """A `TactileSensor` that reads a source in its own thread and returns the newest frame.

    A frame's time is its estimated exposure time (`lsds_drivers.cameras.times`). A frame that is black, torn or cannot
    be decoded raises DataError once; after that the last good frame is returned again.
    """

    def __init__(
        self,
        device: str,
        source: FrameSource,
        picture: Picture,
        spec: SensorSpec,
        options: StreamOptions,
        context: BuildContext,
    ) -> None:
        super().__init__(device, source, self._frame, options, context)
        self.spec = spec
        self._picture = picture
        self._repeated = RepeatedImage()
        self._changed_ns: int | None = None
        self._still_after_ms = options.still_after_ms

    def read(self) -> Frame:
        """Return the newest frame.

        Raises StaleData before the first frame, if the newest is too old, and if the picture has not changed for too
        long; DataError, once, for a damaged frame; EOFError at the end of a recording.
        """
        self._guard.require_readable()
        frame = self._pump.newest()
        changed = self._changed_ns
        still_ms = 0.0 if changed is None else seconds(frame.t_ns - changed) * 1e3
        if self._still_after_ms > 0 and still_ms > self._still_after_ms:
            raise StaleData(
                self._device,
                f"the picture has stood still for {still_ms:.0f} ms: a camera's noise never repeats",
                remedy="the camera hangs: unplug it and plug it in again",
            )
        return frame

    def _frame(self, image: NDArray[np.uint8], t_ns: int, seq: int) -> Frame:
        tactile = self._picture.of(image)
        if not tactile[:: max(1, tactile.shape[0] // 8)].max() > 0:
            raise DataError("the frame is black (is the sensor lit?)")
        if not self._repeated.seen(tactile):
            self._changed_ns = t_ns
        return Frame(tactile, t_ns, seq)
