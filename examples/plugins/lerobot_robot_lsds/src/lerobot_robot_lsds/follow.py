"""The job of the engine: bring the fingers to the target of the newest action, and correct slip there."""

from __future__ import annotations

import math

import lsds
from lsds.errors import ConfigError, ConfigIssue

LEAST_CHANGE_M = 0.5e-3
"""A target that differs by less from the last one is the same target (m): policies repeat themselves with noise."""
CONTACT_SHARE = 0.02
"""The gel is in contact with the object if at least this share of its image is indented."""


class Follow:
    """A `Job`: "reference" without contact, "idle" until the first target, then "move" and "hold".

    While an object is held, the controller closes the fingers on slip, and a target that still squeezes the object
    never opens them. A target wider than the aperture at touch releases the object.
    """

    stages = ("reference", "idle", "move", "hold")

    def __init__(self) -> None:
        self._asked_m: float | None = None

    def begin(self, setting: lsds.Setting) -> None:
        """Start a run. Raises ConfigError without a gripper."""
        if setting.gripper is None:
            issue = ConfigIssue("gripper.backend", "the robot needs a gripper", "choose a gripper backend")
            raise ConfigError("robot lsds", [issue])
        self._task = setting.task
        self._asked_m = None
        self._target_m: float | None = None
        self._grip: lsds.Grip | None = None
        self._sent = False
        self._touch_m = math.nan
        self._holds = False

    def aim(self, aperture_m: float) -> None:
        """Set the target (m); from any thread."""
        self._asked_m = aperture_m

    def step(self, now: lsds.Situation) -> lsds.Wanted:
        """Return what is wanted now."""
        if not now.referenced or now.gripper is None:
            return lsds.Wanted("reference")
        moved = self._adopt(now)
        if self._grip is None:
            return lsds.Wanted("idle")
        self._find_touch(now)
        # In the step of a new grip, `arrived` still belongs to the grip before.
        if now.arrived and not moved and math.isfinite(self._touch_m):
            self._holds = True
        stage = "hold" if self._holds else "move"
        return lsds.Wanted(stage, grip=self._grip, corrects=self._holds, touch_m=self._touch_m)

    def _adopt(self, now: lsds.Situation) -> bool:
        """Take the newest target; return whether the fingers are to move to it."""
        asked, target = self._asked_m, self._target_m
        if asked is None or (target is not None and abs(asked - target) < LEAST_CHANGE_M):
            return False
        self._target_m = asked
        if self._holds:
            held = now.cycle.held_m if now.cycle is not None else math.nan
            if asked > self._touch_m:
                self._holds, self._touch_m = False, math.nan
            elif not asked < held:
                # The controller has closed farther than that, and decides about the squeeze.
                return False
        self._grip = lsds.Grip(asked, self._task.grip_speed_m_s, self._task.grip_force_n)
        return True

    def _find_touch(self, now: lsds.Situation) -> None:
        """Note the aperture at which the gel first shows the object; forget it when the gel is free again."""
        if self._holds or now.gripper is None or now.cycle is None:
            return
        shares = [0.0 if f.observation.contact is None else f.observation.contact.area_fraction for f in now.fingers]
        if max(shares, default=0.0) < CONTACT_SHARE:
            self._touch_m = math.nan
        elif math.isnan(self._touch_m):
            # The frame is older than the newest state of the gripper, so the aperture is that of the frame.
            self._touch_m = now.cycle.grip.aperture_m
