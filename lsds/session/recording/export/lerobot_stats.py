"""Statistics of the features of a dataset, by episode and over all: smallest, greatest, mean, deviation, number.

Images are in [0, 1] by channel, as LeRobot normalizes them (lerobot/datasets/compute_stats.py of LeRobot 0.4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

IMAGES_EVERY = 10
"""Every tenth image counts for the statistics: neighbours differ little, and decoding takes most of the time."""


class Running:
    """Statistics of one feature, without its values."""

    def __init__(self) -> None:
        self._samples = 0
        self._weight = 0.0
        self._mean: Any = 0.0
        self._squares: Any = 0.0
        self._min: Any = np.inf
        self._max: Any = -np.inf

    def add(self, values: NDArray[Any]) -> None:
        """Take in one sample of (values, components)."""
        found = Running()
        found._samples, found._weight = 1, float(len(values))
        found._mean = values.mean(axis=0, dtype=np.float64)
        found._squares = ((values - found._mean) ** 2).sum(axis=0, dtype=np.float64)
        found._min, found._max = values.min(axis=0), values.max(axis=0)
        self.merge(found)

    def merge(self, other: Running) -> None:
        """Take in the samples of other statistics (Chan, Golub, LeVeque 1979)."""
        weight = self._weight + other._weight
        if not weight:
            return
        apart = other._mean - self._mean
        self._squares = self._squares + other._squares + apart**2 * self._weight * other._weight / weight
        self._mean = self._mean + apart * other._weight / weight
        self._min, self._max = np.minimum(self._min, other._min), np.maximum(self._max, other._max)
        self._weight, self._samples = weight, self._samples + other._samples

    def stated(self, shape: tuple[int, ...]) -> dict[str, Any]:
        """Return the statistics as lists of a shape; `count` is the number of samples."""
        numbers = {
            "min": self._min,
            "max": self._max,
            "mean": self._mean,
            "std": np.sqrt(self._squares / max(self._weight, 1)),
        }
        found = {name: np.asarray(each, float).reshape(shape).tolist() for name, each in numbers.items()}
        return found | {"count": [self._samples]}


class Statistics:
    """The statistics of all features."""

    def __init__(self, features: dict[str, Any]) -> None:
        self._features = features
        self._running = {name: Running() for name in features}

    def add(self, row: dict[str, Any], frame_index: int) -> None:
        """Take in the row of a frame."""
        for name, feature in self._features.items():
            if feature["dtype"] != "image":
                self._running[name].add(np.reshape(np.asarray(row[name], float), (1, -1)))
            elif frame_index % IMAGES_EVERY == 0:
                bgr = cv2.imdecode(np.frombuffer(row[name]["bytes"], np.uint8), cv2.IMREAD_COLOR)
                if bgr is not None:
                    self._running[name].add(bgr[:, :, ::-1].reshape(-1, 3) / 255.0)

    def merge(self, other: Statistics) -> None:
        """Take in the statistics of another episode."""
        for name, running in self._running.items():
            running.merge(other._running[name])

    def stated(self) -> dict[str, dict[str, Any]]:
        """Return the statistics by feature and name."""
        shapes = {name: (3, 1, 1) if own["dtype"] == "image" else (-1,) for name, own in self._features.items()}
        return {name: running.stated(shapes[name]) for name, running in self._running.items()}
