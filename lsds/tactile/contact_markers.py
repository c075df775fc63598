"""Which markers sit on the contact patch."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import ContactPatch, MarkerReference, Observation


def markers_in_contact(observation: Observation, least: int) -> NDArray[np.bool_]:
    """Return (N,) the valid markers where the gel is pressed beyond the contact threshold.

    All valid markers where fewer than `least` are: a contact too small, or too shallow to be seen, is no reason to
    look at nothing.
    """
    field, contact = observation.field, observation.contact
    if contact is None:
        return field.valid
    touched = field.valid & (contact.depth_m.take(_pixels(field.reference, contact)) > contact.threshold_m)
    return touched if np.count_nonzero(touched) >= least else field.valid


class _Kept(threading.local):
    """What one thread keeps from frame to frame."""

    last: tuple[MarkerReference, tuple[int, ...], NDArray[np.intp]] | None = None


_kept = _Kept()


def _pixels(reference: MarkerReference, contact: ContactPatch) -> NDArray[np.intp]:
    """Flat index of each marker's depth pixel; the same for every frame of a recording, so it is kept."""
    shape = contact.depth_m.shape
    last = _kept.last
    if last is None or last[0] is not reference or last[1] != shape:
        width, height = reference.image_size
        rows, columns = shape
        column = np.minimum((reference.xy_px[:, 0] * (columns / width)).astype(np.intp), columns - 1)
        row = np.minimum((reference.xy_px[:, 1] * (rows / height)).astype(np.intp), rows - 1)
        last = _kept.last = (reference, shape, row * columns + column)
    return last[2]
