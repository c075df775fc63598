"""The file that holds a calibration of slip: options of detectors and estimators."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from lsds.config.toml import dumps
from lsds.errors import PluginError
from lsds.plugins import PluginHost

if TYPE_CHECKING:
    from lsds.calibration.slip import SlipCalibration
    from lsds.contracts import Kind

_HEAD = """\
# Written by `lsds calibrate slip`. Name it in the config: calibration = ["this file"]
# Thresholds with at most {moving:g} false alarms per 100 moving and {still:g} per 100 still frames (one at least),
# found on {frames} frames of this gel and camera in which nothing slips.

"""


def as_toml(result: SlipCalibration) -> tuple[str, list[str]]:
    """Return the file's text, and of each detector that cannot be calibrated why."""
    host, problems = PluginHost(), list[str]()
    tables: dict[str, dict[str, dict[str, Any]]] = {"detector": {}, "estimator": {}}
    for each in result.detectors:
        if "threshold" not in _options(host, "detector", each.name):
            problems.append(f"detector '{each.name}' has no option threshold: nothing is written for it")
            continue
        options = {"threshold": _above(each.after.threshold)}
        if (problem := _problem(host, each.name, options)) is not None:
            problems.append(problem)
        else:
            tables["detector"][each.name] = options
    if result.noise is not None:
        noise = {"gel_share": round(result.noise.gel_share, 3), "still_um": round(result.noise.still_m * 1e6, 1)}
        for name in host.names("estimator"):
            if set(noise) <= _options(host, "estimator", name):
                tables["estimator"][name] = dict(noise)
    head = _HEAD.format(moving=result.budget.moving, still=result.budget.still, frames=result.moving + result.still)
    return head + dumps({kind: table for kind, table in tables.items() if table}), problems


def _above(value: float) -> float:
    """Return a short number that is not below the value: a score at the threshold raises no alarm."""
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 4) if value else 1.0
    return float(f"{math.ceil(value / unit) * unit:.6g}")


def _options(host: PluginHost, kind: Kind, name: str) -> set[str]:
    try:
        model = host.options_model(host.find(kind, name))
    except PluginError:
        return set()
    return set() if model is None else set(model.model_fields)


def _problem(host: PluginHost, name: str, options: dict[str, Any]) -> str | None:
    """Return why a detector cannot have these options, None where it can."""
    model = host.options_model(host.find("detector", name))
    try:
        if model is not None:
            model.model_validate(options)
    except ValidationError:
        return (
            f"detector '{name}' would need a threshold of {options['threshold']:g}, which it cannot have: it calls "
            "slip with certainty where nothing slips; nothing is written for it (allow more false alarms, or use "
            "another)"
        )
    return None
