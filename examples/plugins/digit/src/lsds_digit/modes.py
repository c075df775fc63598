"""Facts about the DIGIT: stream modes, name on USB, orientation, and light.

Documented in Meta's public package digit-interface: the two stream modes with their rates, the product name, that the
camera is mounted on its side, and that the UVC control "zoom" sets the three LEDs. From firmware revision 200 on, that
control takes four bits for each of red, green and blue.

Assumed: the field of view. The paper of Lambeta et al. (2020) shows some 16 mm by 20 mm, but each gel differs.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

Mode = Literal["qvga", "vga"]

MODEL = "DIGIT"
"""Product name on USB."""


class Stream(NamedTuple):
    """One stream mode: size of the camera's picture (px) and rate (Hz). The camera is mounted on its side."""

    width_px: int
    height_px: int
    rate_hz: float


STREAMS: dict[Mode, Stream] = {"qvga": Stream(320, 240, 60.0), "vga": Stream(640, 480, 30.0)}
"""Stream modes with their highest rates (digit-interface)."""
FIELD_MM = 20.0
"""Length of the gel along the long side of the image (mm), assumed."""
BRIGHTEST = 15
"""Greatest intensity of an LED (digit-interface)."""


def led_value(intensity: int) -> int:
    """Return the value of the control that sets all three LEDs to an intensity of 0 to `BRIGHTEST`."""
    return intensity << 8 | intensity << 4 | intensity
