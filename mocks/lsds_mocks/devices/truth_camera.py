"""Pose source `mock-truth-camera`: measures poses in rendered pictures of the simulated cell, on the cell's time.

It uses pixels only: it detects the markers in the rendered picture as with a real camera, with noise, blur and latency.
`CellTruth` has the true state.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lsds.calibration.vision.rotation import pose_of
from lsds.clock import NS_PER_S, nanoseconds
from lsds.contracts import PoseSample
from lsds.contracts.lifecycle import LifecycleGuard, MotionlessLife
from lsds.contracts.plant_links import Scene
from lsds.errors import StaleData
from lsds_mocks.cell.build import shared_cell
from lsds_mocks.scene.stage import DICTIONARY, MARKERS, VIEWPOINT, Stage

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds.contracts.plant import Touch
    from lsds_mocks.cell.cell import SimulatedCell
    from lsds_mocks.devices.truth_camera_options import TruthCameraOptions

NAME = "mock-truth-camera"


class _Exposure(NamedTuple):
    seq: int
    t_ns: int
    begin: Scene
    end: Scene


class _Shutter:
    """Records the scene at a fixed rate while the cell steps, and keeps exposures until they are superseded."""

    def __init__(self, cell: SimulatedCell[Any], options: TruthCameraOptions, start_ns: int) -> None:
        self._cell = cell
        self._options = options
        self._start_ns = start_ns
        self._seq = 0
        self.waiting: deque[_Exposure] = deque()

    @property
    def next_exposure_ns(self) -> int:
        """Time of the next exposure: its middle."""
        return self._start_ns + round((self._seq + 1) * NS_PER_S / self._options.rate_hz)

    def expose(self, touch: Touch) -> None:
        """Record the scene at `next_exposure_ns`, extrapolated from positions and velocities at the step's end."""
        t_ns, plant = self.next_exposure_ns, self._cell.plant
        late_s = (self._cell.t_ns + self._cell.step_ns - t_ns) / NS_PER_S
        half_s = self._options.exposure_ms * 1e-3 / 2

        def scene(offset_s: float) -> Scene:
            back = late_s - offset_s
            arm = plant.arm.position_m - back * plant.arm.velocity_m_s
            return Scene(t_ns + nanoseconds(offset_s), arm, plant.object_height_m - back * plant.object_velocity_m_s)

        self.waiting.append(_Exposure(self._seq, t_ns, scene(-half_s), scene(half_s)))
        self._seq += 1
        self.newest(t_ns)

    def newest(self, now_ns: int) -> _Exposure | None:
        """Return the newest readable exposure, and drop older ones."""
        latency_ns = nanoseconds(self._options.latency_ms * 1e-3)
        while len(self.waiting) >= 2 and self.waiting[1].t_ns + latency_ns <= now_ns:
            self.waiting.popleft()
        return self.waiting[0] if self.waiting and self.waiting[0].t_ns + latency_ns <= now_ns else None


class MockTruthCamera(MotionlessLife):
    """A `PoseSource` in the simulated cell: bodies "gripper" and "object", base <- marker."""

    def __init__(self, options: TruthCameraOptions, context: BuildContext) -> None:
        from lsds.calibration.vision.fiducials import FiducialFinder, Marker

        self._options = options
        self._cell = shared_cell(context, NAME)
        self._clock = context.clock
        self._guard = LifecycleGuard(NAME)
        self._stage = Stage(options.width, options.height, context.rng_seed("truth camera"), noise=options.noise)
        markers = {body: {number: Marker(size * 1e-3)} for body, (number, size) in MARKERS.items()}
        self._finder = FiducialFinder(self._stage.camera, DICTIONARY, markers)
        self._shutter: _Shutter | None = None
        self._shown: PoseSample | None = None

    def connect(self) -> None:
        """Start exposing."""
        with self._guard.connecting():
            now = self._clock.now()
            self._cell.advance(now)
            self._shutter = _Shutter(self._cell, self._options, now)
            self._cell.watch(self._shutter)

    def close(self) -> None:
        """Stop exposing."""
        with self._guard.closing():
            if self._shutter is not None:
                self._cell.unwatch(self._shutter)

    def read(self) -> PoseSample:
        """Return the poses in the newest readable picture. Raises StaleData before the first one or if too old."""
        self._guard.require_readable()
        now = self._clock.now()
        self._cell.advance(now)
        exposure = self._shutter.newest(now) if self._shutter else None
        if exposure is None:
            raise StaleData(NAME, "no picture has arrived yet", remedy="wait for the first and read again")
        age_ms = (now - exposure.t_ns) / 1e6
        if age_ms > self._options.stale_after_ms:
            raise StaleData(NAME, f"the newest picture is {age_ms:.0f} ms old")
        if self._shown is None or self._shown.seq != exposure.seq:
            self._shown = self._look(exposure)
        return self._shown

    def _look(self, exposure: _Exposure) -> PoseSample:
        image = self._stage.render(exposure.begin, exposure.end, exposure.seq)
        found = self._finder.find(image, exposure.t_ns)
        poses = {
            body: pose_of(
                np.asarray(VIEWPOINT.rotation @ seen.rotation),
                VIEWPOINT.rotation @ seen.position_m + VIEWPOINT.position_m,
            )
            for body, seen in found.items()
        }
        return PoseSample(exposure.t_ns, exposure.seq, poses)
