"""Mock GelSight Mini: renders images of the shared plant's gel when they are read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lsds.clock import NS_PER_S
from lsds.contracts import Frame, SensorSpec
from lsds.contracts.lifecycle import LifecycleGuard, MotionlessLife
from lsds.errors import StaleData
from lsds_mocks.cell.build import shared_cell
from lsds_mocks.devices.look import look_of
from lsds_mocks.devices.shutter import Shutter, Snapshot
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX, shape_of
from lsds_mocks.optics.renderer import Renderer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds_mocks.devices.gelsight_options import GelSightOptions
    from lsds_mocks.gel.state import GelState

NAME = "mock-gelsight-mini"


@dataclass(frozen=True, slots=True, eq=False)
class MarkerTruth:
    """Exact marker centres at an instant: displaced `xy_px` and undeformed `rest_px`, both (N, 2).

    They are in pixels of the sensor's image, row by row of the pad. `contact_fraction` is the part of the image that
    the object touches.
    """

    t_ns: int
    seq: int
    xy_px: NDArray[np.float64]
    rest_px: NDArray[np.float64]
    contact_fraction: float


class MockGelSightMini(MotionlessLife):
    """A `TactileSensor` on either finger of the simulated cell; `lsds_mocks.optics.renderer` describes their views."""

    def __init__(self, options: GelSightOptions, context: BuildContext) -> None:
        self.options = options
        self.cell = shared_cell(context, NAME)
        self._clock = context.clock
        # The left finger's streams have no suffix, so that a rig with one sensor keeps its random numbers.
        own = "" if options.finger == "left" else f" {options.finger}"
        self._seed = context.rng_seed(f"gelsight timing{own}")
        self._guard = LifecycleGuard(NAME)
        self._renderer = Renderer(look_of(options), context.rng_seed(f"gelsight gel{own}"), options.finger)
        self._shutter: Shutter | None = None
        self._shown: tuple[Snapshot, Frame] | None = None
        self._image: tuple[tuple[int, int], NDArray[np.uint8]] | None = None

    @property
    def spec(self) -> SensorSpec:
        """Image size, rate, scale, pad."""
        pad = None if self.options.pad == "none" else shape_of(self.options.pad)
        return SensorSpec(
            WIDTH_PX,
            HEIGHT_PX,
            self.options.rate_hz,
            self._renderer.metres_per_px,
            pad,
            latency_s=self.options.latency_ms * 1e-3,
        )

    def connect(self) -> None:
        """Start exposing."""
        with self._guard.connecting():
            now = self._clock.now()
            self.cell.advance(now)
            self._shutter = Shutter(self.options, now, self._seed)
            self.cell.watch(self._shutter)
            # Making the gel's matrices takes ten milliseconds, for which the first frame should not wait.
            self._renderer.prepare()
            self._renderer.markers(self.cell.plant.gel, self.cell.gel_state())

    def close(self) -> None:
        """Stop exposing."""
        with self._guard.closing():
            if self._shutter is not None:
                self.cell.unwatch(self._shutter)

    def read(self) -> Frame:
        """Return the newest readable frame. Raises StaleData before the first frame and when the newest is too old."""
        self._guard.require_readable()
        now = self._clock.now()
        self.cell.advance(now)
        snapshot = self._shutter.newest(now) if self._shutter else None
        if snapshot is None:
            raise StaleData(NAME, "no frame has arrived yet", remedy="wait for the first frame and read again")
        age_ms = (now - snapshot.t_ns) / 1e6
        if age_ms > self.options.stale_after_ms:
            raise StaleData(NAME, f"the newest frame is {age_ms:.0f} ms old", remedy="check the camera and its cable")
        if self._shown is None or self._shown[0] is not snapshot:
            self._shown = (snapshot, self._render(snapshot))
        return self._shown[1]

    def marker_truth(self, seq: int | None = None) -> MarkerTruth:
        """Return exact markers of the last frame read, or of frame `seq` while it is among the last 64 exposed.

        Raises LookupError if there is no such frame.
        """
        snapshot = self._shown[0] if self._shown is not None and seq is None else None
        if snapshot is None and self._shutter is not None:
            snapshot = next((s for s in self._shutter.kept if s.seq == seq), None)
        if snapshot is None:
            raise LookupError(
                f"{NAME}: no frame {'has been read' if seq is None else seq}, so there is no truth about it"
            )
        return self._truth(snapshot.state, snapshot.t_ns, snapshot.seq)

    def _truth(self, state: GelState, t_ns: int, seq: int) -> MarkerTruth:
        gel, scale = self.cell.plant.gel, self._renderer.metres_per_px
        xy = self._renderer.markers(gel, state)
        fraction = gel.contact_fraction(state, WIDTH_PX * scale, HEIGHT_PX * scale)
        return MarkerTruth(t_ns, seq, xy, self._renderer.rest_px.copy(), fraction)

    def _render(self, snapshot: Snapshot) -> Frame:
        if self._image is None or self._image[0] != snapshot.image_of:
            t_ns, seq = snapshot.image_of
            gel = self.cell.plant.gel
            xy = self._renderer.markers(gel, snapshot.state)
            self._image = (
                snapshot.image_of,
                self._renderer.render(gel, snapshot.state, xy, t_ns / NS_PER_S, seq),
            )
        return Frame(self._image[1], snapshot.t_ns, snapshot.seq)
