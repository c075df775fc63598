"""The sources of views for `lsds calibrate camera`: pictures, videos, live cameras."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click
import cv2
import numpy as np

from lsds.calibration.vision.board_views import View, is_new
from lsds.clock import WallClock, nanoseconds
from lsds.errors import ConnectFailed, DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.calibration.vision.board_views import BoardFinder

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


class Found(NamedTuple):
    """The views used, and the number of pictures searched."""

    views: list[View]
    looked: int


def collect(finder: BoardFinder, sources: Sequence[str], *, most: int, live_s: float) -> Found:
    """Find the board in all sources. Every picture gives a view; a video or live camera only those that differ.

    Raises DataError for a source that cannot be read, ConnectFailed for a camera that cannot be opened.
    """
    views: list[View] = []
    looked = 0
    for source in sources:
        pictures = _pictures(source)
        moving = pictures is None
        images = _moving(source, live_s) if pictures is None else _still(pictures)
        for name, image in images:
            looked += 1
            view = finder.find(image, name)
            if view is None or (moving and not is_new(view, views, image.shape[1])):
                continue
            views.append(view)
            if moving:
                click.echo(f"view {len(views)}: {len(view.pixels)} corners ({name})", err=True)
            if len(views) >= most:
                return Found(views, looked)
    return Found(views, looked)


def _pictures(source: str) -> list[Path] | None:
    """Return the pictures that a source names, None if it is a video or a camera. Raises DataError."""
    path = Path(source).expanduser()
    if path.is_dir():
        found = sorted(p for p in path.iterdir() if p.suffix.lower() in PICTURES)
    elif path.suffix.lower() in PICTURES and any(letter in path.name for letter in "*?["):
        found = sorted(path.parent.glob(path.name))
    elif path.suffix.lower() in PICTURES and "://" not in source:
        found = [path]
    else:
        return None
    if not found:
        raise DataError(f"{source}: no pictures found (searched for {', '.join(PICTURES)})")
    return found


def _still(pictures: Sequence[Path]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    for path in pictures:
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise DataError(f"{path}: cannot be read as a picture; check that the file exists and is complete")
        yield str(path), np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)


def _moving(source: str, live_s: float) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    clock = WallClock()
    is_file = Path(source).expanduser().is_file()
    if re.fullmatch(r"\d+", source):
        capture = cv2.VideoCapture(int(source))
    else:
        capture = cv2.VideoCapture(str(Path(source).expanduser()) if is_file else source)
    deadline = clock.now() + nanoseconds(live_s)
    number = 0
    try:
        if not capture.isOpened():
            raise ConnectFailed(
                f"camera {source}",
                "cannot be opened",
                remedy="check the name: a picture, video, index, /dev/videoN or URL",
            )
        while is_file or clock.now() < deadline:
            good, image = capture.read()
            if not good:
                break
            yield f"{source}#{number}", np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)
            number += 1
    finally:
        capture.release()
