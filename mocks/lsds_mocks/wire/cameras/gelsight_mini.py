"""Wire mock of the GelSight Mini: the simulated gel at 25 Hz as MJPEG, at the sensor's picture size."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from lsds.clock import NS_PER_S
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.devices.look import look_of
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX
from lsds_mocks.optics.renderer import Renderer
from lsds_mocks.wire.cameras.links import gel_link
from lsds_mocks.wire.mjpeg.camera import CameraMock

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds_mocks.link.protocols import GelLink
    from lsds_mocks.wire.cameras.options import GelSightMiniOptions

NAME = "gelsight-mini"
CROPPED_SHARE = 0.15
"""Fraction of the sensor's picture that the vendor's software crops on each side."""


class GelView:
    """Renders the gel into a picture of the sensor's size."""

    def __init__(self, options: GelSightMiniOptions, link: GelLink, context: BuildContext) -> None:
        shown = {name: getattr(options, name) for name in ("optics", "gel", "pad", "noise", "dim_start")}
        look = look_of(GelSightOptions(**shown))
        own = "" if options.finger == "left" else f" {options.finger}"
        self._renderer = Renderer(look, context.rng_seed(f"gelsight gel{own}"), options.finger)
        self._renderer.prepare()
        self._link = link
        self._size = (options.width, options.height)

    def picture(self, t_ns: int, seq: int, since_start: int) -> NDArray[np.uint8] | None:
        """Return the sensor's picture, uint8 RGB (height, width, 3)."""
        state = self._link.at(t_ns)
        if state is None:
            return None
        gel = self._link.gel
        xy = self._renderer.markers(gel, state)
        # After the first frames the image depends on the exposure number only; otherwise each new reader would get the
        # same noise.
        number = since_start if since_start < 2 else max(seq, 2)
        return enlarged(self._renderer.render(gel, state, xy, t_ns / NS_PER_S, number), self._size)

    def truth(self, t_ns: int) -> Mapping[str, Any]:
        """Return normal force (N) and indentation (m) of the gel, and whether a part of the contact slides."""
        state = self._link.at(t_ns)
        if state is None:
            return {"moving": False}
        return {
            "normal_n": float(state.normal_force_n),
            "indentation_m": float(state.indentation_m),
            "object": "touches" if state.normal_force_n > 0 else "none",
            "moving": bool(state.slid.any()),
        }

    def close(self) -> None:
        """Give the link back."""
        self._link.close()


def enlarged(image: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a picture of (width, height) px that contains the whole image within the vendor's border."""
    if size == (WIDTH_PX, HEIGHT_PX):
        return image
    width, height = size
    left, top = int(width * CROPPED_SHARE), int(height * CROPPED_SHARE)
    inner = cv2.resize(image, (width - 2 * left, height - 2 * top), interpolation=cv2.INTER_LINEAR)
    return np.asarray(cv2.copyMakeBorder(inner, top, top, left, left, cv2.BORDER_REPLICATE), np.uint8)


def build(options: GelSightMiniOptions, context: BuildContext) -> CameraMock:
    """Return the wire mock `gelsight-mini`. Raises ConfigError for an unsuitable cell."""
    link = gel_link(options, context.clock, context.seed)
    return CameraMock(NAME, options, GelView(options, link, context), seed=context.seed, clock=context.clock)
