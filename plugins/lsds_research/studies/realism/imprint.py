"""The imprint's relief in a clip: how much of it there is at each size, and how it lasts from frame to frame."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import cv2
import numpy as np
from lsds_research.perceived import perceived

from lsds.calibration.watched import MOVING_PX
from lsds.errors import DataError
from lsds.tactile.imprint.motion import carried_gel
from lsds.tactile.imprint.relief import ReliefMaker
from lsds.tactile.imprint.residue import DotResidue

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from lsds.contracts import ContactPatch, DeformationField
    from lsds.contracts.study import Value
    from lsds.runtime.engine import Engine
    from lsds.tactile.imprint.relief import Relief

    Plane = NDArray[np.float32]

EDGES_PER_MM = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Octave bands, cycles per mm. Beyond the last lies less than two pixels of the relief."""
BANDS = tuple(itertools.pairwise(EDGES_PER_MM))
EVERY = 3
"""One frame in so many has its spectrum taken."""
RIM = 5
"""The rim of a contact is a step of the surface, not its relief: so many px of the relief about it are left out."""
LEAST_PX = 250
"""Fewer px of the relief, off the dots, say nothing of the coarsest band."""
PLACES = ("contact", "free")
MOTIONS = ("still", "moving")
QUARTILES = (25, 50, 75)
Row = dict[str, float]
"""One clip: RMS curvature (1/mm) by place and band, correlation by motion; what it does not show is absent."""


def band_name(band: tuple[float, float]) -> str:
    """Return how a table names a band."""
    return f"{band[0]:g} to {band[1]:g}"


def relief_row(path: Path) -> Row:
    """Return one clip's figures, medians over its frames; a clip counts as far as it can be followed.

    One that begins with an object held has none: what is in contact is known only relative to the first frame. It is
    told by the field's largest divergence, which is negative, as an object that is let go closes the gel.
    `contact BAND` and `free BAND`: RMS curvature in a band, inside the contact and beside it. `kept still` and `kept
    moving`: correlation of the relief inside the contact with the one a frame later, moved along with the gel, where
    the dots move by less or more than `MOVING_PX`.
    """
    values: dict[str, list[float]] = {}
    opened: list[float] = [0.0]
    try:
        for key, value in _measured(perceived(path), opened):
            values.setdefault(key, []).append(value)
    except DataError:
        pass
    if max(opened, key=abs) < 0:
        return {}
    return {key: float(np.median(each)) for key, each in values.items()}


def relief_table(sides: Mapping[str, Sequence[Row]]) -> list[dict[str, Value]]:
    """Return rows of quartiles over the clips of each side; None where no clip shows it."""
    keys = [(f"{place} {band_name(band)}", place, band_name(band)) for place in PLACES for band in BANDS]
    keys += [(f"kept {motion}", f"kept, {motion}", "") for motion in MOTIONS]
    table: list[dict[str, Value]] = []
    for key, what, band in keys:
        for of, rows in sides.items():
            values = [row[key] for row in rows if key in row]
            told = np.percentile(values, QUARTILES).tolist() if values else [None] * len(QUARTILES)
            quartiles = {f"p{q}": value for q, value in zip(QUARTILES, told, strict=True)}
            table.append({"relief": what, "cycles_per_mm": band, "of": of, "clips": len(values), **quartiles})
    return table


def spectrum(relief: Relief, mask: NDArray[np.bool_], mm_per_px: float) -> NDArray[np.float64]:
    """Return the RMS curvature (1/mm) of each band inside a mask (h, w), by its Fourier transform.

    What a mask leaves out counts as flat: its outline spreads a little of each band to its neighbours.
    """
    weight = np.where(mask, relief.weight, 0).astype(np.float64)
    total = weight.sum()
    curvature = relief.curvature / mm_per_px
    shown = (curvature - (curvature * weight).sum() / total) * weight
    power = np.abs(np.fft.fft2(shown)) ** 2 / (shown.size * (weight**2).sum())
    down, across = (np.fft.fftfreq(count, mm_per_px) for count in shown.shape)
    frequency = np.hypot(down[:, None], across[None, :])
    return np.array([np.sqrt(power[(frequency >= low) & (frequency < high)].sum()) for low, high in BANDS])


def kept(
    first: Relief, second: Relief, mask: NDArray[np.bool_], before: DeformationField, now: DeformationField, px_m: float
) -> tuple[float, bool] | None:
    """Return the correlation of two reliefs inside a mask, the second brought back by the gel's motion, and whether the
    dots move; None where they do not tell how.
    """
    gel = carried_gel(before, now, px_m) if before.reference is now.reference else None
    if gel is None:
        return None
    rows, columns = np.mgrid[: mask.shape[0], : mask.shape[1]].astype(np.float32)
    motion = gel.everywhere(mask.shape, first.scale)
    there = columns + motion[..., 0], rows + motion[..., 1]
    shown, weight = (cv2.remap(plane, *there, cv2.INTER_LINEAR) for plane in (second.curvature, second.weight))
    both = np.where(mask, first.weight * weight, 0)
    own, other = float((both * first.curvature**2).sum()), float((both * shown**2).sum())
    if own <= 0 or other <= 0:
        return None
    return float((both * first.curvature * shown).sum()) / np.sqrt(own * other), gel.fastest_px > MOVING_PX


def _measured(engine: Engine, opened: list[float]) -> Iterator[tuple[str, float]]:
    """Yield values by their keys; add each frame's divergence to `opened`."""
    maker, residue, known = ReliefMaker(), None, None
    last: tuple[int, Relief, NDArray[np.bool_], DeformationField] | None = None
    for cycle in engine:
        observation, number = cycle.observation, cycle.frame.seq
        field, px_m = observation.field, engine.perception.metres_per_px
        opened.append(float(np.nan_to_num(observation.features["div_mean"])))
        reference, image = engine.perception.reference, engine.perception.reference_frame
        if reference is not None and image is not None and reference is not known:
            residue, known = DotResidue(reference, maker.relief(image), px_m), reference
        relief = maker.relief(observation.frame or cycle.frame)
        relief = relief if residue is None else residue.taken_off(relief, field)
        if observation.contact is None:
            continue
        places = _places(observation.contact, relief)
        for place, mask in zip(PLACES, places, strict=True):
            if number % EVERY == 0 and np.count_nonzero(mask & (relief.weight > 0)) >= LEAST_PX:
                for band, rms in zip(BANDS, spectrum(relief, mask, relief.scale * px_m * 1e3), strict=True):
                    yield f"{place} {band_name(band)}", float(rms)
        touched = places[0]
        if last is not None and last[0] == number - 1:
            both = touched & last[2]
            if np.count_nonzero(both & (relief.weight > 0)) >= LEAST_PX:
                found = kept(last[1], relief, both, last[3], field, px_m)
                if found is not None:
                    yield f"kept {MOTIONS[found[1]]}", found[0]
        last = number, relief, touched, field


def _places(contact: ContactPatch, relief: Relief) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where a relief is well inside the contact, and where well beside it, (h, w) each."""
    size = relief.curvature.shape[::-1]
    depth = cv2.resize(contact.depth_m, size, interpolation=cv2.INTER_LINEAR)
    touched = np.asarray(depth > contact.threshold_m, np.uint8)
    inside = cv2.erode(touched, _AROUND, borderType=cv2.BORDER_REPLICATE)
    return inside > 0, cv2.dilate(touched, _AROUND) == 0


_AROUND = np.ones((2 * RIM + 1, 2 * RIM + 1), np.uint8)
