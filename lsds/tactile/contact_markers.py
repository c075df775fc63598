"""Which markers sit on the contact patch."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import ContactPatch, MarkerReference


class ContactMarkers:
    """The markers of one reference, and the depth pixel that each rests on."""

    def __init__(self, reference: MarkerReference) -> None:
        self._reference = reference
        self._shape: tuple[int, ...] = ()
        self._pixels: NDArray[np.intp] = np.empty(0, np.intp)

    def in_contact(self, valid: NDArray[np.bool_], contact: ContactPatch | None, least: int) -> NDArray[np.bool_]:
        """Return the mask (N,) of the valid markers at which the gel is pressed beyond the contact threshold.

        If there are fewer than `least`, the contact is too small or too shallow to detect: returns all valid markers.
        """
        if contact is None:
            return valid
        if contact.depth_m.shape != self._shape:
            self._shape = contact.depth_m.shape
            self._pixels = self._at(*contact.depth_m.shape)
        touched = valid & (contact.depth_m.take(self._pixels) > contact.threshold_m)
        return touched if np.count_nonzero(touched) >= least else valid

    def _at(self, rows: int, columns: int) -> NDArray[np.intp]:
        """Return the flat index of each marker's pixel in a depth map."""
        width, height = self._reference.image_size
        column = np.minimum((self._reference.xy_px[:, 0] * (columns / width)).astype(np.intp), columns - 1)
        row = np.minimum((self._reference.xy_px[:, 1] * (rows / height)).astype(np.intp), rows - 1)
        return np.asarray(row * columns + column)
