"""Validate the values that algorithms return: a wrong type or a NaN raises an error that names the plugin.

Validation takes about a microsecond per frame.
"""

from __future__ import annotations

import math
from dataclasses import replace
from numbers import Real

import numpy as np

from lsds.contracts import Detection, MarkerTracks, SlipEstimate
from lsds.errors import PluginError


def validated_tracks(who: str, tracks: object, count: int, seq: int) -> MarkerTracks:
    """Return the validated tracks. Raises PluginError for another type, or another number of markers than `count`."""
    if not isinstance(tracks, MarkerTracks):
        raise _wrong(who, tracks, "MarkerTracks", seq)
    shapes = tuple(np.shape(part) for part in (tracks.xy_px, tracks.valid, tracks.flags))
    if shapes != ((count, 2), (count,), (count,)):
        got = ", ".join(map(str, shapes))
        raise PluginError(
            f"{who}, frame {seq}: update() returned xy_px, valid, flags of {got} for {count} markers "
            "(one row for each marker of the reference, in its order)"
        )
    if not isinstance(tracks.valid, np.ndarray) or tracks.valid.dtype != np.bool_:
        raise PluginError(f"{who}, frame {seq}: valid is not an array of bool (compare, or use astype(bool))")
    # The sum is NaN or infinite if any position is.
    if not math.isfinite(np.asarray(tracks.xy_px)[tracks.valid].sum()):
        raise PluginError(f"{who}, frame {seq}: a valid marker has no finite position (flag it as lost)")
    return tracks


def validated_detection(who: str, detection: object, seq: int) -> Detection:
    """Return the validated detection. Raises PluginError for another type, or for a decision whose score is NaN."""
    if not isinstance(detection, Detection):
        raise _wrong(who, detection, "Detection", seq)
    if detection.slip is None:
        return detection
    if not isinstance(detection.slip, bool | np.bool_):
        raise PluginError(f"{who}, frame {seq}: slip is {detection.slip!r}, not True, False or None")
    if math.isnan(detection.score):
        raise PluginError(f"{who}, frame {seq}: the score of a decision is NaN (abstain: slip=None)")
    # NumPy's truth is not `False`, for which fusion and controllers look.
    return detection if isinstance(detection.slip, bool) else replace(detection, slip=bool(detection.slip))


def validated_estimate(who: str, estimate: object, seq: int) -> SlipEstimate:
    """Return the validated estimate. Raises PluginError for another type, or for a speed that is not finite."""
    if not isinstance(estimate, SlipEstimate):
        raise _wrong(who, estimate, "SlipEstimate", seq)
    if estimate.abstained:
        return estimate
    x, y = estimate.velocity_m_s
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(estimate.speed_m_s)):
        raise PluginError(f"{who}, frame {seq}: the slip speed is NaN or infinite (abstain: return ABSTAINED)")
    return estimate


def validated_aperture(who: str, aperture_m: object) -> float | None:
    """Return the validated aperture (m), or None. Raises PluginError for anything else, and for NaN or infinity."""
    if aperture_m is None:
        return None
    if not isinstance(aperture_m, Real) or isinstance(aperture_m, bool):
        raise PluginError(f"{who}: update() returned {type(aperture_m).__name__}, not an aperture in metres or None")
    if not math.isfinite(aperture_m):
        raise PluginError(f"{who}: update() returned {aperture_m} (return None to leave the gripper as it is)")
    return float(aperture_m)


def _wrong(who: str, answer: object, expected: str, seq: int) -> PluginError:
    return PluginError(f"{who}, frame {seq}: update() returned {type(answer).__name__}, not {expected}")
