"""Fingertips in a MuJoCo scene: `feel` replaces the contact of pad and object, `see` only looks at it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from lsds.errors import DataError
from lsds.support.extras import require
from lsds.support.numeric import is_whole
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.pose import Pose, moment_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

Mode = Literal["feel", "see"]

SURELY_TOO_LONG = 2.0
"""Multiple of the step that is stable above which a step is warned of; chosen: of a step of 1.4 times no error is
known, and at 7 times a box that servos hold was pressed six times too strongly."""
GREATEST_COMMAND = 1e10
"""Greatest command of an actuator: MuJoCo replaces greater ones by zero (mjMAXVAL)."""
EDGE_M = 1e-4
"""How far a contact may lie outside of the pad and still be on it, m: those of an edge are on the edge; chosen."""


class MujocoFingertip:
    """One fingertip on a pad of a MuJoCo model.

    `pad` and `target` name the site, or else the body, whose frame is the pad's and the object's; the frames are
    described in `lsds_mocks.fingertip.fingertip`. Bodies that are welded to these belong to pad and object. Raises
    DataError for a name that the model does not have, and if pad and object are one body.
    """

    def __init__(self, model: Any, data: Any, tip: SimulatedFingertip, *, pad: str, target: str) -> None:
        require("mujoco", extra="mujoco", purpose="a fingertip in a MuJoCo scene")
        if not isinstance(tip, SimulatedFingertip):
            raise DataError(f"MuJoCo scene: the fingertip of pad {pad!r} is {tip!r}; pass a SimulatedFingertip")
        self.tip = tip
        self.pad, self.target = pad, target
        self.data, self.model = data, model
        self._of_pad, self._of_target = _frame(model, pad), _frame(model, target)
        self.pad_body, self.target_body = self._of_pad.body, self._of_target.body
        self._checked_s = 0.0
        self._pair = [int(model.body_weldid[body]) for body in (self.pad_body, self.target_body)]
        if self._pair[0] == self._pair[1]:
            raise DataError(f"MuJoCo scene: pad {pad!r} and object {target!r} are on one body; name a frame of each")

    def pad_pose(self) -> Pose:
        """Return the pose of the pad in the world now."""
        return self._of_pad.pose(self.data)

    def target_pose(self) -> Pose:
        """Return the pose of the object's frame in the world now."""
        return self._of_target.pose(self.data)

    def wrenches(self, dt_s: float) -> list[tuple[int, NDArray[np.float64]]]:
        """Step the fingertip to the scene's present poses; return the wrench on either body at its centre of mass.

        Warns once of a time step that is surely too long for the masses: the forces may then be wrong without an error.
        """
        if dt_s > self._checked_s:
            self._checked_s, stable_s = dt_s, self.stable_step_s()
            if dt_s > SURELY_TOO_LONG * stable_s:
                text = f"MuJoCo pad {self.pad!r} and object {self.target!r}: forces may be wrong at a step of"
                warnings.warn(f"{text} {1e3 * dt_s:g} ms; {1e3 * stable_s:.2g} ms is stable", stacklevel=4)
        pad = self.pad_pose()
        wrench = self._stepped(pad, dt_s)
        found = []
        for body, sign in ((self.target_body, 1.0), (self.pad_body, -1.0)):
            own = sign * wrench
            own[3:] += moment_of(pad.position_m - self.data.xipos[body], own[:3])
            found.append((body, own))
        return found

    def see(self, dt_s: float, normal_n: float) -> None:
        """Step the fingertip to the scene's present poses under the normal force of the scene's own contact."""
        self._stepped(self.pad_pose(), dt_s, normal_n)

    def _stepped(self, pad: Pose, dt_s: float, normal_n: float | None = None) -> NDArray[np.float64]:
        try:
            return self.tip.step(pad, self.target_pose(), dt_s, normal_n=normal_n)
        except DataError as error:
            stable_s = self.stable_step_s()
            longer = f"; the step of {1e3 * dt_s:g} ms is not stable, {1e3 * stable_s:.2g} ms is"
            text = f"MuJoCo pad {self.pad!r} and object {self.target!r}: {error}"
            raise DataError(text + (longer if normal_n is None and dt_s > stable_s else "")) from error

    def stable_step_s(self) -> float:
        """Return a time step (s) that is stable for the model's masses."""
        model, welded = self.model, self._pair[0]
        moves = welded and model.body_mocapid[welded] < 0
        pad_kg = float(model.body_mass[model.body_weldid == welded].sum()) if moves else math.inf
        return self.tip.stable_step_s(pad_kg or math.inf, mass_of(model, self.target_body))

    def contacts(self) -> list[int]:
        """Return the numbers of MuJoCo's contacts between pad and object."""
        data, model = self.data, self.model
        if not data.ncon:
            return []
        geoms = data.contact.geom
        welded = np.where(geoms >= 0, model.body_weldid[model.geom_bodyid[geoms]], -1)
        found: list[int] = np.flatnonzero((np.sort(welded, axis=1) == sorted(self._pair)).all(axis=1)).tolist()
        # A pad that does not move is welded to the floor.
        return found if self._pair[0] else [i for i in found if self._is_over(data.contact.pos[i])]

    def may_collide(self) -> bool:
        """Return whether some geom of the pad and one of the object can collide in MuJoCo."""
        model = self.model
        welded = model.body_weldid[model.geom_bodyid]
        pads, targets = (np.flatnonzero(welded == body) for body in self._pair)
        paired = {frozenset(pair) for pair in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)}
        excluded = set(model.exclude_signature.tolist())
        for pad, target in product(pads.tolist(), targets.tolist()):
            one, other = sorted((int(model.geom_bodyid[pad]), int(model.geom_bodyid[target])))
            meets = model.geom_contype[pad] & model.geom_conaffinity[target]
            met = model.geom_contype[target] & model.geom_conaffinity[pad]
            if frozenset((pad, target)) in paired or ((meets or met) and (one << 16) + other not in excluded):
                return True
        return False

    def contact_force(self) -> float | None:
        """Return by how much MuJoCo's contacts on the pad press along its normal (N); None without one.

        The body of a pad may touch the object with other parts, too, as a ledge, or another pad.
        """
        contact = self.data.contact
        found = [i for i in self.contacts() if self._is_over(contact.pos[i])]
        if not found:
            return None
        engine, across = mujoco_engine(), self.pad_pose().rotation[:, 2]
        total, force = 0.0, np.zeros(6)
        for i in found:
            engine.mj_contactForce(self.model, self.data, i, force)
            total += abs(float(force[0] * (contact.frame[i, :3] @ across)))
        return total

    def _is_over(self, position_m: NDArray[np.float64]) -> bool:
        """Return whether a position in the world is on the pad."""
        pad = self.pad_pose()
        here = pad.rotation.T @ (position_m - pad.position_m)
        return bool((np.abs(here) <= np.add(self.tip.reach_m, EDGE_M)).all())


