"""Renders the whole image: lit surface, markers, brightness, noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np

from lsds_mocks.optics import grain
from lsds_mocks.optics.background import background
from lsds_mocks.optics.dots import DotPainter
from lsds_mocks.optics.exposure import Brightness
from lsds_mocks.optics.noise import CameraNoise
from lsds_mocks.optics.pad import CENTRE_PX, PadName, dot_positions, scale_of
from lsds_mocks.optics.shading import Shader, Tier
from lsds_mocks.optics.specimen import dust, ink

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.state import GelState


@dataclass(frozen=True, slots=True)
class Look:
    """Appearance of one sensor's images; `pad` is None for a gel without markers.

    `variation` scales the differences between gels. `pitch` (x, y) and `brightness` are relative to the mean gel;
    `wear` is the fraction of markers that have lost ink; `lift_levels` is the extra brightness of pressed gel.
    """

    pad: PadName | None
    mm_per_px: float
    dot_diameter_px: float
    dot_core: float
    dot_blur_px: float
    variation: float
    noise: float
    drift: float
    swing_levels: float
    start_up: bool
    tier: Tier = "linear"
    pitch: tuple[float, float] = (1.0, 1.0)
    brightness: float = 1.0
    wear: float = 0.0
    lift_levels: float = 0.0


Finger = Literal["left", "right"]


class Renderer:
    """Renders gel states for one of the two fingers. Equal state, time and number give a bit-identical image.

    A gel's state is in the left sensor's frame (x right, y down in its image). The fingers face each other, and one
    gel model represents both. The right sensor's image shows the state mirrored about the pad's vertical centre line: a
    displacement (ux, uy) at (x, y) becomes (-ux, uy) at (-x, y). Its lamps and undeformed markers are not mirrored.
    """

    def __init__(self, look: Look, seed: list[int], finger: Finger = "left") -> None:
        self._mirrors = finger == "right"
        self._to_gel = np.array([-1.0 if self._mirrors else 1.0, 1.0])
        print_rng, tint_rng, noise_rng, light_rng, wear_rng = np.random.default_rng(seed).spawn(5)
        self.metres_per_px = scale_of(look.pad, look.mm_per_px) if look.pad else look.mm_per_px * 1e-3
        self.rest_px = np.zeros((0, 2))
        if look.pad:
            self.rest_px = dot_positions(look.pad, look.variation, print_rng, look.pitch)
        self._rest_m = (self.rest_px - CENTRE_PX) * self.metres_per_px * self._to_gel
        self._dots = self._painter(look, ink(len(self.rest_px), look.wear, wear_rng))
        light = background(look.variation, tint_rng, look.brightness)
        dust(light, look.wear, wear_rng)
        self._shader = Shader(
            light, self.metres_per_px, look.tier, lift_levels=look.lift_levels, mirror=self._to_gel[0]
        )
        self._noise = CameraNoise(look.noise, noise_rng)
        self._bare = np.full_like(light, 255, np.uint8)
        self._light = Brightness(look.start_up, look.drift, look.swing_levels, light_rng)

    @staticmethod
    def _painter(look: Look, left: NDArray[np.float64]) -> DotPainter | None:
        if look.pad is None:
            return None
        return DotPainter(look.dot_diameter_px, look.dot_core, look.dot_blur_px, left if look.wear else None)

    def prepare(self) -> None:
        """Load the compiled code, which takes a tenth of a second, so that the first frame does not wait for it."""
        self._shader.lit(np.zeros((len(self._shader.y_m), len(self._shader.x_m)), np.float32))
        if self._dots is not None:
            self._dots.paint(self.rest_px)
        self._noise.photograph(self._bare, self._bare, 1.0, 0)
        grain.prepare()

    def markers(self, gel: GelModel, state: GelState) -> NDArray[np.float64]:
        """Return exact marker centres (N, 2) in pixels."""
        if not len(self.rest_px):
            return self.rest_px.copy()
        moved_m = gel.marker_displacement(state, self._rest_m) * self._to_gel
        return np.asarray(self.rest_px + moved_m / self.metres_per_px)

    def _depth(
        self, gel: GelModel, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        depth = gel.depth(state, x_m, y_m)
        # The image's columns are symmetric about its centre, so that reversing them mirrors the image.
        return np.ascontiguousarray(depth[:, ::-1]) if self._mirrors else depth

    def render(
        self, gel: GelModel, state: GelState, xy_px: NDArray[np.float64], t_s: float, seq: int
    ) -> NDArray[np.uint8]:
        """Return a new image (240, 320, 3) uint8 RGB with markers at `xy_px`."""
        # Gels on cells deform with shear, too; the surface of other gels depends on the indentation only.
        relief = None if gel.grain is None else (gel.grain, state.body)
        key = None if state.fine else (state.indentation_m, state.reach_m, relief)
        lit = self._shader.shade(key, lambda x, y: self._depth(gel, state, x, y), state.indentation_m > 0, relief)
        start = self._light.start(seq)
        if start is not None:
            lit = np.asarray(cv2.transform(lit, np.diag(start)), np.uint8)
        cover = self._bare if self._dots is None else cv2.cvtColor(self._dots.paint(xy_px), cv2.COLOR_GRAY2RGB)
        return self._noise.photograph(lit, np.asarray(cover, np.uint8), self._light.common(t_s), seq)
