"""Detect slip with a camera-based tactile fingertip and close the gripper just enough.

    import lsds

    lsds.run(overrides=["task.lift_s=1"]).summary        # a job, from bring-up to its figures
    with lsds.bring_up("rig.toml") as engine:            # or step by step
        for cycle in engine: ...
    lsds.track("clip.avi").summary()                     # a recording

Everything is imported when it is first used; see docs/library.md.
"""

from __future__ import annotations

__version__ = "0.1.0"

from lsds.support import former_names

# Not imported: `typing` alone would take longer than this whole module.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from lsds.config import RigConfig, load_config
    from lsds.contracts import Cycle, FingerCycle, Grip, Job, Observation, Setting, Situation, Slide, Twist, Wanted
    from lsds.errors import LsdsError, SafetyStop
    from lsds.jobs import HoldJob, WatchJob
    from lsds.registry import PluginHost
    from lsds.registry.in_program import register
    from lsds.runtime.engine import Engine
    from lsds.runtime.rig import Rig
    from lsds.session.bring_up import bring_up
    from lsds.session.recording.reader import Recording
    from lsds.session.replay import ReplayResult, replay
    from lsds.session.run import Session, run
    from lsds.session.simulate import SimulatedRun, simulate
    from lsds.session.single_device import open_device as open
    from lsds.session.track import TrackResult, track, watch

former_names.install()

_HOMES = {
    "lsds.config": ("RigConfig", "load_config"),
    "lsds.contracts": (
        "Cycle",
        "FingerCycle",
        "Grip",
        "Job",
        "Observation",
        "Setting",
        "Situation",
        "Slide",
        "Twist",
        "Wanted",
    ),
    "lsds.runtime.engine": ("Engine",),
    "lsds.errors": ("LsdsError", "SafetyStop"),
    "lsds.session.bring_up": ("bring_up",),
    "lsds.jobs": ("HoldJob", "WatchJob"),
    "lsds.registry": ("PluginHost",),
    "lsds.registry.in_program": ("register",),
    "lsds.runtime.rig": ("Rig",),
    "lsds.session.recording.reader": ("Recording",),
    "lsds.session.replay": ("ReplayResult", "replay"),
    "lsds.session.run": ("Session", "run"),
    "lsds.session.simulate": ("SimulatedRun", "simulate"),
    "lsds.session.track": ("TrackResult", "track", "watch"),
}
"""The module of each public name, imported on first use (PEP 562)."""

__all__ = [
    "Cycle",
    "Engine",
    "FingerCycle",
    "Grip",
    "HoldJob",
    "Job",
    "LsdsError",
    "Observation",
    "PluginHost",
    "Recording",
    "ReplayResult",
    "Rig",
    "RigConfig",
    "SafetyStop",
    "Session",
    "Setting",
    "SimulatedRun",
    "Situation",
    "Slide",
    "TrackResult",
    "Twist",
    "Wanted",
    "WatchJob",
    "__version__",
    "bring_up",
    "load_config",
    "open",
    "register",
    "replay",
    "run",
    "simulate",
    "track",
    "watch",
]


def __getattr__(name: str) -> Any:
    import importlib

    if name == "open":  # A name that the module must not have itself: it would hide the builtin.
        return importlib.import_module("lsds.session.single_device").open_device
    for module, names in _HOMES.items():
        if name in names:
            value = getattr(importlib.import_module(module), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'lsds' has no attribute '{name}'; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return sorted(__all__)
