"""The view in a terminal: images as coloured blocks, the numbers of the grip, stage and warnings."""

from __future__ import annotations

import math
import shutil
import sys
from typing import TYPE_CHECKING, TextIO

import cv2
import numpy as np

from lsds.clock import NS_PER_S, perf_ns
from lsds.contracts import Cycle
from lsds.contracts.events import FramesRead, PosesRead

if TYPE_CHECKING:
    from lsds.contracts import Frame
    from lsds.contracts.events import Published

DRAWN_HZ = 5
"""Drawings per second on a terminal; chosen."""
PLAIN_HZ = 1
"""Lines per second elsewhere (a log file, a pipe); chosen."""
MOST_COLUMNS = 60
"""Maximum width of the image, characters; chosen."""
MOST_ROWS = 16
"""Maximum height of the image, characters; a character is two pixels high; chosen."""
BAR = 20
"""Length of the bar of P(slip), characters."""


class TerminalView:
    """A `View` without any extra. It draws over its last drawing."""

    def __init__(self, stream: TextIO | None = None, columns: int | None = None) -> None:
        """`columns` is the width of the terminal; default: that of the present one."""
        self._stream = sys.stderr if stream is None else stream
        self._live = self._stream.isatty()
        self._columns = columns
        self._drawn_ns = 0
        self._lines = 0
        self._images: dict[str, Frame] = {}
        self._warning = ""

    def observe(self, event: Published) -> None:
        """Take an event; draw a cycle if it is time."""
        if isinstance(event, FramesRead):
            self._images.update(event.frames)
        elif isinstance(event, PosesRead):
            self._warning = event.problem
        elif isinstance(event, Cycle):
            period_ns = NS_PER_S // (DRAWN_HZ if self._live else PLAIN_HZ)
            now_ns = perf_ns()
            if now_ns - self._drawn_ns >= period_ns:
                self._drawn_ns = now_ns
                self._draw(event)

    def close(self) -> None:
        """Leave the last drawing."""
        if self._live:
            self._stream.write("\x1b[0m")
        self._stream.flush()

    def _draw(self, cycle: Cycle) -> None:
        width = self._columns or shutil.get_terminal_size().columns
        text = [line[: max(width - 1, 1)] for line in self._numbers(cycle)]
        if not self._live:
            self._stream.write(" | ".join(self._numbers(cycle)) + "\n")
            self._stream.flush()
            return
        image = _blocks([frame.image for frame in self._images.values()], min(width - 1, MOST_COLUMNS))
        lines = [*image, *(line + "\x1b[K" for line in text)]
        back = f"\x1b[{self._lines}F" if self._lines else ""
        self._stream.write(back + "\n".join(lines) + "\n")
        self._stream.flush()
        self._lines = len(lines)

    def _numbers(self, cycle: Cycle) -> list[str]:
        grip = cycle.grip
        slips = grip.slips
        bar = "" if math.isnan(slips) else "#" * round(BAR * slips) + "." * (BAR - round(BAR * slips))
        speed = "unknown" if cycle.estimate.abstained else f"{100 * cycle.estimate.speed_m_s:.2f} cm/s"
        lines = [
            f"{cycle.t_ns / NS_PER_S:7.2f} s  {cycle.stage}",
            f"P(slip)   {_number(slips, '.2f')} {bar}".rstrip(),
            f"slip      {speed}",
            f"load      {_number(grip.load_n, '.2f')} of {_number(grip.limit_n, '.2f')} N a finger",
            f"aperture  {_number(1e3 * cycle.measured_m, '.2f')} mm",
        ]
        lost = 1 - float(cycle.tracks.valid.mean())
        warning = self._warning or (f"{100 * lost:.0f} % of the markers are lost" if lost > 0.5 else "")
        return [*lines, f"warning: {warning}"] if warning else lines


def _number(value: float, form: str) -> str:
    return "-" if not math.isfinite(value) else format(value, form)


def _blocks(images: list[np.ndarray[tuple[int, ...], np.dtype[np.uint8]]], columns: int) -> list[str]:
    """Return images side by side as lines of half blocks: the colour of the character is the upper pixel."""
    if not images or columns < 2 * len(images):
        return []
    each = columns // len(images)
    small = np.hstack([cv2.resize(image, (each, 2 * MOST_ROWS), interpolation=cv2.INTER_AREA) for image in images])
    lines = []
    for upper, lower in zip(small[::2].tolist(), small[1::2].tolist(), strict=True):
        cells = (
            f"\x1b[38;2;{a[0]};{a[1]};{a[2]};48;2;{b[0]};{b[1]};{b[2]}m\u2580"
            for a, b in zip(upper, lower, strict=True)
        )
        lines.append("".join(cells) + "\x1b[0m\x1b[K")
    return lines
