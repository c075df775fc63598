"""What a learner may look at in a frame: the features, the evidence of sliding, and nuisances that must tell nothing.

One vector of named signals a frame, the same from a recording, from the simulated cell and inside the running loop.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.tactile.feature_sets import FEATURE_SETS, FEATURES
from lsds.tactile.slip_residual import slip_residual

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Observation

EVIDENCE: dict[str, tuple[str, str]] = {
    "residual_along": ("m/s", "RMS residual of the smooth motion along the shear"),
    "residual_across": ("m/s", "the same across the shear"),
    "residual_excess": ("m/s", "root of the excess of the one's square over the other's"),
    "rigid_speed": ("m/s", "speed of the best rigid motion of the markers in contact"),
    "rim_speed": ("m/s", "its rotation, at the radius of gyration"),
    "shear_x": ("m", "mean displacement of the markers in contact, x"),
    "shear_y": ("m", "the same, y"),
    "shear": ("m", "its norm"),
    "twist": ("rad", "rotation of the displacements of the markers in contact"),
    "contact_share": ("1", "share of the markers that are in contact"),
}
"""Signals of `lsds.tactile.slip_residual`, by name: unit and meaning."""

NUISANCES: dict[str, tuple[str, str]] = {
    "kept": ("1", "share of the markers that were followed"),
    "markers": ("1", "dots of the reference"),
    "brightness": ("levels", "mean grey level of the frame"),
    "dt": ("s", "measured interval to the frame before"),
}
"""What must not tell slip from stick: a model of these alone is shown beside every other."""

UNITS: dict[str, str] = (
    {feature.name: feature.unit for feature in FEATURES}
    | {name: unit for name, (unit, _) in EVIDENCE.items()}
    | {name: unit for name, (unit, _) in NUISANCES.items()}
)
"""Every signal's SI unit, in the order of the vector."""

SIGNALS: tuple[str, ...] = tuple(UNITS)

_FIELD = (
    "residual_along", "residual_across", "residual_excess", "rigid_speed", "rim_speed", "shear", "twist", "area",
    "mean_speed", "v_net", "angular_velocity", "div_mean_rate", "curl_mean_rate", "area_rate",
)  # fmt: skip

SIGNAL_SETS: dict[str, tuple[str, ...]] = {
    **FEATURE_SETS,
    "field": _FIELD,
    "signed-field": (*_FIELD, "shear_x", "shear_y", "v_x", "v_y"),
    "nuisance": tuple(NUISANCES),
}
"""The paper's sets; `field`: evidence of sliding without a direction; `signed-field`: with it; and the control."""

_LEAST_MARKERS = 6


def signals_of(observation: Observation, brightness: float = math.nan) -> NDArray[np.float32]:
    """Return all signals (S,) of a frame, NaN where undefined, in the order of `SIGNALS`."""
    values = np.empty(len(SIGNALS), np.float32)
    features = observation.features.values
    values[: len(features)] = features
    evidence = slip_residual(observation, "quadratic", _LEAST_MARKERS)
    field = observation.field
    count = field.reference.count
    at = len(features)
    if evidence is None:
        values[at : at + len(EVIDENCE)] = np.nan
    else:
        x, y = evidence.shear_m
        values[at : at + len(EVIDENCE)] = (
            math.sqrt(evidence.along),
            math.sqrt(evidence.across),
            math.sqrt(evidence.excess),
            math.sqrt(evidence.translation),
            math.sqrt(evidence.rim),
            x,
            y,
            math.hypot(x, y),
            evidence.twist_rad,
            evidence.markers / count,
        )
    kept = float(np.count_nonzero(field.valid)) / count
    values[at + len(EVIDENCE) :] = (kept, count, brightness, observation.dt_s)
    return values


def signal_indices(names: str | tuple[str, ...] | list[str]) -> list[int]:
    """Return where a set's signals, or named ones, stand in the vector. Raises DataError for an unknown name."""
    if isinstance(names, str):
        if names not in SIGNAL_SETS:
            raise DataError(f"unknown set of signals {names!r}; there are {', '.join(SIGNAL_SETS)}")
        names = SIGNAL_SETS[names]
    unknown = [name for name in names if name not in UNITS]
    if unknown:
        raise DataError(f"unknown signal {', '.join(unknown)}; there are {', '.join(SIGNALS)}")
    return [SIGNALS.index(name) for name in names]
