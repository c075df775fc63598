"""What a learner may look at in a frame: the features, the evidence of sliding, and nuisances that must tell nothing.

One vector of named signals a frame, the same from a recording, from the simulated cell and inside the running loop.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.tactile.feature_sets import FEATURE_SETS, FEATURES, NAMES
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
    "residual_along",
    "residual_across",
    "residual_excess",
    "rigid_speed",
    "rim_speed",
    "shear",
    "twist",
    "area",
    "mean_speed",
    "v_net",
    "angular_velocity",
    "div_mean_rate",
    "curl_mean_rate",
    "area_rate",
)

_SIGNED_FIELD = (*_FIELD, "shear_x", "shear_y", "v_x", "v_y")

SIGNAL_SETS: dict[str, tuple[str, ...]] = {
    **FEATURE_SETS,
    "field": _FIELD,
    "signed-field": _SIGNED_FIELD,
    "timed-field": (*_SIGNED_FIELD, "dt"),
    "nuisance": tuple(NUISANCES),
}
"""The paper's sets; `field`: evidence of sliding without a direction; `signed-field`: with it; `timed-field`: also
the time between frames; and the control."""

_LEAST_MARKERS = 6


_LARGEST = float(np.finfo(np.float32).max)
_UNDEFINED = (math.nan,) * len(EVIDENCE)


def signals_of(observation: Observation, brightness: float = math.nan) -> NDArray[np.float32]:
    """Return all signals (S,) of a frame, NaN where undefined, in the order of `SIGNALS`."""
    values = (*observation.features.values.tolist(), *_evidence(observation), *_nuisances(observation, brightness))
    return np.array(values, np.float32)


class Picker:
    """Picks named signals out of frames, and works out no more than they need: what the running cell uses."""

    def __init__(self, names: str | Sequence[str]) -> None:
        """`names`: a set's name or signals. Raises DataError for an unknown one, and for the brightness, which a frame
        no longer tells once it is an observation."""
        self.names = signal_names(names)
        if "brightness" in self.names:
            raise DataError("the brightness cannot be had from a frame's observation; it is there as a control only")
        self._evidence = any(name in EVIDENCE for name in self.names)
        self._nuisances = any(name in NUISANCES for name in self.names)
        where = signal_indices(self.names)
        self._pick = itemgetter(*where) if len(where) > 1 else lambda values: (values[where[0]],)
        self._known: tuple[str, ...] | None = None

    def __call__(self, observation: Observation) -> tuple[float, ...] | None:
        """Return the signals (F,) in the order of `names`; None where one of them is undefined.

        Raises DataError where the observation's features are not those of this version.
        """
        features = observation.features
        if features.names is not self._known:
            if features.names != NAMES:
                raise DataError(f"the frame has features {', '.join(features.names[:5])}...; not those of this version")
            self._known = features.names
        values = features.values.tolist()
        if self._evidence:
            values += _evidence(observation)
        elif self._nuisances:
            values += _UNDEFINED
        if self._nuisances:
            values += _nuisances(observation)
        picked: tuple[float, ...] = self._pick(values)
        # One addition a signal instead of one question: what is NaN, infinite or beyond float32 stays so in the sum.
        return picked if -_LARGEST < sum(picked) < _LARGEST else None


def _evidence(observation: Observation) -> tuple[float, ...]:
    evidence = slip_residual(observation, "quadratic", _LEAST_MARKERS)
    if evidence is None:
        return _UNDEFINED
    x, y = evidence.shear_m
    return (
        math.sqrt(evidence.along),
        math.sqrt(evidence.across),
        math.sqrt(evidence.excess),
        math.sqrt(evidence.translation),
        math.sqrt(evidence.rim),
        x,
        y,
        math.hypot(x, y),
        evidence.twist_rad,
        evidence.markers / observation.field.reference.count,
    )


def _nuisances(observation: Observation, brightness: float = math.nan) -> tuple[float, ...]:
    count = observation.field.reference.count
    return float(np.count_nonzero(observation.field.valid)) / count, count, brightness, observation.dt_s


def signal_names(names: str | Sequence[str]) -> tuple[str, ...]:
    """Return a set's signals, or the named ones. Raises DataError for an unknown name, one given twice, or none."""
    if isinstance(names, str):
        if names not in SIGNAL_SETS:
            raise DataError(f"unknown set of signals {names!r}; there are {', '.join(SIGNAL_SETS)}")
        names = SIGNAL_SETS[names]
    unknown = [name for name in names if name not in UNITS]
    if unknown:
        raise DataError(f"unknown signal {', '.join(unknown)}; there are {', '.join(SIGNALS)}")
    if not names or len(set(names)) < len(names):
        raise DataError(f"signals must be named, each once: {', '.join(names) or 'none is'}")
    return tuple(names)


def signal_indices(names: str | Sequence[str]) -> list[int]:
    """Return where a set's signals, or named ones, stand in the vector. Raises DataError for an unknown name."""
    return [SIGNALS.index(name) for name in signal_names(names)]
