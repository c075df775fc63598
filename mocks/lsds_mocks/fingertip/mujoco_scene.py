"""Fingertips in a MuJoCo scene: `feel` replaces the contact of pad and object, `see` only looks at it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lsds.errors import DataError
from lsds.support.extras import require
from lsds_mocks.fingertip.pose import Pose, moment_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lsds_mocks.fingertip.fingertip import SimulatedFingertip

Mode = Literal["feel", "see"]


class MujocoFingertip:
    """One fingertip on a pad of a MuJoCo model.

    `pad` and `target` name the site, or else the body, whose frame is the pad's and the object's; the frames are
    described in `lsds_mocks.fingertip.fingertip`. Raises DataError for a name that the model does not have.
    """

    def __init__(self, model: Any, data: Any, tip: SimulatedFingertip, *, pad: str, target: str) -> None:
        require("mujoco", extra="mujoco", purpose="a fingertip in a MuJoCo scene")
        self.tip = tip
        self.pad, self.target = pad, target
        self._data = data
        self.pad_body, self.pad_pose = _frame(model, data, pad)
        self.target_body, self.target_pose = _frame(model, data, target)
        #: What `feel` has added to the applied force and torque of a body.
        self.added = {self.pad_body: np.zeros(6), self.target_body: np.zeros(6)}

    def feel(self, dt_s: float) -> None:
        """Step the fingertip to the scene's present poses, and let its wrench act on both bodies."""
        pad = self.pad_pose()
        wrench = self.tip.step(pad, self.target_pose(), dt_s)
        for body, sign in ((self.target_body, 1.0), (self.pad_body, -1.0)):
            # MuJoCo applies forces at the centre of mass.
            arm = pad.position_m - self._data.xipos[body]
            own = sign * wrench
            own[3:] += moment_of(arm, own[:3])
            # Other forces on the bodies stay as they are.
            self._data.xfrc_applied[body] += own - self.added[body]
            self.added[body] = own

    def see(self, dt_s: float, normal_n: float) -> None:
        """Step the fingertip to the scene's present poses under the normal force of the scene's own contact."""
        self.tip.step(self.pad_pose(), self.target_pose(), dt_s, normal_n=normal_n)

    def forget(self) -> None:
        """Begin a new trial after the scene was reset, which also cleared the applied forces."""
        self.tip.restart()
        self.added = {body: np.zeros(6) for body in self.added}


class MujocoScene:
    """A MuJoCo model that is stepped together with its fingertips.

    `feel`: the fingertips' wrenches act on pads and objects, so MuJoCo must not collide them: exclude the pair with
    `<exclude>`, or by contype and conaffinity. `see`: MuJoCo's contacts carry the object, and the fingertips show the
    images that such a motion and normal force would cause. The fingertips step every `every` steps of MuJoCo.
    """

    def __init__(
        self, model: Any, data: Any, fingertips: Sequence[MujocoFingertip], *, mode: Mode = "feel", every: int = 1
    ) -> None:
        require("mujoco", extra="mujoco", purpose="a fingertip in a MuJoCo scene")
        if mode not in ("feel", "see"):
            raise DataError(f"MuJoCo scene: mode is {mode!r}; write 'feel' or 'see'")
        if every < 1:
            raise DataError(f"MuJoCo scene: every is {every}; pass 1 or more")
        import mujoco

        self._mujoco: Any = mujoco
        self.model, self.data = model, data
        self.fingertips = tuple(fingertips)
        self._mode, self._every = mode, every
        self._count = 0
        self._time_s = float(data.time)

    def step(self, steps: int = 1) -> None:
        """Advance the scene by a number of MuJoCo's steps."""
        mujoco, model, data = self._mujoco, self.model, self.data
        for _ in range(steps):
            if data.time < self._time_s:
                self._count = 0
                for fingertip in self.fingertips:
                    fingertip.forget()
            self._restore()
            mujoco.mj_step(model, data)
            self._time_s = float(data.time)
            self._count += 1
            if self._count % self._every == 0:
                # A step ends with new joint positions; the poses of bodies and sites still belong to its beginning.
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                self._touch(self._every * float(model.opt.timestep))

    def _restore(self) -> None:
        """Apply the wrenches again where a program has cleared the applied forces."""
        bodies = {body for fingertip in self.fingertips for body in fingertip.added}
        for body in (body for body in bodies if not self.data.xfrc_applied[body].any()):
            self.data.xfrc_applied[body] = sum(fingertip.added.get(body, 0.0) for fingertip in self.fingertips)

    def _touch(self, dt_s: float) -> None:
        for fingertip in self.fingertips:
            normal_n = self._contact_force(fingertip)
            if self._mode == "see":
                fingertip.see(dt_s, normal_n or 0.0)
                continue
            if normal_n is not None:
                pair = (
                    f"{self.model.body(fingertip.pad_body).name!r} and {self.model.body(fingertip.target_body).name!r}"
                )
                raise DataError(
                    f"MuJoCo scene: bodies {pair} collide in MuJoCo, too; add them to <contact> as <exclude>, or use "
                    "mode='see'"
                )
            fingertip.feel(dt_s)

    def _contact_force(self, fingertip: MujocoFingertip) -> float | None:
        """Return the sum of MuJoCo's normal forces between pad and object (N); None without a contact."""
        data, model = self.data, self.model
        if not data.ncon:
            return None
        bodies = model.geom_bodyid[data.contact.geom]
        pair = {fingertip.pad_body, fingertip.target_body}
        found = [i for i, two in enumerate(bodies.tolist()) if set(two) == pair]
        if not found:
            return None
        total, force = 0.0, np.zeros(6)
        for i in found:
            self._mujoco.mj_contactForce(model, data, i, force)
            total += float(force[0])
        return total


def _frame(model: Any, data: Any, name: str) -> tuple[int, Callable[[], Pose]]:
    """Return the number of the body that carries a frame, and a function that returns the frame's pose now."""
    kind = next((kind for kind in ("site", "body") if _has(getattr(model, kind), name)), None)
    if kind is None:
        raise DataError(f"MuJoCo scene: no site and no body {name!r} in the model; name the frame of pad or object")
    number = int(getattr(model, kind)(name).id)
    place = data.site_xpos if kind == "site" else data.xpos
    turn = data.site_xmat if kind == "site" else data.xmat
    label = f"MuJoCo {kind} {name!r}"
    body = int(model.site_bodyid[number]) if kind == "site" else number
    return body, lambda: Pose(place[number].copy(), turn[number].reshape(3, 3).copy()).checked(label)


def _has(find: Callable[[str], Any], name: str) -> bool:
    """Return whether a model knows a name."""
    try:
        find(name)
    except KeyError:
        return False
    return True
