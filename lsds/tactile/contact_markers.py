"""Which markers sit on the contact patch."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Observation


def markers_in_contact(observation: Observation, least: int) -> NDArray[np.bool_]:
    """Return (N,) the valid markers where the gel is pressed beyond the contact threshold.

    All valid markers where fewer than `least` are: a contact too small, or too shallow to be seen, is no reason to
    look at nothing.
    """
    field, contact = observation.field, observation.contact
    if contact is None:
        return field.valid
    width, height = field.reference.image_size
    rows, columns = contact.depth_m.shape
    column = np.minimum((field.reference.xy_px[:, 0] * (columns / width)).astype(np.intp), columns - 1)
    row = np.minimum((field.reference.xy_px[:, 1] * (rows / height)).astype(np.intp), rows - 1)
    touched = field.valid & (contact.depth_m[row, column] > contact.threshold_m)
    return touched if np.count_nonzero(touched) >= least else field.valid