class MujocoScene:
    """A MuJoCo model that is stepped together with its fingertips.

    `feel`: the fingertips' wrenches act on pads and objects, so MuJoCo must not collide them: exclude the pair with
    `<exclude>`, or by contype and conaffinity. `see`: MuJoCo's contacts carry the object, and the fingertips show the
    images that such a motion and normal force would cause. The fingertips step every `every` steps of MuJoCo.

    The wrenches are added to `data.xfrc_applied` for MuJoCo's step only: between steps it holds the program's own
    forces, and `applied` (bodies, 6) holds the wrenches of the next step, force (N) and torque (N m) at the centres of
    mass.
    """

    def __init__(
        self, model: Any, data: Any, fingertips: Sequence[MujocoFingertip], *, mode: Mode = "feel", every: int = 1
    ) -> None:
        require("mujoco", extra="mujoco", purpose="a fingertip in a MuJoCo scene")
        if mode not in ("feel", "see"):
            raise DataError(f"MuJoCo scene: mode is {mode!r}; write 'feel' or 'see'")
        if not is_whole(every) or every < 1:
            raise DataError(f"MuJoCo scene: every is {every!r}; pass a whole number from 1 on")
        if not isinstance(fingertips, Sequence) or not all(isinstance(one, MujocoFingertip) for one in fingertips):
            raise DataError(f"MuJoCo scene: fingertips are {fingertips!r}; pass a list of MujocoFingertip")
        if any(fingertip.data is not data or fingertip.model is not model for fingertip in fingertips):
            raise DataError(
                "MuJoCo scene: a fingertip belongs to another model or other data; make all with those of the scene"
            )
        if len({id(fingertip.tip) for fingertip in fingertips}) < len(fingertips):
            raise DataError("MuJoCo scene: two pads share one SimulatedFingertip; make one for each")
        unseen = [each for each in fingertips if mode == "see" and not each.may_collide()]
        if unseen:
            raise DataError(
                f"MuJoCo scene: mode is 'see', but pad {unseen[0].pad!r} and object {unseen[0].target!r} cannot collide"
                "; remove their <exclude>, set contype and conaffinity, or write mode='feel'"
            )
        kinds = mujoco_engine().mjtWarning
        self._diverged = [int(getattr(kinds, f"mjWARN_BAD{of}")) for of in ("QPOS", "QVEL", "QACC")]
        self.model, self.data = model, data
        self.fingertips = tuple(fingertips)
        self.applied = np.zeros((model.nbody, 6))
        self._mode, self._every = mode, every
        self._count = 0
        self._time_s = float(data.time)

    def step(self, steps: int = 1) -> None:
        """Advance the scene by a number of MuJoCo's steps.

        Raises DataError for a command that is no number, if MuJoCo's simulation diverges, if MuJoCo collides what a
        fingertip feels, if a callback of MuJoCo writes over the wrenches, and for poses that a fingertip cannot have.
        """
        if not is_whole(steps) or steps < 0:
            raise DataError(f"MuJoCo scene: asked for {steps!r} steps; pass a whole number from 0 on")
        mujoco, model, data = mujoco_engine(), self.model, self.data
        for _ in range(steps):
            if data.time < self._time_s:
                self.forget()
            self._require_commands()
            before_s, step_s = float(data.time), float(model.opt.timestep)
            own = data.xfrc_applied.copy()
            data.xfrc_applied += self.applied
            given = data.xfrc_applied.copy()
            try:
                mujoco.mj_step(model, data)
                held = self.applied.any(axis=1)
                replaced = not np.array_equal(data.xfrc_applied[held], given[held], equal_nan=True)
            finally:
                data.xfrc_applied[:] = own
            self._time_s = float(data.time)
            reset = self._time_s < before_s + 0.5 * step_s
            if before_s < step_s:
                # At the beginning there is no time to take away: only warnings show a reset.
                reset |= any(data.warning[kind].number for kind in self._diverged)
            if reset:
                self.forget()
                raise DataError(
                    f"MuJoCo scene: MuJoCo reset the scene at {before_s:.4g} s because its simulation diverged; take a "
                    "shorter step, and see MUJOCO_LOG.TXT"
                )
            if replaced:
                raise DataError(
                    "MuJoCo scene: a callback of MuJoCo has written to xfrc_applied, which holds the fingertips' "
                    "wrenches during a step; let it write to qfrc_applied, or set xfrc_applied between the steps"
                )
            self._count += 1
            if self._count % self._every == 0:
                # A step ends with new joint positions; the poses of bodies and sites still belong to its beginning.
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                self._touch(self._every * step_s)

    def _require_commands(self) -> None:
        """Raise DataError for a command of which MuJoCo would make zero, which lets the object go."""
        wrong = np.flatnonzero(~(np.abs(self.data.ctrl) <= GREATEST_COMMAND))
        if wrong.size:
            number = int(wrong[0])
            name = self.model.actuator(number).name or f"number {number}"
            raise DataError(
                f"MuJoCo scene: the command of actuator {name!r} is {self.data.ctrl[number]:g}, of which MuJoCo would "
                "make zero; give a finite number"
            )

    def reset(self, keyframe: int | None = None) -> None:
        """Begin a new trial: reset MuJoCo's data, to a keyframe if one is given, and the fingertips."""
        engine = mujoco_engine()
        if keyframe is None:
            engine.mj_resetData(self.model, self.data)
        elif is_whole(keyframe) and 0 <= keyframe < self.model.nkey:
            engine.mj_resetDataKeyframe(self.model, self.data, keyframe)
        else:
            raise DataError(f"MuJoCo scene: the model has {self.model.nkey} keyframes, and no number {keyframe!r}")
        engine.mj_forward(self.model, self.data)
        self.forget()

    def forget(self) -> None:
        """Begin a new trial of the fingertips, after the data were reset; a step does so where time went back."""
        self._count = 0
        self._time_s = float(self.data.time)
        self.applied[:] = 0.0
        for fingertip in self.fingertips:
            fingertip.tip.restart()

    def _touch(self, dt_s: float) -> None:
        if self._mode == "see":
            for fingertip in self.fingertips:
                fingertip.see(dt_s, fingertip.contact_force() or 0.0)
            return
        self.applied[:] = 0.0
        for fingertip in self.fingertips:
            if collided := fingertip.contacts():
                raise DataError(self._collision(collided[0]))
            for body, wrench in fingertip.wrenches(dt_s):
                self.applied[body] += wrench

    def _collision(self, contact: int) -> str:
        bodies = sorted(self.model.geom_bodyid[self.data.contact.geom[contact]].tolist())
        own = [str(self.model.body(body).name) for body in bodies]
        names = [repr(name) if name else f"number {body}" for name, body in zip(own, bodies, strict=True)]
        # Without the world's body the object would fall through the floor.
        remedy = "keep their geoms apart by contype"
        if all(bodies):
            add = f'add <exclude body1="{own[0]}" body2="{own[1]}"/> to <contact>'
            remedy = add if all(own) else "name them, and add them to <contact> as <exclude>"
        return f"MuJoCo scene: bodies {' and '.join(names)} collide in MuJoCo, too; {remedy}"


