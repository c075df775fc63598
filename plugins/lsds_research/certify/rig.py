"""A rig file as config keys of a simulated cell: real devices are replaced by mocks with their specs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lsds.clock import WallClock
from lsds.config.calibrated import KEY, calibration_paths
from lsds.config.overrides import override_texts
from lsds.config.reading import read_toml
from lsds.contracts import BuildContext
from lsds.errors import LsdsError
from lsds.registry.containment import one_line
from lsds.registry.host import PluginHost
from lsds_research.job_of_a_run import LIFT
from lsds_research.search.space import flat

GRIPPER, SENSOR, ARM = "mock-hand-e", "mock-gelsight-mini", "mock-ur5e"
GRIPPER_TICKS = 225
"""Position ticks of the simulated gripper between open and closed, by default."""
_FIRST_TICK = 3
"""Position register of the open simulated gripper, ticks: the default of `mock-hand-e`."""
NEEDED = ", because a lift needs one"
"""Reason for a mock where a rig has no device."""
_DROPPED = ("pose_source", "deadlines")
"""Sections that describe real devices."""
_CELL = "simulated"


def simulated_rig(path: Path | None, host: PluginHost) -> tuple[list[str], list[str]]:
    """Return the config keys of a simulated cell like a rig's, and what was replaced, in words.

    Raises ConfigError for a file that is not valid.
    """
    if path is None:
        return [], []
    from lsds.config import load_config

    load_config(path, host=host)
    tables = read_toml(path)
    tables.pop("$schema", None)
    if KEY in tables:
        # Those of overrides count from the current folder.
        tables[KEY] = [str(file.resolve()) for file in calibration_paths(tables[KEY], path.parent)]
    notes: list[str] = []
    job, _ = _chosen(tables, "job", LIFT)
    if job.rpartition(":")[2] != LIFT:
        own = tables["job"].get(LIFT)
        tables["job"] = {"backend": LIFT} | ({} if own is None else {LIFT: own})
        notes.append(f"job '{job}': {LIFT}, because a certificate counts lifts")
    real = _gripper(tables, host, notes) | _sensor(tables, host, notes) | _arm(tables, host, notes)
    if real:
        left_out = [section for section in _DROPPED if tables.pop(section, None) is not None]
        cell = tables.get("cell", {}).pop("backend", _CELL)
        if cell != _CELL:
            left_out.append(f"cell.backend = '{cell}'")
        if left_out:
            notes.append(f"{', '.join(left_out)}: left out, because the cell is simulated")
    return override_texts(dict(flat(tables))), notes


def _gripper(tables: dict[str, Any], host: PluginHost, notes: list[str]) -> bool:
    name, options = _chosen(tables, "gripper", GRIPPER)
    if _is_simulated(host, "gripper", name):
        return False
    found: dict[str, Any] = {}
    spec, reason = _spec(host, "gripper", name, options)
    if spec is not None:
        ticks = max(1, round(spec.stroke_m / spec.resolution_m)) if spec.resolution_m > 0 else GRIPPER_TICKS
        found = {
            "stroke_mm": round(1e3 * spec.stroke_m, 3),
            "open_tick": _FIRST_TICK,
            "closed_tick": min(_FIRST_TICK + ticks, 255),
            "latency_ms": round(1e3 * spec.latency_s, 3),
        }
        reason = "; its speed and force are those of the mock"
        if _FIRST_TICK + ticks > 255:
            coarse_mm = 1e3 * spec.stroke_m / (255 - _FIRST_TICK)
            reason += f", which has coarser ticks: {coarse_mm:.2g} instead of {1e3 * spec.resolution_m:.2g} mm"
    tables["gripper"] = {"backend": GRIPPER, GRIPPER: found}
    notes.append(f"gripper '{name}': {GRIPPER} with {_words(found)}{reason}")
    return name != "none"


def _sensor(tables: dict[str, Any], host: PluginHost, notes: list[str]) -> bool:
    if "sensors" in tables:
        # One pad stands for all: the objects are drawn for one.
        fingers = [one for one in tables.pop("sensors").values() if isinstance(one, dict)]
        tables["sensor"] = next(iter(fingers), {})
        notes.append(f"{len(fingers)} fingertips: the first of them, which stands for all")
    name, options = _chosen(tables, "sensor", SENSOR)
    if _is_simulated(host, "sensor", name):
        return False
    spec, reason = _spec(host, "sensor", name, options)
    found = {}
    if spec is not None:
        found = {"rate_hz": round(float(spec.rate_hz), 3), "latency_ms": round(1e3 * spec.latency_s, 3)}
    tables["sensor"] = {"backend": SENSOR, SENSOR: found}
    notes.append(f"fingertip '{name}': {SENSOR} with {_words(found)}{reason}")
    return name != "none"


def _arm(tables: dict[str, Any], host: PluginHost, notes: list[str]) -> bool:
    name, _ = _chosen(tables, "arm", ARM)
    if _is_simulated(host, "arm", name):
        return False
    tables["arm"] = {"backend": ARM}
    notes.append(f"arm '{name}': {ARM}{NEEDED if name == 'none' else ''}")
    return name != "none"


def _chosen(tables: dict[str, Any], section: str, default: str) -> tuple[str, dict[str, Any]]:
    table = tables.get(section, {})
    name = str(table.get("backend", default))
    return name, dict(table.get(name, {}))


def _is_simulated(host: PluginHost, kind: Any, name: str) -> bool:
    return name != "none" and host.find(kind, name).spec.virtual_time


def _spec(host: PluginHost, kind: Any, name: str, options: dict[str, Any]) -> tuple[Any, str]:
    """Return the spec of a device that is built and not connected, and ""; or None, and the reason."""
    if name == "none":
        return None, NEEDED
    try:
        return host.build(kind, name, options, BuildContext(WallClock())).spec, ""
    except (LsdsError, AttributeError, RuntimeError) as error:
        return None, f", because its spec is not known ({type(error).__name__}: {one_line(error)})"


def _words(options: dict[str, Any]) -> str:
    return ", ".join(f"{key} = {value}" for key, value in options.items()) or "its defaults"
