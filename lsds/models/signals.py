"""The input signals of learners: features, signals of slip in the velocity field, and nuisance controls.

One vector of named signals per frame, identical for a recording, the simulated cell and the running loop.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.tactile.feature_sets import FEATURE_SETS, FEATURES, NAMES
from lsds.tactile.imprint.uncertainty import distance, drift, step_m
from lsds.tactile.slip_residual import slip_residual

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Observation

EVIDENCE: dict[str, tuple[str, str]] = {
    "residual_along": ("m/s", "RMS residual of the smooth motion along the shear"),
    "residual_across": ("m/s", "the same across the shear"),
    "residual_excess": ("m/s", "root of the excess of the first squared over the second squared"),
    "rigid_speed": ("m/s", "speed of the best rigid motion of the markers in contact"),
    "rim_speed": ("m/s", "its rotation, at the radius of gyration"),
    "shear_x": ("m", "mean displacement of the markers in contact, x"),
    "shear_y": ("m", "the same, y"),
    "shear": ("m", "its norm"),
    "twist": ("rad", "rotation of the displacements of the markers in contact"),
    "contact_share": ("1", "fraction of the markers that are in contact"),
    "markers_lost": ("1", "fraction of the markers that were followed in the last frame and are lost in this one"),
}
"""Signals of `lsds.tactile.slip_residual`, by name: unit and meaning."""

IMPRINT: dict[str, tuple[str, str]] = {
    "imprint_distance": ("1", "the imprint's motion against the gel, in standard deviations of an imprint that sticks"),
    "imprint_step": ("m", "how far the imprint's edges have moved against the gel since the last frame, RMS"),
    "imprint_drift": ("1", "what its motions in the last four frames have in common, in standard deviations"),
    "imprint_slip": ("m", "translation of the imprint against the gel since the last frame"),
    "imprint_rim": ("m", "its turn, at the edges' radius of gyration"),
    "imprint_mismatch": ("1", "1 - correlation with the last frame's imprint, at the place to which it was followed"),
    "imprint_regained": ("1", "how much better it matches there than where it would be if it had stuck"),
    "imprint_lost": ("1", "share of its edges that went out of view"),
    "imprint_gain": (
        "1",
        "natural logarithm of the factor by which it became stronger, at its present place",
    ),
    "imprint_growth": ("1", "the same of all edges, wherever they are"),
    "imprint_residual": ("1", "what is left of the imprint's relief, relative to the relief"),
    "gel_step": ("m", "how far the gel has moved under the imprint since the last frame"),
    "dots_step": ("m", "how far the fastest tenth of the dots has moved since the last frame"),
    "residual_step": ("m", "residual_along times the interval since the last frame"),
    "imprint_slip_x": ("m", "imprint_slip along x"),
    "imprint_slip_y": ("m", "imprint_slip along y"),
    "imprint_turn": ("rad", "turn of the imprint against the gel since the last frame"),
    "imprint_v_x": ("m/s", "imprint_slip_x over the interval since the last frame"),
    "imprint_v_y": ("m/s", "the same along y"),
    "imprint_rate": ("rad/s", "imprint_turn over the interval"),
}
"""Signals of `lsds.tactile.imprint`, by name: unit and meaning. Detectors get steps, not rates: what noise makes of
them does not depend on the frame rate. Estimators get rates."""

NUISANCES: dict[str, tuple[str, str]] = {
    "kept": ("1", "fraction of the markers that were tracked"),
    "markers": ("1", "number of markers of the reference"),
    "brightness": ("levels", "mean grey level of the frame"),
    "dt": ("s", "measured interval to the previous frame"),
}
"""Nuisance controls, which must not separate slip from stick: every score is compared with a model of these alone."""

UNITS: dict[str, str] = (
    {feature.name: feature.unit for feature in FEATURES}
    | {name: unit for name, (unit, _) in EVIDENCE.items()}
    | {name: unit for name, (unit, _) in IMPRINT.items()}
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

_SIGNED = ("imprint_slip_x", "imprint_slip_y", "imprint_turn", "imprint_v_x", "imprint_v_y", "imprint_rate")
_IMPRINT = tuple(name for name in IMPRINT if name not in ("residual_step", *_SIGNED))
_IMPRINT_AND_FIELD = (
    *(*_IMPRINT, "residual_step"),
    *("residual_along", "residual_excess", "rigid_speed", "rim_speed", "mean_speed"),
)

SIGNAL_SETS: dict[str, tuple[str, ...]] = {
    **FEATURE_SETS,
    "field": _FIELD,
    "signed-field": _SIGNED_FIELD,
    "timed-field": (*_SIGNED_FIELD, "dt"),
    "imprint": _IMPRINT,
    "imprint-and-dots": (*_IMPRINT, "residual_step"),
    "imprint-and-field": _IMPRINT_AND_FIELD,
    "imprint-field-and-lost": (*_IMPRINT_AND_FIELD, "markers_lost"),
    "timed-field-and-imprint": (
        *(*_SIGNED_FIELD, "dt", "imprint_v_x", "imprint_v_y", "imprint_rate"),
        *("imprint_distance", "imprint_mismatch", "imprint_regained", "imprint_growth", "imprint_residual", "gel_step"),
    ),
    "nuisance": tuple(NUISANCES),
}
"""Named sets: those of the paper; `field`: signals of slip without direction; `signed-field`: with direction;
`timed-field`: also the frame interval; `imprint`: motion of the imprint, without direction; `imprint-and-dots`: both,
in steps; `imprint-and-field`: and rates of the field; `imprint-field-and-lost`: and the markers that are suddenly lost;
`timed-field-and-imprint`: rates of both, with direction; and the control."""

#: Minimum number of markers of a quadratic fit: it has six coefficients per axis.
_LEAST_MARKERS = 6
#: Resolution of an imprint's change, factor; chosen.
_CHANGE_RESOLUTION = 0.01
#: Resolution of an imprint's strength, curvature; chosen.
_STRENGTH_RESOLUTION = 1e-4


_LARGEST = float(np.finfo(np.float32).max)
_UNDEFINED = (math.nan,) * len(EVIDENCE)
_NOT_SEEN = (math.nan,) * len(IMPRINT)


def signals_of(observation: Observation, brightness: float = math.nan) -> NDArray[np.float32]:
    """Return all signals (S,) of a frame, NaN where undefined, in the order of `SIGNALS`."""
    values = (*observation.features.values.tolist(), *_evidence(observation), *_imprint(observation))
    values += _nuisances(observation, brightness)
    return np.array(values, np.float32)


class Picker:
    """Computes named signals of frames, and only what they need; used in the running cell."""

    def __init__(self, names: str | Sequence[str]) -> None:
        """`names`: the name of a set, or signals. Raises DataError for an unknown name, and for the brightness, which
        is not available from an observation."""
        self.names = signal_names(names)
        if "brightness" in self.names:
            raise DataError("the brightness is not available from an observation; it is a control for offline use only")
        self._evidence = any(name in EVIDENCE for name in self.names)
        self._imprint = any(name in IMPRINT for name in self.names)
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
                raise DataError(
                    f"the frame has features {', '.join(features.names[:5])}..., which are not those of this version"
                )
            self._known = features.names
        values = features.values.tolist()
        if self._evidence:
            values += _evidence(observation)
        elif self._imprint or self._nuisances:
            values += _UNDEFINED
        if self._imprint:
            values += _imprint(observation)
        elif self._nuisances:
            values += _NOT_SEEN
        if self._nuisances:
            values += _nuisances(observation)
        picked: tuple[float, ...] = self._pick(values)
        # One addition per signal instead of one check each: NaN, infinity and float32 overflow all propagate to the
        # sum.
        return picked if -_LARGEST < sum(picked) < _LARGEST else None


def _imprint(observation: Observation) -> tuple[float, ...]:
    if observation.imprint is None or (motion := observation.imprint()) is None:
        return _NOT_SEEN
    x, y = motion.slip_m
    dt_s = observation.dt_s if observation.dt_s > 0 else math.nan
    evidence = slip_residual(observation, "quadratic", _LEAST_MARKERS)
    return (
        distance(motion),
        step_m(motion),
        drift(observation.imprint.recent())[0],
        math.hypot(x, y),
        abs(motion.turn_rad) * motion.radius_m,
        1 - motion.match,
        max(0.0, motion.match - motion.stuck_match),
        1 - motion.seen,
        math.log(max(motion.gain, _CHANGE_RESOLUTION)),
        math.log(min(max(motion.grown, _CHANGE_RESOLUTION), 1 / _CHANGE_RESOLUTION)),
        motion.residual / max(motion.strength, _STRENGTH_RESOLUTION),
        math.hypot(*motion.gel_m),
        motion.dots_m,
        math.nan if evidence is None else math.sqrt(evidence.along) * observation.dt_s,
        x,
        y,
        motion.turn_rad,
        x / dt_s,
        y / dt_s,
        motion.turn_rad / dt_s,
    )


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
        observation.lost_share,
    )


def _nuisances(observation: Observation, brightness: float = math.nan) -> tuple[float, ...]:
    count = observation.field.reference.count
    return float(np.count_nonzero(observation.field.valid)) / count, count, brightness, observation.dt_s


def signal_names(names: str | Sequence[str]) -> tuple[str, ...]:
    """Return the signals of a set, or the named ones. Raises DataError for an unknown name, one given twice, or
    none."""
    if isinstance(names, str):
        if names not in SIGNAL_SETS:
            raise DataError(f"unknown set of signals {names!r}; known sets: {', '.join(SIGNAL_SETS)}")
        names = SIGNAL_SETS[names]
    unknown = [name for name in names if name not in UNITS]
    if unknown:
        raise DataError(f"unknown signal {', '.join(unknown)}; known signals: {', '.join(SIGNALS)}")
    if not names or len(set(names)) < len(names):
        raise DataError(f"each signal must be named exactly once, got: {', '.join(names) or 'none'}")
    return tuple(names)


def signal_indices(names: str | Sequence[str]) -> list[int]:
    """Return the indices of a set's signals, or of named ones, in the vector. Raises DataError for an unknown name."""
    return [SIGNALS.index(name) for name in signal_names(names)]
