"""Wire mock of the ground-truth camera: markers on gripper and object at 60 Hz, as MJPEG or RealSense recording."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lsds.calibration.vision.camera import save_camera
from lsds.clock import NS_PER_S, nanoseconds
from lsds_mocks.scene.stage import Stage
from lsds_mocks.wire.cameras.links import scene_link
from lsds_mocks.wire.cameras.realsense import record
from lsds_mocks.wire.mjpeg.camera import CameraMock

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds.contracts.plant_links import SceneLink
    from lsds.contracts.wire import ReceivedFrame
    from lsds_mocks.wire.cameras.options import TruthCameraOptions

NAME = "truth-camera"
_LEAP_M = 0.005
"""Motion within an exposure above which a new round of the script has begun, m; chosen."""


class SceneView:
    """Renders the scene that a link provides. A picture's time is the middle of its exposure."""

    def __init__(self, options: TruthCameraOptions, link: SceneLink, context: BuildContext) -> None:
        self.stage = Stage(options.width, options.height, context.rng_seed("truth camera"), noise=options.noise)
        self._link = link
        self._half_ns = nanoseconds(options.exposure_ms * 1e-3 / 2)

    def picture(self, t_ns: int, seq: int, since_start: int) -> NDArray[np.uint8] | None:
        """Return the camera's picture, uint8 RGB (height, width, 3)."""
        begin, end = self._link.scene(t_ns - self._half_ns), self._link.scene(t_ns + self._half_ns)
        if end is None:
            return None
        if begin is None or abs(begin.object_m - end.object_m) > _LEAP_M or abs(begin.arm_m - end.arm_m) > _LEAP_M:
            begin = end  # a new round of the script began during the exposure
        return self.stage.render(begin, end, seq)

    def truth(self, t_ns: int) -> Mapping[str, Any]:
        """Return the heights of arm and object above the table (m), and whether they change."""
        begin, end = self._link.scene(t_ns - self._half_ns), self._link.scene(t_ns + self._half_ns)
        if end is None:
            return {"moving": False}
        moving = begin is not None and (begin.arm_m, begin.object_m) != (end.arm_m, end.object_m)
        return {"arm_m": end.arm_m, "object_m": end.object_m, "moving": moving}

    def close(self) -> None:
        """Give the link back."""
        self._link.close()


class TruthCamera:
    """A `WireMock`: writes the recording if one is configured, then serves the camera on HTTP."""

    def __init__(self, options: TruthCameraOptions, context: BuildContext) -> None:
        self._options = options
        self._context = context
        self._view = SceneView(options, scene_link(options, context.clock, context.seed), context)
        self._camera = CameraMock(NAME, options, self._view, seed=context.seed, clock=context.clock)

    def start(self) -> Mapping[str, str]:
        """Write calibration and recording, if any, and listen. Raises ConnectFailed, DataError."""
        recording = {}
        if self._options.calibration:
            save_camera(self._options.calibration, self._view.stage.camera)
            recording = {"calibration": self._options.calibration}
        if self._options.record:
            link = scene_link(self._options, self._context.clock, self._context.seed)
            view, origin = SceneView(self._options, link, self._context), self._context.clock.now()
            period_ns = NS_PER_S / self._options.rate_hz
            times = [
                origin + round(i * period_ns) for i in range(round(self._options.record_s * self._options.rate_hz))
            ]
            images = ((t, view.picture(t, i, i)) for i, t in enumerate(times))
            record(NAME, self._options.record, view.stage.camera, self._options.rate_hz, images)
            link.close()
            recording["recording"] = self._options.record
        return {**self._camera.start(), **recording}

    def serve(self, stop: threading.Event) -> None:
        """Expose until `stop` is set."""
        self._camera.serve(stop)

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Begin a fault now. Raises ConfigError for one that cameras do not have."""
        self._camera.inject(fault)

    def end_fault(self, name: str) -> None:
        """End the faults of a name."""
        self._camera.end_fault(name)

    def received(self, since: int) -> Sequence[ReceivedFrame]:
        """Return the HTTP requests with a number of at least `since`."""
        return self._camera.received(since)

    def truths(self, since_ns: int) -> Sequence[Mapping[str, Any]]:
        """Return the states of the scene since a time."""
        return self._camera.truths(since_ns)

    def close(self) -> None:
        """Release all resources."""
        self._camera.close()
