"""What a brain answers is looked at where it enters: a wrong type or a NaN is an error that names the brain, not a
wrong grip. A microsecond a frame."""

from __future__ import annotations

import math
from numbers import Real

import numpy as np

from lsds.contracts import Detection, MarkerTracks, SlipEstimate
from lsds.errors import PluginError


def sound_tracks(who: str, tracks: object, count: int, seq: int) -> MarkerTracks:
    """Return a tracker's answer. Raises PluginError where it is none, or not of the reference's `count` markers."""
    if not isinstance(tracks, MarkerTracks):
        raise _wrong(who, tracks, "MarkerTracks", seq)
    shapes = tuple(np.shape(part) for part in (tracks.xy_px, tracks.valid, tracks.flags))
    if shapes != ((count, 2), (count,), (count,)):
        told = ", ".join(map(str, shapes))
        raise PluginError(
            f"{who}, frame {seq}: update() returned xy_px, valid, flags of {told} for {count} markers "
            "(one row for each marker of the reference, in its order)"
        )
    # A sum is NaN where any number is; infinite positions are as bad.
    if not math.isfinite(float(np.sum(tracks.xy_px, where=tracks.valid[:, None]))):
        raise PluginError(f"{who}, frame {seq}: a marker that is valid has no position (flag it as lost)")
    return tracks


def sound_detection(who: str, detection: object, seq: int) -> Detection:
    """Return a detector's answer. Raises PluginError where it is none, or a decision without a score."""
    if not isinstance(detection, Detection):
        raise _wrong(who, detection, "Detection", seq)
    if detection.slip is None:
        return detection
    if not isinstance(detection.slip, bool | np.bool_):
        raise PluginError(f"{who}, frame {seq}: slip is {detection.slip!r}, not True, False or None")
    if math.isnan(detection.score):
        raise PluginError(f"{who}, frame {seq}: it decides by a score of NaN (abstain: slip=None)")
    return detection


def sound_estimate(who: str, estimate: object, seq: int) -> SlipEstimate:
    """Return an estimator's answer. Raises PluginError where it is none, or has a speed that is NaN or infinite."""
    if not isinstance(estimate, SlipEstimate):
        raise _wrong(who, estimate, "SlipEstimate", seq)
    if estimate.abstained:
        return estimate
    x, y = estimate.velocity_m_s
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(estimate.speed_m_s)):
        raise PluginError(f"{who}, frame {seq}: it tells a speed that is NaN or infinite (abstain: return ABSTAINED)")
    return estimate


def sound_aperture(who: str, aperture_m: object) -> float | None:
    """Return a controller's answer. Raises PluginError where it is neither a finite number nor None."""
    if aperture_m is None:
        return None
    if not isinstance(aperture_m, Real) or isinstance(aperture_m, bool):
        raise PluginError(f"{who}: update() returned {type(aperture_m).__name__}, not an aperture in metres or None")
    if not math.isfinite(aperture_m):
        raise PluginError(f"{who}: update() returned {aperture_m} (return None to leave the gripper as it is)")
    return float(aperture_m)


def _wrong(who: str, answer: object, expected: str, seq: int) -> PluginError:
    return PluginError(f"{who}, frame {seq}: update() returned {type(answer).__name__}, not {expected}")
