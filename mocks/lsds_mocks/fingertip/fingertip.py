"""A fingertip in a scene that another program simulates: poses in; wrench, image, markers and truth out.

Frames. The pad's frame has its origin at the centre of the undeformed gel surface, x right and y down in the sensor's
image, z out of the gel towards the object. The object's frame has its origin at half its thickness and at its grip
height, y along its length towards its foot, and z through its faces, if it has faces.

The wrench is for the scene's next step. It is computed for the object's motion continued by one step: for a gel of
stiffness k that adds a damping of k times the step, as backward Euler does, and friction limits it like the rest. With
an object of mass m the scene is stable if the square of the step is below 4/3 m / k, with k of all pads together and
m reduced by the pads' own mass.
"""

from __future__ import annotations

import dataclasses
import math
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lsds.errors import DataError
from lsds.support.numeric import is_number, is_whole
from lsds_mocks.cell.build import build_friction, build_gel, build_grain, build_material, build_surface
from lsds_mocks.cell.options import ContactOptions
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.devices.look import look_of
from lsds_mocks.fingertip.contact import Outline
from lsds_mocks.fingertip.pose import NO_MOTION, Motion, Pose, motion_between
from lsds_mocks.gel.auto.report import STRAIN_INVALID, invalid_reasons
from lsds_mocks.gel.placement import ORIGIN, Placement
from lsds_mocks.gel.protocol import NO_REACTION, Reaction
from lsds_mocks.optics.renderer import Renderer
from lsds_mocks.plant.slip import radius_of_gyration_m, sliding_speed_m_s, slips

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.fingertip.contact import Touch
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.state import GelState
    from lsds_mocks.plant.friction import SurfaceFriction

TILT_VALID_RAD = math.radians(10)
"""Tilt of the object against the pad up to which results are valid, rad. Not measured: the gel has no tilt."""
TILT_MOST_RAD = math.radians(45)
"""Tilt beyond which a fingertip carries nothing, rad; chosen: an object that stands on an edge has no side to press."""
OFFSET_BRISTLES_M = 1e-3
"""Offset of the contact from the pad's centre up to which results of bristles are valid, m; chosen."""
YAW_BRISTLES_RAD = math.radians(10)
"""Turn of the object about the pad's normal up to which results of bristles are valid, rad; chosen."""

Side = Literal["front", "back"]


@dataclass(frozen=True, slots=True)
class FingertipTruth:
    """True state of a fingertip at the end of its last step, in the pad's frame and SI units.

    `force_n` (x, y) is the object's tangential load on the gel, `torque_nm` that about the pad's normal. Slip is motion
    of the object in gross slip, as in `lsds.contracts.CellTruth`; `velocity_m_s` counts all motion against the pad.
    `invalid` states why results are not valid.
    """

    time_s: float
    normal_force_n: float
    force_n: tuple[float, float]
    torque_nm: float
    indentation_m: float
    tilt_rad: float
    velocity_m_s: tuple[float, float]
    slip_velocity_m_s: tuple[float, float]
    slip_angular_rad_s: float
    slip_distance_m: float
    stick_ratio: float
    invalid: tuple[str, ...]

    @property
    def tangential_force_n(self) -> float:
        """Tangential load on the gel, N."""
        return math.hypot(*self.force_n)


