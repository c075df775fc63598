"""Every feature by name: its meaning, its unit, and the named sets that it belongs to.

Both the paper's form and the corrected form are available, so that its tables can be reproduced and improved.
"""

from __future__ import annotations

from dataclasses import dataclass

from lsds.errors import ConfigError, ConfigIssue


@dataclass(frozen=True, slots=True)
class FeatureSpec:
    """One feature: its name, SI unit, meaning, and whether its form is the paper's, corrected, or released."""

    name: str
    unit: str
    meaning: str
    form: str


FEATURES: tuple[FeatureSpec, ...] = (
    FeatureSpec("v_x", "m/s", "mean marker velocity along x (Eq. 2)", "paper"),
    FeatureSpec("v_y", "m/s", "mean marker velocity along y (Eq. 2)", "paper"),
    FeatureSpec("v_net", "m/s", "norm of the mean velocity (Eq. 3); blind to pure rotation", "paper"),
    FeatureSpec("div_sum", "1", "divergence of the displacement, summed over the markers (Eq. 4)", "paper"),
    FeatureSpec("curl_sum", "1", "curl of the displacement, summed over the markers (Eq. 4)", "paper"),
    FeatureSpec("div_sum_rate", "1/s", "rate of div_sum", "paper"),
    FeatureSpec("curl_sum_rate", "1/s", "rate of curl_sum", "paper"),
    FeatureSpec("area", "1", "fraction of the image in contact, A_n", "paper"),
    FeatureSpec("area_rate", "1/s", "rate of the contact area", "paper"),
    FeatureSpec("entropy", "nat", "Shannon entropy of the displacement histogram, H", "paper"),
    FeatureSpec("entropy_rate", "nat/s", "rate of the entropy", "paper"),
    FeatureSpec("mean_speed", "m/s", "mean of the markers' speeds: sees rotation too", "corrected"),
    FeatureSpec("div_mean", "1", "divergence a marker", "corrected"),
    FeatureSpec("curl_mean", "1", "curl a marker", "corrected"),
    FeatureSpec("div_mean_rate", "1/s", "rate of div_mean", "corrected"),
    FeatureSpec("curl_mean_rate", "1/s", "rate of curl_mean", "corrected"),
    FeatureSpec("div_affine", "1", "divergence of the best affine motion", "corrected"),
    FeatureSpec("curl_affine", "1", "curl of the best affine motion", "corrected"),
    FeatureSpec("rotation", "rad", "rigid rotation of the best affine motion, curl_affine / 2", "corrected"),
    FeatureSpec("angular_velocity", "rad/s", "rate of the rotation", "corrected"),
    FeatureSpec("mean_displacement", "m", "mean norm of the displacements", "corrected"),
    FeatureSpec(
        "displacement_log2n", "m", "log2(N) times the mean displacement norm: the released column 'ent'", "released"
    ),
    FeatureSpec("displacement_log2n_delta", "m", "its change from frame to frame, not divided by time", "released"),
    FeatureSpec("theta", "rad", "direction of the mean velocity", "released"),
    FeatureSpec("theta_delta", "rad", "its change from frame to frame, wrapped to (-pi, pi]", "released"),
)

NAMES: tuple[str, ...] = tuple(feature.name for feature in FEATURES)

_BASELINE = ("entropy", "entropy_rate")
_PROPOSED = ("v_net", "div_sum", "curl_sum", "div_sum_rate", "curl_sum_rate", "area", "area_rate")

FEATURE_SETS: dict[str, tuple[str, ...]] = {
    "baseline": _BASELINE,
    "proposed": _PROPOSED,
    "combined": (*_BASELINE, *_PROPOSED),
    "released13": (
        "displacement_log2n",
        "displacement_log2n_delta",
        *_PROPOSED,
        "v_x",
        "v_y",
        "theta",
        "theta_delta",
    ),
    "all": NAMES,
}


def feature_indices(feature_set: str) -> list[int]:
    """Return the indices of the set's features in the full vector. Raises ConfigError for an unknown set."""
    if feature_set not in FEATURE_SETS:
        known = ", ".join(FEATURE_SETS)
        raise ConfigError("features", [ConfigIssue("features", f"unknown set {feature_set!r}", known)])
    return [NAMES.index(name) for name in FEATURE_SETS[feature_set]]
