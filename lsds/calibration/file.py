"""The file that holds a calibration of slip: options of detectors and estimators."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from lsds.config.toml import dumps
from lsds.errors import DataError, PluginError
from lsds.plugins import PluginHost

if TYPE_CHECKING:
    from lsds.calibration.slip import SlipCalibration
    from lsds.config import RigConfig
    from lsds.contracts import Kind

_HEAD = """\
# Written by `lsds calibrate slip`. Name it in the config: calibration = ["this file"]
# Thresholds with at most {moving:g} false alarms per 100 moving and {still:g} per 100 still frames, found on
# {frames} frames of this gel and camera in which nothing slips.

"""


def as_toml(result: SlipCalibration, config: RigConfig) -> str:
    """Return the file's text. Raises DataError for a threshold that its detector cannot have."""
    host = PluginHost()
    tables: dict[str, dict[str, dict[str, Any]]] = {"detector": {}, "estimator": {}}
    for each in result.detectors:
        if each.after.threshold == each.before.threshold or "threshold" not in _options(host, "detector", each.name):
            continue
        tables["detector"][each.name] = {"threshold": _above(each.after.threshold)}
        _check(host, each.name, tables["detector"][each.name])
    if result.noise is not None:
        noise = {"gel_share": round(result.noise.gel_share, 3), "still_um": round(result.noise.still_m * 1e6, 1)}
        for name in host.names("estimator"):
            if set(noise) <= _options(host, "estimator", name):
                tables["estimator"][name] = dict(noise)
    head = _HEAD.format(moving=result.budget.moving, still=result.budget.still, frames=result.moving + result.still)
    return head + dumps({kind: table for kind, table in tables.items() if table})


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


def _check(host: PluginHost, name: str, options: dict[str, Any]) -> None:
    model = host.options_model(host.find("detector", name))
    try:
        if model is not None:
            model.model_validate(options)
    except ValidationError as error:
        raise DataError(
            f"detector '{name}': a threshold of {options['threshold']:g} would be needed, which it cannot have: it "
            "calls slip with certainty where nothing slips. Allow more false alarms, or use another detector"
        ) from error
