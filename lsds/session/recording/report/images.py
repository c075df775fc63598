"""The tactile images of one finger in a page: small, and few enough for the page to stay small."""

from __future__ import annotations

import base64

import cv2
import numpy as np

MOST_CHARACTERS = 14_000_000
"""Most characters of the data URLs of one finger. With the library and the curves, a page of one finger stays below
20 MB."""
WIDTH_PX = 320
"""Width of an image in the page, px. A smaller image keeps its size."""
QUALITY = 50
"""Quality of the JPEG images, 0 to 100: an image of 320 x 240 px takes some 5 kB."""


class ThinnedImages:
    """Keeps every image until they exceed `MOST_CHARACTERS`, then every second, every fourth and so on.

    `t_s` and `urls` are the times (s) and the data URLs of the images that are kept; `step` is 1 while all are kept,
    and n if every n-th is. `unreadable` counts images that could not be decoded.
    """

    def __init__(self) -> None:
        self.t_s: list[float] = []
        self.urls: list[str] = []
        self.step = 1
        self.unreadable = 0
        self._seen = 0
        self._characters = 0

    def add(self, t_s: float, stored: bytes) -> None:
        """Take the next image, a compressed file."""
        number, self._seen = self._seen, self._seen + 1
        if number % self.step:
            return
        url = _url(stored)
        if url is None:
            self.unreadable += 1
            # An empty picture keeps the order, from which the thinning counts.
            url = ""
        self.t_s.append(t_s)
        self.urls.append(url)
        self._characters += len(url)
        while self._characters > MOST_CHARACTERS and len(self.urls) > 1:
            self._halve()

    def _halve(self) -> None:
        self.step *= 2
        del self.t_s[1::2], self.urls[1::2]
        self._characters = sum(map(len, self.urls))

    @property
    def thinning(self) -> str:
        """A sentence on which images are kept."""
        kept = "all images" if self.step == 1 else f"one image in {self.step}"
        return f"{kept}, {len(self.urls)} of {self._seen}; JPEG of quality {QUALITY}, at most {WIDTH_PX} px wide"


def _url(stored: bytes) -> str | None:
    """Return an image as a data URL of a small JPEG; None if it cannot be decoded."""
    try:
        image = cv2.imdecode(np.frombuffer(stored, np.uint8), cv2.IMREAD_COLOR) if stored else None
    except cv2.error:
        return None
    if image is None:
        return None
    height, width = image.shape[:2]
    if width > WIDTH_PX:
        image = cv2.resize(image, (WIDTH_PX, max(1, height * WIDTH_PX // width)), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode("ascii")
