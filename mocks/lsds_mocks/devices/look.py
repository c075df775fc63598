"""Appearance of a sensor's images, from its options and its numbered gel."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds_mocks.optics import specimen
from lsds_mocks.optics.renderer import Look

if TYPE_CHECKING:
    from lsds_mocks.devices.gelsight_options import GelSightOptions


def look_of(options: GelSightOptions) -> Look:
    """Return the appearance. Options that are set take precedence over those of the numbered gel."""
    gel = None if options.gel is None else specimen.draw(options.gel)

    def of_gel(name: str) -> float:
        own = getattr(options, name)
        return float(own if gel is None or name in options.model_fields_set else getattr(gel, name))

    return Look(
        pad=None if options.pad == "none" else options.pad,
        mm_per_px=options.mm_per_px,
        dot_diameter_px=of_gel("dot_diameter_px"),
        dot_core=of_gel("dot_core"),
        dot_blur_px=of_gel("dot_blur_px"),
        variation=options.gel_variation,
        noise=options.noise,
        drift=options.drift,
        swing_levels=options.swing_levels,
        start_up=options.dim_start,
        tier=options.optics,
        pitch=(1.0, 1.0) if gel is None else gel.pitch,
        brightness=of_gel("brightness"),
        wear=of_gel("wear"),
        lift_levels=options.contact_lift_levels,
    )
