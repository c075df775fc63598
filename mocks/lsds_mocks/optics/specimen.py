"""A numbered gel: pitch, markers, brightness and wear, drawn from the measured ranges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

PITCH_X_PX = (32.5, 33.7)
"""Range of the mean marker pitch along x of a 7 x 9 pad, px, pincushion included."""
PITCH_Y_PX = (31.5, 32.9)
"""Range of the mean marker pitch along y of a 7 x 9 pad, px, pincushion included."""
DIAMETER_PX = (11.6, 17.3)
"""Range of the diameter of a marker, px."""
CORE = (0.28, 0.35)
"""Range of the option `dot_core`."""
BLUR_PX = (0.8, 1.0)
"""Range of the blur, px."""
BRIGHTNESS = (0.9, 1.2)
"""Mean level of 240 public recordings over their median, 5th to 95th percentile."""
WEAR = (0.0, 0.3)
"""Not measured."""
_MEAN_PITCH_PX = (32.80, 31.96)
"""Mean marker pitch of the 7 x 9 pad as drawn, pincushion included."""
_SPECKS = 12
"""Maximum number of dust specks on a gel, all present at a wear of 1; chosen."""


@dataclass(frozen=True, slots=True)
class Specimen:
    """Properties of one gel.

    Pitch along x and y, marker core and background are relative to the mean gel; marker diameter and edge blur are in
    pixels. Wear, 0 to 1, is the fraction of markers that have lost ink.
    """

    pitch: tuple[float, float]
    dot_diameter_px: float
    dot_blur_px: float
    dot_core: float
    brightness: float
    wear: float


def draw(number: int) -> Specimen:
    """Return gel `number`, drawn uniformly from the measured ranges."""
    rng = np.random.default_rng([0x6E1, number])

    def between(low_high: tuple[float, float]) -> float:
        return float(rng.uniform(*low_high))

    pitch = between(PITCH_X_PX) / _MEAN_PITCH_PX[0], between(PITCH_Y_PX) / _MEAN_PITCH_PX[1]
    return Specimen(
        pitch=pitch,
        dot_diameter_px=between(DIAMETER_PX),
        dot_blur_px=between(BLUR_PX),
        dot_core=between(CORE),
        brightness=between(BRIGHTNESS),
        wear=between(WEAR),
    )


def ink(count: int, wear: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return each marker's remaining fraction of ink (count,); 0.3 to 0.9 for a worn marker."""
    worn = rng.random(count) < wear
    return np.where(worn, rng.uniform(0.3, 0.9, count), 1.0)


def dust(background: NDArray[np.float32], wear: float, rng: np.random.Generator) -> None:
    """Darken a background (H, W, 3) in place by fixed specks, up to twelve on a worn gel."""
    specks = np.ones((HEIGHT_PX, WIDTH_PX), np.float32)
    for _ in range(rng.binomial(_SPECKS, wear)):
        centre = (int(rng.integers(WIDTH_PX)), int(rng.integers(HEIGHT_PX)))
        cv2.circle(specks, centre, int(rng.integers(1, 3)), float(rng.uniform(0.75, 0.95)), -1)
    background *= cv2.GaussianBlur(specks, (0, 0), 0.8)[..., None]
