"""The maps by name: module, requirements, summary. This module imports nothing heavy."""

from __future__ import annotations

from typing import NamedTuple


class Named(NamedTuple):
    """Module in `lsds_research.stability.maps`, imports that it needs with their extra, and summary."""

    module: str
    requires: tuple[str, ...]
    extra: str
    summary: str


_SIM = (("numba",), "sim")
MAPS = {
    "marker-travel": Named("marker_travel", (), "", "trackers: markers confused, by their travel per frame"),
    "markers-lost": Named("markers_lost", (), "", "trackers: markers confused, by the share that vanishes"),
    "integrators": Named("integrators", (), "", "integrators of dry friction: error of a drop, by step and stiffness"),
    "loop-delay": Named("loop_delay", *_SIM, "slip of a lift, by delay of the gripper and margin or gain"),
    "frame-rate": Named("frame_rate", *_SIM, "slip of a lift, by frame interval and lost frames"),
    "false-alarms": Named("false_alarms", *_SIM, "grip over the needed one, by false alarms and first squeeze"),
    "friction-ticks": Named("friction_ticks", *_SIM, "grip over the needed one, by friction ratio and tick size"),
    "spheres": Named("spheres", *_SIM, "slip of spheres, by diameter and mass"),
    "camera": Named("camera", *_SIM, "slip of a lift, by worn markers and swinging light"),
    "texture": Named("texture", *_SIM, "slip of a flat object, by depth of its texture and friction"),
}


def study_name(name: str) -> str:
    """Return the name of a map's study."""
    return f"stability-{name}"
