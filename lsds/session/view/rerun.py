"""The view in Rerun: images with markers and field, slip, grip, load and friction limit on one time line."""

from __future__ import annotations

import math
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import WallClock, nanoseconds
from lsds.contracts import Cycle
from lsds.contracts.events import FramesRead, JobStepped, TruthKnown
from lsds.errors import DataError
from lsds.registry.containment import one_line
from lsds.support.extras import require

if TYPE_CHECKING:
    from lsds.contracts import FingerCycle, GripEstimate
    from lsds.contracts.events import Published

TIMELINE = "rig"
"""Name of the time line: the rig's clock."""
VIEWED_JPEG_QUALITY = 80
"""Quality of the images in the viewer."""
DRAWN_STRETCH = 8.0
"""Factor by which displacements are drawn longer than they are."""
VIEWER_PORT = 9876
"""Port of a viewer that is started here: Rerun's default."""
CONNECT_S = 2.0
"""Time within which a viewer that has been started must listen, s; chosen. Rerun itself waits ten seconds before."""
VIEWER_FLUSH_S = 5.0
"""Time limit for sending what waits at the end of a run, s; chosen."""
VALID_COLOUR = (40, 220, 90)
"""Colour of markers that are followed, RGB."""
LOST_COLOUR = (220, 60, 60)
"""Colour of markers that are lost, RGB."""


class RerunView:
    """A `View` in Rerun's viewer or in a file for it."""

    def __init__(self, where: str) -> None:
        """Start, connect to or create what `where` names. Raises MissingExtra, DataError."""
        require("rerun", extra="view", purpose="the view in Rerun")
        import rerun

        self._rr: Any = rerun
        self._stream = rerun.RecordingStream("lsds")
        self._stage = ""
        blueprint = _blueprint()
        if where.endswith(".rrd"):
            path = Path(where)
            if path.exists():
                raise DataError(f"{path}: exists already (choose another name, or remove it)")
            if not path.parent.is_dir():
                raise DataError(f"{path}: no folder {path.parent} (create it)")
            self._stream.save(path, default_blueprint=blueprint)
        elif where == "rerun":
            self._spawn(blueprint)
        else:
            self._stream.connect_grpc(where, default_blueprint=blueprint)

    def observe(self, event: Published) -> None:
        """Send an event to the viewer."""
        if isinstance(event, Cycle):
            self._at(event.t_ns)
            for finger in event.fingers:
                self._finger(finger)
            self._grip(event.grip)
            self._number("aperture/commanded_mm", 1e3 * event.held_m)
            self._number("aperture/measured_mm", 1e3 * event.measured_m)
        elif isinstance(event, FramesRead):
            self._at(event.now_ns)
            for name, frame in event.frames:
                image = self._rr.Image(frame.image).compress(jpeg_quality=VIEWED_JPEG_QUALITY)
                self._stream.log(f"finger/{name}/image", image)
        elif isinstance(event, TruthKnown):
            self._at(event.now_ns)
            self._number("slip/true_cm_s", 100 * math.hypot(*event.truth.slip_velocity_m_s))
            self._number("force/normal_true_n", event.truth.normal_force_n)
        elif isinstance(event, JobStepped) and event.wanted.stage != self._stage:
            self._stage = event.wanted.stage
            self._at(event.now_ns)
            self._stream.log("stages", self._rr.TextLog(f"stage {self._stage}"))

    def close(self) -> None:
        """Send what waits and disconnect. Raises RuntimeError if the viewer does not take it in time."""
        try:
            self._stream.flush(timeout_sec=VIEWER_FLUSH_S)
        finally:
            self._stream.disconnect()

    def _spawn(self, blueprint: Any) -> None:
        """Start Rerun's viewer. Raises DataError if it does not run: without a display it ends at once."""
        remedy = 'write a file instead: --view run.rrd, or connect to a viewer elsewhere: --view "rerun+http://..."'
        try:
            self._stream.spawn(default_blueprint=blueprint)
        except RuntimeError as error:
            raise DataError(f"view: Rerun's viewer cannot be started: {one_line(error)} ({remedy})") from error
        clock = WallClock()
        until_ns = clock.now() + nanoseconds(CONNECT_S)
        while not _listens(VIEWER_PORT):
            if clock.now() > until_ns:
                self._stream.disconnect()
                raise DataError(f"view: Rerun's viewer has not started (no display?); {remedy}")
            clock.sleep_until(clock.now() + nanoseconds(CONNECT_S / 20))

    def _at(self, now_ns: int) -> None:
        self._stream.set_time(TIMELINE, duration=np.timedelta64(now_ns, "ns"))

    def _finger(self, finger: FingerCycle) -> None:
        tracks, field = finger.tracks, finger.observation.field
        known = np.isfinite(tracks.xy_px).all(axis=1)
        xy, valid = tracks.xy_px[known], tracks.valid[known]
        colours = np.where(valid[:, None], VALID_COLOUR, LOST_COLOUR).astype(np.uint8)
        here = f"finger/{finger.finger}/image"
        self._stream.log(f"{here}/markers", self._rr.Points2D(xy, colors=colours, radii=2.0))
        moved = field.displacement_m[known] / field_scale(finger)
        drawn = np.isfinite(moved).all(axis=1)
        arrows = self._rr.Arrows2D(origins=xy[drawn], vectors=DRAWN_STRETCH * moved[drawn], colors=[255, 210, 60])
        self._stream.log(f"{here}/field", arrows)
        self._number(f"finger/{finger.finger}/score", finger.detection.score)

    def _grip(self, grip: GripEstimate) -> None:
        self._number("slip/probability", grip.slips)
        if not grip.estimate.abstained:
            speed, std = grip.estimate.speed_m_s, grip.estimate.speed_std_m_s
            self._number("slip/estimated_cm_s", 100 * speed)
            self._number("slip/estimated_upper_cm_s", 100 * (speed + std))
        self._number("force/load_n", grip.load_n)
        self._number("force/limit_n", grip.limit_n)
        self._number("force/limit_lower_n", grip.limit_n - grip.limit_std_n)

    def _number(self, name: str, value: float) -> None:
        if math.isfinite(value):
            self._stream.log(name, self._rr.Scalars(value))


def _listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), CONNECT_S).close()
    except OSError:
        return False
    return True


def field_scale(finger: FingerCycle) -> float:
    """Return the metres of a pixel in a finger's image, by the pitch of its markers in both units."""
    field = finger.observation.field
    reference = field.reference.xy_px
    metres = field.position_m - field.displacement_m
    if not np.isfinite(metres).all(1).any():
        return math.inf
    pixels, lengths = np.ptp(reference, axis=0).max(), np.nanmax(np.ptp(metres[np.isfinite(metres).all(1)], axis=0))
    return float(lengths / pixels) if pixels > 0 and lengths > 0 else math.inf


def _blueprint() -> Any:
    from rerun import blueprint as rrb

    plots = [rrb.TimeSeriesView(origin=f"/{name}", name=title) for name, title in _PLOTS.items()]
    images = rrb.Vertical(rrb.Spatial2DView(origin="/finger", name="fingers"), rrb.TextLogView(origin="/stages"))
    return rrb.Blueprint(rrb.Horizontal(images, rrb.Vertical(*plots)), collapse_panels=True)


_PLOTS = {
    "slip": "slip: probability, speed in cm/s",
    "force": "load and friction limit, N a finger",
    "aperture": "aperture, mm",
}
"""Time series by their root, with their titles."""