class SimulatedFingertip:
    """One pad and the object that it touches.

    `options` describe object, friction and gel as `[cell.simulated]` does; `look` describes the camera as
    `[sensor.mock-gelsight-mini]` does. `side` is the side of the object on which the pad lies: "back" mirrors a turned
    object. `seed` draws the friction of the surface and the appearance of the gel; `friction` replaces that of the
    surface. Raises DataError for another side.
    """

    def __init__(
        self,
        options: ContactOptions | None = None,
        look: GelSightOptions | None = None,
        *,
        side: Side = "front",
        seed: int = 0,
        friction: SurfaceFriction | None = None,
    ) -> None:
        options = ContactOptions() if options is None else options
        if not isinstance(options, ContactOptions):
            raise DataError(f'fingertip: options are {options!r}; pass ContactOptions(object="can"), for example')
        if not isinstance(look, GelSightOptions | None):
            raise DataError(f"fingertip: look is {look!r}; pass GelSightOptions(gel=7), for example")
        if not is_whole(seed) or seed < 0:
            raise DataError(f"fingertip: seed is {seed!r}; pass a whole number from 0 on")
        if side not in ("front", "back"):
            raise DataError(f"fingertip: side is {side!r}; write 'front' or 'back'")
        if side == "back":
            options = options.model_copy(update={"turned_deg": -options.turned_deg})
        self.options = options
        material = build_material(options)
        self._pad_m = (material.width_m, material.height_m)
        self._thickness_m = material.thickness_m
        self.gel = self._new_gel()
        own = [seed, zlib.crc32(side.encode())]
        self._friction = friction or build_friction(options, *np.random.default_rng(own).spawn(2))
        self._renderer = Renderer(look_of(look or GelSightOptions(dim_start=False)), own)
        grip = options.grip_height_mm * 1e-3
        half = options.diameter_mm * 0.5e-3
        self._outline = Outline(
            options.shape,
            half,
            above_m=options.length_mm * 1e-3 - grip,
            below_m=grip,
            half_width_m=options.width_mm * 0.5e-3 if options.shape == "box" else half,
        )
        self._images = 0
        self._time_s = 0.0
        self._points: NDArray[np.float64] | None = None
        self._seen: Pose | None = None
        self._pressed: tuple[float, tuple[float, float] | None] | None = None
        self._radius_m = 0.0
        self.release()
        self._deepest_m = 0.0
        self._slip_distance_m = 0.0
        self._tilt_rad = 0.0

    def _new_gel(self) -> GelModel:
        """Return a gel that nothing has touched."""
        options, material = self.options, build_material(self.options)
        gel = build_gel(options, build_surface(options, material), material)
        gel.grain = build_grain(options)
        return gel

    @property
    def reach_m(self) -> tuple[float, float, float]:
        """Greatest distances (m) from the pad's origin at which something is on the pad, along x, y and z."""
        width, height = self._pad_m
        return width / 2, height / 2, self._thickness_m

    def stable_step_s(self, pad_kg: float, object_kg: float | None = None) -> float:
        """Return a time step (s) at which the object is stable between two such fingertips of mass `pad_kg` each.

        `object_kg` replaces the mass in the options. The stiffness is that of a gel without history, indented as deeply
        as is valid: by a fifth of its thickness.
        """
        if not (is_number(pad_kg) and pad_kg > 0):
            raise DataError(f"fingertip: mass of a pad is {pad_kg!r} kg; pass more than 0, or math.inf for a fixed one")
        if object_kg is not None and not (is_number(object_kg) and object_kg > 0):
            raise DataError(f"fingertip: mass of an object is {object_kg!r} kg; pass more than 0")
        of = self.options
        # A push at the grip also turns an object that is gripped away from its middle, as if its mass were less.
        off_centre = (of.grip_height_mm - of.length_mm / 2) / of.length_mm
        own_kg = (of.mass_kg if object_kg is None else object_kg) / (1 + 12 * off_centre**2)
        inverse_kg = 1 / own_kg + 1 / (2 * pad_kg)
        if inverse_kg == 0:
            return math.inf
        gel, deep = self._new_gel(), STRAIN_INVALID * self._thickness_m
        shallow = gel.press(0.9 * deep)
        normal_n_m = (gel.press(deep) - shallow) / (0.1 * deep)
        gel.set_friction(np.full(gel.points_m.shape[1], self.options.static_friction))
        shear_n_m = abs(gel.trial(0.0, _TYPICAL_SHEAR_M).force_y_n) / _TYPICAL_SHEAR_M
        margin = _MARGIN_BRISTLES if of.fidelity == "winkler" else _MARGIN
        return margin * math.sqrt(4 / 3 / inverse_kg / (2 * max(normal_n_m, _ROLLING * shear_n_m)))

    def step(self, pad: Pose, target: Pose, dt_s: float, *, normal_n: float | None = None) -> NDArray[np.float64]:
        """Advance to new poses of pad and object in the world; return the wrench on the object (6,): force, torque.

        Force (N) and torque (N m) have the world's axes; the torque is about the pad's origin. The pad carries the
        opposite wrench. With `normal_n`, the force by which the scene presses the object against the pad, the
        indentation follows from that force instead of from the poses.

        Raises DataError for a time step that is not positive, for a pose or a force that is not finite, and for an
        object as deep in the gel as it is thick.
        """
        if not (isinstance(pad, Pose) and isinstance(target, Pose)):
            raise DataError(
                "fingertip: poses of pad and object are not Pose; make them with Pose.of(position, rotation)"
            )
        if not (is_number(dt_s) and math.isfinite(dt_s) and dt_s > 0):
            raise DataError(f"fingertip: time step is {dt_s!r} s; pass a positive number of seconds")
        if normal_n is not None and not is_number(normal_n):
            raise DataError(f"fingertip: normal force is {normal_n!r} N; pass a number of newtons, or None")
        if normal_n is not None and not math.isfinite(normal_n):
            raise DataError(f"fingertip: normal force is {normal_n} N; check whether the scene's simulation diverged")
        pad, target = pad.checked("fingertip: pose of the pad"), target.checked("fingertip: pose of the object")
        seen = target.seen_from(pad)
        self._time_s += dt_s
        # Behind the gel an object is out of reach. One that lies in it from behind hints at a pad with a wrong z.
        behind = float(seen.position_m[2]) < -self._outline.half_m - self._thickness_m
        touch = None if behind else self._outline.touch(seen, self._pad_m)
        if touch is None or (touch.indentation_m if normal_n is None else normal_n) <= 0:
            self.release()
            return np.zeros(6)
        if touch.tilt_rad > TILT_MOST_RAD:
            self.release()
            self._tilt_rad = touch.tilt_rad
            return np.zeros(6)
        if normal_n is None and touch.indentation_m >= self._thickness_m:
            raise DataError(
                f"fingertip: object is {touch.indentation_m * 1e3:.1f} mm deep in a gel of "
                f"{self._thickness_m * 1e3:.1f} mm; check that the pad's z points to the object, the grip and the step"
            )
        self._tilt_rad = touch.tilt_rad
        self._follow(seen, touch, dt_s, normal_n)
        return self._wrench(pad)

    def restart(self) -> None:
        """Begin a new trial as at first: forget the gel's history, time, slip and what made results invalid."""
        self.gel = self._new_gel()
        self._seen = None
        self.release()
        self._images = 0
        self._time_s = 0.0
        self._deepest_m = 0.0
        self._slip_distance_m = 0.0

    def release(self) -> None:
        """Take the object off the gel."""
        if self._seen is not None:
            self.gel.press(0.0)
            self.gel.trial(0.0, 0.0)
            self.gel.commit()
        self._seen = None
        self._place = ORIGIN
        self._lies: Placement | None = None
        self._speed = self._moved = NO_MOTION
        self._indentation_m = 0.0
        self._pressed = None
        self._reaction: Reaction = NO_REACTION
        self._centre_m = self._rolled_m = (0.0, 0.0)
        self._slips = False
        self._tilt_rad = 0.0

    def _begin(self, place: Placement) -> None:
        """Lay the object's surface over the gel where it touches first."""
        now = Placement(*self.gel.state().placement)
        turn = place.angle_rad - now.angle_rad
        turned = now.moved(0.0, 0.0, turn)
        self.gel.press(0.0)
        self.gel.trial(place.x_m - turned.x_m, place.y_m - turned.y_m, turn)
        self.gel.commit()
        self._place = place

    def _follow(self, seen: Pose, touch: Touch, dt_s: float, normal_n: float | None) -> None:
        """Press and move the gel."""
        gel = self.gel
        moved = NO_MOTION
        depth = touch.indentation_m
        if self._seen is None:
            self._begin(touch.place)
        else:
            moved = _moved_at(self._rolled_m, motion_between(self._seen, seen))
            depth += touch.indentation_m - self._indentation_m
        speed = Motion(*(part / dt_s for part in moved))
        # The gel leads the object by the motion of a step; that of the step before is taken back.
        ahead = [2 * new - old for new, old in zip(moved, self._moved, strict=True)]
        self._seen, self._speed, self._moved = seen, speed, moved
        self._indentation_m = touch.indentation_m
        self._lies = touch.place
        if normal_n is None:
            depth = min(max(depth, 0.0), self._thickness_m)
        else:
            depth = self._indentation_m = self._depth_for(normal_n, touch.reach_m)
        self._deepest_m = max(self._deepest_m, self._indentation_m)
        last = self._pressed
        pressed = last is None or abs(depth - last[0]) > _SAME_DEPTH_M or touch.reach_m != last[1]
        if pressed:
            gel.press(depth, touch.reach_m)
            self._pressed = (depth, touch.reach_m)
        points = gel.points_m
        travel = self._place.y_m * math.cos(self._place.angle_rad) - self._place.x_m * math.sin(self._place.angle_rad)
        sliding_speed = self._sliding_speed(points)
        if self._friction.changed(points, travel, sliding_speed) or pressed:
            gel.set_friction(self._friction.at(points, travel, gel.sliding, sliding_speed))
        self._reaction = gel.trial(*ahead)
        gel.commit()
        self._place = self._place.moved(*moved)
        state = gel.state()
        load = float(state.pressure_n.sum())
        if load > 0:
            x, y = (gel.points_m @ state.pressure_n) / load
            self._centre_m = (float(x), float(y))
        # Bristles have no place: they are pressed at the pad's centre, wherever the object is.
        pressed_at = ORIGIN if self.options.fidelity == "winkler" else self._place
        self._rolled_m = _along(touch.rolls, touch.place.x_m - pressed_at.x_m, touch.place.y_m - pressed_at.y_m)
        self._slips = slips(gel, self._reaction.normal_n)
        if self._slips:
            self._slip_distance_m += math.hypot(moved.dx_m, moved.dy_m)

    def _depth_for(self, normal_n: float, reach_m: tuple[float, float] | None) -> float:
        """Return the indentation (m) at which the resting gel carries a normal force; at most the valid one."""
        low, high = 0.0, self._thickness_m * _MOST_STRAIN
        depth = min(max(self._indentation_m, _TYPICAL_M), high)
        self._pressed = None
        for _ in range(_DEPTH_TRIES):
            force_n = self.gel.press(depth, reach_m)
            if abs(force_n - normal_n) <= _SAME_FORCE * normal_n or high - low < _SAME_DEPTH_M:
                return depth
            low, high = (depth, high) if force_n < normal_n else (low, depth)
            # The force grows about as the depth to the power of 1 (a face) to 1.5 (a ball).
            nearer = depth * (normal_n / force_n) ** (1 / _POWER) if force_n > 0 else high
            depth = nearer if low < nearer < high else (low + high) / 2
        return depth

    def _sliding_speed(self, points: NDArray[np.float64]) -> float:
        if points is not self._points:
            self._points, self._radius_m = points, radius_of_gyration_m(points)
        return sliding_speed_m_s(*self._speed, self._radius_m)

    def _wrench(self, pad: Pose) -> NDArray[np.float64]:
        """Return the wrench on the object about the pad's origin, in the world's axes."""
        load, (ahead_x, ahead_y) = self._reaction, self._rolled_m
        # The gel moves with the material at the pad; the contact of what rolls is ahead of that. Without this, a ball
        # that has rolled a little would be pushed on by the normal force, and gain energy.
        x, y = self._centre_m[0] + ahead_x, self._centre_m[1] + ahead_y
        force = np.array([-load.force_x_n, -load.force_y_n, load.normal_n])
        # The forces act on the indented surface, the normal force at the centre of pressure.
        depth = self._indentation_m
        torque = np.array(
            [
                y * load.normal_n - depth * load.force_y_n,
                depth * load.force_x_n - x * load.normal_n,
                -load.torque_nm - ahead_x * load.force_y_n + ahead_y * load.force_x_n,
            ]
        )
        return np.concatenate([pad.rotation @ force, pad.rotation @ torque])

    def markers(self) -> NDArray[np.float64]:
        """Return the exact marker centres (n, 2) in pixels of the image."""
        return self._renderer.markers(self.gel, self.gel.state())

    @property
    def rest_markers(self) -> NDArray[np.float64]:
        """Marker centres (n, 2) of the undeformed gel, in pixels."""
        return self._renderer.rest_px

    def image(self) -> NDArray[np.uint8]:
        """Return a new camera image (240, 320, 3) uint8 RGB of the present state."""
        state = self.gel_state()
        self._images += 1
        dots = self._renderer.markers(self.gel, state)
        return self._renderer.render(self.gel, state, dots, self._time_s, self._images - 1)

    def gel_state(self) -> GelState:
        """Return a copy of the gel's history, including the object's placement."""
        place = self._place
        return dataclasses.replace(self.gel.state(), body=(place.x_m, place.y_m, place.angle_rad))

    def misplaced(self) -> dict[str, str]:
        """Return in which ways the object lies so that results are not valid, and why: "tilt", "offset", "yaw"."""
        found = {}
        if self._tilt_rad > TILT_VALID_RAD:
            tilt, most = math.degrees(self._tilt_rad), math.degrees(TILT_VALID_RAD)
            found["tilt"] = f"object is tilted by {tilt:.0f} degrees against the pad: not valid beyond {most:.0f}"
        # Bristles assume that the object lies at the pad's centre, along its y.
        if self.options.fidelity != "winkler" or self._lies is None:
            return found
        offset_m, yaw_rad = self._outline.offset_m(self._lies, self._pad_m[0]), self._outline.yaw_rad(self._lies)
        if offset_m > OFFSET_BRISTLES_M:
            found["offset"] = (
                f"contact is {offset_m * 1e3:.1f} mm off the pad's centre: the gel 'winkler' ignores that, and is not "
                f"valid beyond {OFFSET_BRISTLES_M * 1e3:g} mm; use 'pad' or 'auto'"
            )
        if yaw_rad > YAW_BRISTLES_RAD:
            found["yaw"] = (
                f"object is turned by {math.degrees(yaw_rad):.0f} degrees about the pad's normal: the gel 'winkler' "
                f"ignores that, and is not valid beyond {math.degrees(YAW_BRISTLES_RAD):.0f}; use 'pad' or 'auto'"
            )
        return found

    def truth(self) -> FingertipTruth:
        """Return the true state."""
        invalid = invalid_reasons(self._deepest_m / self._thickness_m)
        invalid += self.misplaced().values()
        if self._tilt_rad > TILT_MOST_RAD:
            invalid.append(f"beyond a tilt of {math.degrees(TILT_MOST_RAD):.0f} degrees the pad carries nothing")
        speed = self._speed if self._slips else NO_MOTION
        load = self._reaction
        return FingertipTruth(
            time_s=self._time_s,
            normal_force_n=load.normal_n,
            force_n=(load.force_x_n, load.force_y_n),
            torque_nm=load.torque_nm,
            indentation_m=self._indentation_m,
            tilt_rad=self._tilt_rad,
            velocity_m_s=(self._speed.dx_m, self._speed.dy_m),
            slip_velocity_m_s=(speed.dx_m, speed.dy_m),
            slip_angular_rad_s=speed.dtheta_rad,
            slip_distance_m=self._slip_distance_m,
            stick_ratio=self.gel.stick_ratio,
            invalid=tuple(invalid),
        )


