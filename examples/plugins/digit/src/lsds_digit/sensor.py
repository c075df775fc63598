"""The driver of the DIGIT: life cycle and freshness."""

from __future__ import annotations

from lsds.clock import Clock, seconds
from lsds.contracts import BuildContext, Frame, SensorSpec
from lsds.contracts.lifecycle import LifecycleGuard, MotionlessLife
from lsds.errors import ConnectFailed, StaleData

from lsds_digit.camera import Camera
from lsds_digit.grabber import Grabber
from lsds_digit.options import Options

NAME = "digit"


class DigitSensor(MotionlessLife):
    """A `TactileSensor`."""

    def __init__(self, camera: Camera, options: Options, clock: Clock) -> None:
        self._camera = camera
        self._grabber = Grabber(NAME, camera)
        self._options = options
        self._clock = clock
        self._guard = LifecycleGuard(NAME)
        self._spec = options.spec(options.pad)

    @property
    def spec(self) -> SensorSpec:
        """Image size, rate, scale, and markers if the gel has them."""
        return self._spec

    def connect(self) -> None:
        """Open the camera and wait for the first frame. Raises ConnectFailed."""
        with self._guard.connecting():
            self._camera.open()
            self._grabber.start(self._options.connect_timeout_s)
            trouble = self._grabber.trouble
            if self._grabber.newest is not None:
                return
            self._grabber.stop()
            if trouble is not None:
                raise ConnectFailed(NAME, trouble.problem, remedy=trouble.remedy) from trouble
            problem = f"no frame came within {self._options.connect_timeout_s:g} s"
            raise ConnectFailed(NAME, problem, remedy="unplug the sensor and plug it in again")

    def close(self) -> None:
        """End the thread and release the camera."""
        with self._guard.closing() as first:
            if first:
                self._grabber.stop()

    def read(self) -> Frame:
        """Return the newest frame. Raises StaleData, with the failure of the camera if there is one."""
        self._guard.require_readable()
        frame, trouble = self._grabber.newest, self._grabber.trouble
        if frame is None:
            raise StaleData(NAME, "no frame has arrived yet", remedy="read again")
        age_s = seconds(self._clock.now() - frame.t_ns)
        if age_s * 1e3 > self._options.stale_after_ms:
            problem, remedy = f"the newest frame is {age_s:.2f} s old", "check the cable and the port"
            if trouble is not None:
                problem, remedy = f"{problem}: {trouble.problem}", trouble.remedy or remedy
            raise StaleData(NAME, problem, remedy=remedy) from trouble
        return frame


def build(options: Options, context: BuildContext) -> DigitSensor:
    """Return the driver of a DIGIT on USB. Opens nothing."""
    return DigitSensor(Camera(NAME, options, context.clock), options, context.clock)