def mujoco_engine() -> Any:
    """Return the module `mujoco`, whose functions are compiled and have no types. A scene that held it could not be
    copied."""
    import mujoco

    return mujoco


def mass_of(model: Any, body: int) -> float:
    """Return the mass (kg) of all that moves with a body: from the joint that moves it on. Infinite for a body that
    is fixed to the world or moved by the program."""
    top = int(model.body_weldid[body])
    return float(model.body_subtreemass[top]) if top and model.body_mocapid[top] < 0 else math.inf


def upward_velocity_m_s(model: Any, data: Any, body: int) -> float:
    """Return the upward velocity (m/s) of a body's origin."""
    engine, motion = mujoco_engine(), np.zeros(6)
    engine.mj_objectVelocity(model, data, engine.mjtObj.mjOBJ_XBODY, body, motion, 0)
    return float(motion[5])


class _Frame(NamedTuple):
    """A frame of a model: "site" or "body", its number, and the number of the body that carries it."""

    kind: str
    number: int
    body: int

    def pose(self, data: Any) -> Pose:
        """Return the frame's pose in the world now."""
        places, turns = (data.site_xpos, data.site_xmat) if self.kind == "site" else (data.xpos, data.xmat)
        return Pose(places[self.number].copy(), turns[self.number].reshape(3, 3).copy())


def _frame(model: Any, name: str) -> _Frame:
    """Return the frame of a name. Raises DataError for one that the model does not have."""
    kind = frame_kind(model, name) if isinstance(name, str) else None
    if kind is None:
        raise DataError(f"MuJoCo scene: no site and no body {name!r} in the model; name the frame of pad or object")
    number = int(getattr(model, kind)(name).id)
    return _Frame(kind, number, int(model.site_bodyid[number]) if kind == "site" else number)


def frame_kind(model: Any, name: str) -> str | None:
    """Return whether a name is that of a "site" or else of a "body" of a model, None for neither."""
    return next((kind for kind in ("site", "body") if _has(getattr(model, kind), name)), None)


def _has(find: Callable[[str], Any], name: str) -> bool:
    """Return whether a model knows a name."""
    try:
        find(name)
    except KeyError:
        return False
    return True
