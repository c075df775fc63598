"""Features of the deformation field, frame by frame: causal, streaming, resettable.

Nearly all are linear in the displacements, so one matrix product per frame yields them. Rates divide by the measured
interval. An undefined feature, such as a rate on the first frame, is NaN, never zero.

The entropy is Shannon's, of the histogram of displacement norms (Yuan 2015, Hu 2023) with fixed bins. Bins are `BIN_M`
wide from zero; the last of `ENTROPY_BINS` is open. Natural logarithm: H lies in [0, log(number of markers)].
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import FeatureVector
from lsds.tactile.differential import gradient_operators
from lsds.tactile.feature_sets import NAMES
from lsds.tactile.lost_markers import fill_lost
from lsds.tactile.plane_motion import as_complex

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import ContactPatch, DeformationField, MarkerReference
    from lsds.tactile.lost_markers import FilledField

#: Minimum share of the reference's markers that must be valid; with fewer, the field's features are undefined.
LEAST_VALID = 0.5
#: Width of a bin, m: half a pixel of the GelSight Mini (0.0625 mm per pixel).
BIN_M = 31.25e-6
#: Number of bins.
ENTROPY_BINS = 64
#: Counts whose n log n is tabulated; a dense tracker has up to 60 x 80 points.
_COUNTS = np.arange(1, 8193)
_N_LOG_N = np.concatenate([[0.0], _COUNTS * np.log(_COUNTS)])


class FeatureExtractor:
    """Computes feature vectors from fields; keeps the last values for the rates."""

    def __init__(self) -> None:
        self._operators: _Operators | None = None
        self.reset()

    def start(self, reference: MarkerReference, position_m: NDArray[np.float64]) -> None:
        """Prepare the matrices for markers at rest at `position_m` (N, 2), so that the first frame is not delayed."""
        self._operators = _Operators(reference, position_m)
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: _Shape | None = None
        self._last_area, self._area_s, self._area_rate = math.nan, 0.0, math.nan
        self._contact: ContactPatch | None = None
        self._last_theta = math.nan

    def extract(
        self, field: DeformationField, contact: ContactPatch | None, filled: FilledField | None = None
    ) -> FeatureVector:
        """Return all features of the frame, in the order of `feature_sets.NAMES`.

        `filled` is the field without holes (`fill_lost`), if the caller knows it.
        """
        if self._operators is None or self._operators.reference is not field.reference:
            self._operators = _Operators(field.reference, field.position_m)
        dt = field.dt_s
        now = self._operators.shape(field, filled)
        last = self._last if self._last is not None else _UNDEFINED
        v_x, v_y, mean_speed = _velocity(field, now, last)
        theta = math.atan2(v_y, v_x) if v_x or v_y else math.nan
        area = math.nan if contact is None else contact.area_fraction
        area_rate = self._rate_of_area(contact, area, dt)
        count = self._operators.count
        log2n = math.log2(count)
        values = (
            v_x,
            v_y,
            math.hypot(v_x, v_y),
            now.div_sum,
            now.curl_sum,
            (now.div_sum - last.div_sum) / dt,
            (now.curl_sum - last.curl_sum) / dt,
            area,
            area_rate,
            now.entropy,
            (now.entropy - last.entropy) / dt,
            mean_speed,
            now.div_sum / self._operators.terms,
            now.curl_sum / self._operators.terms,
            (now.div_sum - last.div_sum) / self._operators.terms / dt,
            (now.curl_sum - last.curl_sum) / self._operators.terms / dt,
            now.div_affine,
            now.curl_affine,
            now.curl_affine / 2,
            (now.curl_affine - last.curl_affine) / 2 / dt,
            now.mean_norm,
            log2n * now.mean_norm,
            log2n * (now.mean_norm - last.mean_norm),
            theta,
            math.remainder(theta - self._last_theta, math.tau),
        )
        self._last, self._last_theta = now, theta
        return FeatureVector(NAMES, np.array(values))

    def _rate_of_area(self, contact: ContactPatch | None, area: float, dt_s: float) -> float:
        """Return the rate of the contact area (1/s); of a patch that stands for several frames, the last one."""
        self._area_s += dt_s
        if contact is None or contact is not self._contact:
            self._area_rate = (area - self._last_area) / self._area_s
            self._contact, self._last_area, self._area_s = contact, area, 0.0
        return self._area_rate


class _Shape:
    """The features of one frame that do not depend on other frames."""

    __slots__ = (
        "all_valid",
        "curl_affine",
        "curl_sum",
        "div_affine",
        "div_sum",
        "entropy",
        "mean_norm",
        "mean_x",
        "mean_y",
    )

    def __init__(
        self,
        linear: tuple[float, ...] = (math.nan,) * 6,
        mean_norm: float = math.nan,
        entropy: float = math.nan,
        all_valid: bool = False,
    ) -> None:
        self.mean_x, self.mean_y, self.div_sum, self.curl_sum, self.div_affine, self.curl_affine = linear
        self.mean_norm = mean_norm
        self.entropy = entropy
        self.all_valid = all_valid


_UNDEFINED = _Shape()


class _Operators:
    """The linear features of one reference, as rows that act on flattened displacements."""

    def __init__(self, reference: MarkerReference, position: NDArray[np.float64]) -> None:
        self.reference = reference
        self.count = reference.count
        divergence, curl = gradient_operators(reference, position)
        #: Number of markers with a difference quotient, that is of terms in the sums.
        self.terms = max(1, int(np.count_nonzero(np.abs(divergence).sum(axis=1))))
        mean = np.zeros((2, 2 * self.count))
        mean[0, 0::2] = mean[1, 1::2] = 1 / self.count
        # Least-squares gradient: d(x) = t + G (x - c) has G = sum d (x - c)^T [sum (x - c)(x - c)^T]^-1.
        offset = position - position.mean(axis=0)
        weight = offset @ np.linalg.inv(offset.T @ offset)
        div_affine, curl_affine = np.zeros(2 * self.count), np.zeros(2 * self.count)
        div_affine[0::2], div_affine[1::2] = weight[:, 0], weight[:, 1]
        curl_affine[0::2], curl_affine[1::2] = -weight[:, 1], weight[:, 0]
        self._rows = np.ascontiguousarray(
            np.vstack([mean, divergence.sum(axis=0), curl.sum(axis=0), div_affine, curl_affine])
        )

    def shape(self, field: DeformationField, filled: FilledField | None) -> _Shape:
        valid, affine = field.valid, None
        seen = whole = field.displacement_m
        complete = bool(valid.all())
        if not complete:
            if np.count_nonzero(valid) < max(3, LEAST_VALID * self.count):
                return _UNDEFINED
            filled = filled or fill_lost(field)
            whole, affine = filled.displacement_m, filled.affine
            seen = field.displacement_m[valid]
        norm = np.abs(as_complex(seen))
        linear = (self._rows @ whole.ravel()).tolist()
        if affine is not None:
            # The affine pair uses the valid markers; the sums use the field with its holes filled.
            linear[4], linear[5] = affine.divergence, affine.curl
        return _Shape(tuple(linear), float(norm.sum()) / len(norm), displacement_entropy(norm), complete)


def _velocity(field: DeformationField, now: _Shape, last: _Shape) -> tuple[float, float, float]:
    """Return mean velocity (x, y) and mean speed of the markers that are valid in both frames."""
    velocity: NDArray[np.float64] = field.velocity_m_s
    if now.all_valid and last.all_valid:
        speed = float(np.abs(as_complex(velocity)).sum()) / len(velocity)
        return (now.mean_x - last.mean_x) / field.dt_s, (now.mean_y - last.mean_y) / field.dt_s, speed
    both = np.isfinite(velocity[:, 0])
    if now is _UNDEFINED or np.count_nonzero(both) < LEAST_VALID * len(both):
        return math.nan, math.nan, math.nan
    velocity = velocity[both]
    v_x, v_y = velocity.mean(axis=0).tolist()
    return v_x, v_y, float(np.hypot(velocity[:, 0], velocity[:, 1]).mean())


def displacement_entropy(magnitude_m: NDArray[np.float64]) -> float:
    """Return H in nats of displacement norms (N,), all finite; NaN for none. H = log N - (1/N) sum n log n."""
    count = len(magnitude_m)
    if not count:
        return np.nan
    bins = np.minimum(magnitude_m * (1.0 / BIN_M), ENTROPY_BINS - 1).astype(np.intp)
    occupied = np.bincount(bins, minlength=ENTROPY_BINS)
    return max(0.0, math.log(count) - float(_N_LOG_N[occupied].sum()) / count)
