"""Deformation field: displacement of the markers against the reference (m), and its rate (m/s)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import DeformationField

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import MarkerReference, MarkerTracks


class FieldBuilder:
    """Computes fields from tracks; keeps the last field for the velocity."""

    def __init__(self, reference: MarkerReference, metres_per_px: float) -> None:
        self._reference = reference
        self._scale = metres_per_px
        width, height = reference.image_size
        centre = np.array([(width - 1) / 2, (height - 1) / 2])
        self._position_m = (reference.xy_px - centre) * metres_per_px
        self._undefined = np.full_like(reference.xy_px, np.nan)
        self.reset()

    @property
    def position_m(self) -> NDArray[np.float64]:
        """Positions (N, 2) of the markers at rest, m from the image's centre."""
        return np.asarray(self._position_m)

    def reset(self) -> None:
        """Forget the last field."""
        self._last: DeformationField | None = None

    def build(self, tracks: MarkerTracks) -> DeformationField:
        """Return the field of the next frame. Velocity uses the measured interval, never a nominal one.

        A duplicate frame (same time stamp) has no interval: its velocity is NaN.
        """
        displacement = (tracks.xy_px - self._reference.xy_px) * self._scale
        last = self._last
        dt = np.nan if last is None else (tracks.t_ns - last.t_ns) * 1e-9
        velocity = self._undefined
        if last is not None and dt > 0:
            velocity = (displacement - last.displacement_m) / dt
        field = DeformationField(
            tracks.t_ns,
            tracks.seq,
            dt if dt > 0 else np.nan,
            self._reference,
            self._position_m,
            displacement,
            velocity,
            tracks.valid,
        )
        self._last = field
        return field