def _moved_at(offset_m: tuple[float, float], moved: Motion) -> Motion:
    """Return the motion of a contact `offset_m` (x, y) ahead of the gel's: what turns there moves the gel, too."""
    x, y = offset_m
    return Motion(moved.dx_m - moved.dtheta_rad * y, moved.dy_m + moved.dtheta_rad * x, moved.dtheta_rad)


def _along(direction: tuple[float, float] | None, x_m: float, y_m: float) -> tuple[float, float]:
    """Return the part of a vector along a direction; all of it without a direction."""
    if direction is None:
        return x_m, y_m
    part = x_m * direction[0] + y_m * direction[1]
    return part * direction[0], part * direction[1]


_MOST_STRAIN = 0.5
"""Greatest indentation as part of the gel's thickness that a normal force may lead to, far beyond the valid range."""
_DEPTH_TRIES = 40
"""Greatest number of indentations that are tried for a force; a step needs about three, a first touch eight."""
_SAME_FORCE = 5e-4
"""Greatest relative error of the force when its indentation is sought."""
_POWER = 1.25
"""Power of the depth with which the force grows, in the search for an indentation; between a face and a ball."""
_SAME_DEPTH_M = 1e-9
"""Change of the indentation that does not press the gel again, m: 10 uN on a gel of 10 N/mm."""
_TYPICAL_M = 0.3e-3
"""Indentation at which the search for that of a force begins, m; chosen."""
_TYPICAL_SHEAR_M = 5e-6
"""Shear at which the stiffness is measured, m: nearly everything sticks."""
_ROLLING = 3.0
"""Stiffness per inertia of a cylinder that rolls on two pads and of one that moves along, as a ratio to the latter."""
_MARGIN = 0.7
"""Part of the estimated greatest stable step that is used with elastic gels, indented as deeply as is valid. Of a
capsule of 24 mm a part of 0.7 was stable there, and one of 0.9 was not (simulated)."""
_MARGIN_BRISTLES = 0.9
"""The same for bristles: steps of 1.1 times the estimate are stable (sphere, capsules, box; simulated)."""
