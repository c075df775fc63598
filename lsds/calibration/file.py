"""The file that holds a calibration of slip: options of detectors and estimators."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from lsds.calibration.noise import SHARES, ImprintNoise
from lsds.config.toml import dumps
from lsds.errors import PluginError
from lsds.registry import PluginHost

if TYPE_CHECKING:
    from lsds.calibration.slip import CalibratedDetector, SlipCalibration
    from lsds.config import RigConfig
    from lsds.contracts import Kind

    Tables = dict[str, dict[str, dict[str, Any]]]

_HEAD = """\
# Written by `lsds calibrate slip`. Name it in the config: calibration = ["this file"]
# Thresholds with at most {moving:g} false alarms per 100 moving and {still:g} per 100 still frames (one at least),
# found on {frames} frames of this gel and camera without slip.

"""


_WHY = "did the object slip by mistake? If not, allow more false alarms, or use another detector"


class Contents(NamedTuple):
    """Content of the file: options by kind and backend (empty for none), its text, and reasons for omissions."""

    tables: Tables
    text: str
    problems: list[str]


def as_toml(result: SlipCalibration) -> Contents:
    """Return the content of the file."""
    host, problems = PluginHost(), list[str]()
    tables: Tables = {"detector": {}, "estimator": {}}
    refused = False
    for each in result.detectors:
        if "threshold" not in _options(host, "detector", each.name):
            problems.append(f"detector '{each.name}' has no option threshold: nothing is written for it")
            continue
        options = {"threshold": _above(each.after.threshold)}
        if (problem := _problem(host, each, options)) is not None:
            problems.append(problem)
            refused = True
        else:
            tables["detector"][each.name] = options
    if result.noise is not None and result.noise.gel_share >= SHARES[-1]:
        problems.append(
            f"the imprint's error is {SHARES[-1]:.0%} of the markers' motion or more: nothing is written for "
            "estimators (did the object slip by mistake?)"
        )
    elif result.noise is not None and (tables["detector"] or not refused):
        noise = {"gel_share": round(result.noise.gel_share, 3), "still_um": round(result.noise.still_m * 1e6, 1)}
        for name in host.names("estimator"):
            if set(noise) <= _options(host, "estimator", name):
                tables["estimator"][name] = dict(noise)
    head = _HEAD.format(moving=result.budget.moving, still=result.budget.still, frames=result.moving + result.still)
    tables = {kind: table for kind, table in tables.items() if table}
    return Contents(tables, head + dumps(tables), problems)


def noise_in(config: RigConfig) -> ImprintNoise | None:
    """Return the noise that the config's estimator assumes, None if it has no such options."""
    host, section = PluginHost(), config.section("estimator")
    model = host.options_model(host.find("estimator", section.backend))
    options = {} if model is None else model.model_validate(section.options()).model_dump()
    if not {"gel_share", "still_um"} <= set(options):
        return None
    return ImprintNoise(options["gel_share"], options["still_um"] * 1e-6)


def outweighed(tables: Tables, config: RigConfig) -> list[str]:
    """Return a warning for each option that the config sets itself, and so overrides the file's."""
    return [
        f"the config sets {kind}.{own}.{key} itself, which overrides the file: remove it from the config"
        for kind, backends in tables.items()
        for name, options in backends.items()
        for own in dict.fromkeys((name, name.rpartition(":")[2]))
        for key in options
        if key in getattr(config, kind).tables.get(own, {})
    ]


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


def _problem(host: PluginHost, each: CalibratedDetector, options: dict[str, Any]) -> str | None:
    """Return the reason why a detector cannot have these options, None if it can."""
    needs = f"detector '{each.name}' would need a threshold of {options['threshold']:g}"
    model = host.options_model(host.find("detector", each.name))
    try:
        if model is not None:
            model.model_validate(options)
    except ValidationError:
        return (
            f"{needs}, which it does not accept: it reports slip with certainty in frames without slip; nothing is "
            f"written for it ({_WHY})"
        )
    if each.is_blind:
        return (
            f"{needs}, at which it finds {each.after.found:.0%} of the sliding frames, before {each.before.found:.0%}; "
            f"nothing is written for it ({_WHY})"
        )
    return None
