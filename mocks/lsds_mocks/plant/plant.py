"""The plant: fingers, gel, friction, object and arm, advanced together by one fixed step."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lsds.contracts import CellTruth
from lsds_mocks.gel.placement import ORIGIN
from lsds_mocks.plant.changes import Changes
from lsds_mocks.plant.lift import ObjectMotion, step_object
from lsds_mocks.plant.physics import FINGERS, OPEN_APERTURE_M, Physics
from lsds_mocks.plant.planar import Body, PlanarMotion, step_planar
from lsds_mocks.plant.slip import drops, radius_of_gyration_m, sliding_speed_m_s, slips
from lsds_mocks.plant.squeeze import Squeeze

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel, Reaction
    from lsds_mocks.gel.state import GelState
    from lsds_mocks.plant.friction import SurfaceFriction
    from lsds_mocks.plant.vibration import Vibration


@dataclass(frozen=True, slots=True)
class PlantParameters:
    """Parameters of a plant, in SI units.

    The object: thickness between the pads, width and length in their plane, mass, distance of its centre of mass to the
    right of the pads, and whether it is clamped to the table. The grip: initial height of the pads' centre above the
    table, normal stiffness of one finger, pad height and thickness, and the slip that counts as dropped. `theta` is the
    point of a step at which forces are evaluated: 1 at its end, 1/2 in its middle.
    """

    diameter_m: float
    width_m: float
    length_m: float
    mass_kg: float
    grip_height_m: float
    finger_n_m: float
    drop_slip_m: float
    pad_height_m: float
    centre_x_m: float = 0.0
    theta: float = 1.0
    pad_thickness_m: float = 4e-3
    clamped: bool = False


class Plant(Physics):
    """The moving parts of a cell. One gel represents both fingers, which are identical.

    `travel_m` is the object's displacement down (+y) relative to the gel since the start.
    """

    def __init__(
        self,
        parameters: PlantParameters,
        gel: GelModel,
        friction: SurfaceFriction,
        vibration: Vibration,
        changes: Changes | None = None,
    ) -> None:
        super().__init__(parameters.grip_height_m)
        self.parameters = parameters
        self.gel = gel
        self.friction = friction
        self.vibration = vibration
        self._changes = changes or Changes()
        self._time_s = 0.0
        self._shake_m = 0.0
        # An object held in line with its centre of mass does not rotate, which leaves one unknown instead of three.
        planar = parameters.centre_x_m or parameters.clamped
        self.body = PlanarMotion(clamped=parameters.clamped) if planar else ObjectMotion()
        self.slip_x_m_s = 0.0
        self.slip_rate_rad_s = 0.0
        self.travel_m = 0.0
        self.relative_m_s = self.relative_x_m_s = self.relative_rad_s = 0.0
        self.slip_m_s = 0.0
        self.slip_distance_m = 0.0
        self.normal_n = 0.0
        self.tangential_n = 0.0
        self.dropped = False
        self._squeeze = Squeeze(gel, parameters.finger_n_m)
        self._pressed_at: tuple[float, tuple[float, float] | None] = (OPEN_APERTURE_M, None)

    def step(self, dt_s: float) -> None:
        """Advance by one step."""
        self._time_s += dt_s
        self._changes.step(self._time_s, self.normal_n > 0 and not self.body.supported)
        self.friction.scale(self._changes.friction(self._time_s))
        self.arm.step(dt_s)
        self.turn.step(dt_s)
        shaken, self._shake_m = self._shake_m, self.vibration.displacement_m(self._time_s)
        self.fingers.step(dt_s, self.normal_n)
        pressed = self._press()
        travelled = self.travel_m
        gel = self.gel
        points = gel.points_m
        speed = self._sliding_speed()
        if self.normal_n > 0 and (self.friction.changed(points, travelled, speed) or pressed):
            gel.set_friction(self.friction.at(points, travelled, gel.sliding, speed))
        before = self.body.place if isinstance(self.body, PlanarMotion) else ORIGIN
        reaction = self._move(self.arm.velocity_m_s + (self._shake_m - shaken) / dt_s, dt_s)
        self.tangential_n = math.hypot(reaction.force_x_n, reaction.force_y_n)
        self.normal_n = reaction.normal_n
        if isinstance(self.body, PlanarMotion):
            after = self.body.place
            # Travel is measured along the object's axis: rotation about the pads' centre does not count.
            self.travel_m = after.y_m * math.cos(after.angle_rad) - after.x_m * math.sin(after.angle_rad)
            # Slip is the step's motion at the pads' centre, not at the object's origin, which may be far away.
            turned = after.angle_rad - before.angle_rad
            still = before.moved(0.0, 0.0, turned)
            self.relative_m_s = (after.y_m - still.y_m) / dt_s
            self.relative_x_m_s = (after.x_m - still.x_m) / dt_s
            self.relative_rad_s = turned / dt_s
        else:
            self.travel_m = self.arm.position_m + self._shake_m - self.parameters.grip_height_m - self.body.height_m
            self.relative_m_s = (self.travel_m - travelled) / dt_s
        sliding = slips(gel, self.normal_n)
        self.slip_m_s = self.relative_m_s if sliding else 0.0
        self.slip_x_m_s = self.relative_x_m_s if sliding else 0.0
        self.slip_rate_rad_s = self.relative_rad_s if sliding else 0.0
        self.slip_distance_m += math.hypot(self.slip_m_s, self.slip_x_m_s) * dt_s
        self.dropped = self.dropped or drops(
            self.normal_n, self.body.supported, self.slip_distance_m, self.parameters.drop_slip_m
        )

    def gel_state(self) -> GelState:
        """Return a copy of the gel's history, including the object's placement."""
        state = self.gel.state()
        place = self.body.place if isinstance(self.body, PlanarMotion) else (0.0, self.travel_m, 0.0)
        return dataclasses.replace(state, body=(place[0], place[1], place[2]))

    def _sliding_speed(self) -> float:
        # Most objects do not rotate, and the radius takes longer than the rest.
        radius_m = radius_of_gyration_m(self.gel.points_m) if self.relative_rad_s else 0.0
        return sliding_speed_m_s(self.relative_x_m_s, self.relative_m_s, self.relative_rad_s, radius_m)

    def _move(self, carrier_velocity_m_s: float, dt_s: float) -> Reaction:
        """Move the object by one step while the gel's base rises at a velocity; return the gel's reaction."""
        own, mass_kg, push_n = self.parameters, self.mass_kg, self._changes.push_n(self._time_s)
        limit = self.normal_n * 2 * self.friction.static
        if not isinstance(self.body, PlanarMotion):
            return step_object(
                self.body,
                self.gel,
                carrier_velocity_m_s=carrier_velocity_m_s,
                mass_kg=mass_kg,
                dt_s=dt_s,
                fingers=FINGERS,
                limit_n=limit,
                theta=own.theta,
                push_n=push_n,
            )
        inertia = mass_kg * (own.length_m**2 + own.width_m**2) / 12
        body = Body(mass_kg, inertia, (own.centre_x_m, own.grip_height_m - own.length_m / 2))
        return step_planar(
            self.body,
            self.gel,
            body,
            carrier_velocity_m_s=carrier_velocity_m_s,
            carrier_rate_rad_s=self.turn.velocity_m_s,
            dt_s=dt_s,
            fingers=FINGERS,
            limit_n=limit,
            theta=own.theta,
            push_n=push_n,
        )

    def _press(self) -> bool:
        """Update the normal force if fingers, object's end or force have changed; return whether they have."""
        reach = self._reach()
        closure = (self.parameters.diameter_m - self.fingers.aperture_m) / 2
        key = (self.fingers.aperture_m, reach)
        if key == self._pressed_at and not (closure > 0 and self._squeeze.is_off(closure, self.normal_n)):
            return False
        self._pressed_at = key
        self.normal_n = self._squeeze.close(closure, reach)
        return True

    def _reach(self) -> tuple[float, float] | None:
        """Range of the pad (y, down) that the object covers; None if it covers all of it."""
        half = self.parameters.pad_height_m / 2
        above_foot = self.parameters.grip_height_m + self.travel_m
        to_top = self.parameters.length_m - above_foot
        if above_foot >= half and to_top >= half:
            return None
        return max(-half, -to_top), min(half, above_foot)

    @property
    def can_turn(self) -> bool:
        """Whether the arm may rotate the pads, which is modelled only for a clamped object."""
        return self.parameters.clamped

    @property
    def greatest_strain(self) -> float:
        """Greatest indentation so far, as part of the gel's thickness."""
        return self._squeeze.deepest_m / self.parameters.pad_thickness_m

    @property
    def object_height_m(self) -> float:
        """Height of the object above its start, m."""
        return self.body.height_m

    @property
    def object_velocity_m_s(self) -> float:
        """Upward velocity of the object, m/s."""
        return self.body.velocity_m_s

    @property
    def mass_kg(self) -> float:
        """Mass of the object including poured-in material, kg."""
        return self.parameters.mass_kg * self._changes.mass(self._time_s)

    @property
    def required_normal_n(self) -> float:
        """Least normal force per finger that carries the object against gravity, the arm's acceleration and a push."""
        return self.normal_for(self.mass_kg, self.friction.static, self._changes.push_n(self._time_s))

    def truth(self, t_ns: int) -> CellTruth:
        """Return the truth, stamped `t_ns`."""
        return CellTruth(
            t_ns=t_ns,
            slip_velocity_m_s=(self.slip_x_m_s, self.slip_m_s),
            relative_velocity_m_s=(self.relative_x_m_s, self.relative_m_s),
            slip_angular_rad_s=self.slip_rate_rad_s,
            slip_distance_m=self.slip_distance_m,
            stick_ratio=self.gel.stick_ratio,
            normal_force_n=self.normal_n,
            tangential_force_n=self.tangential_n,
            required_normal_force_n=self.required_normal_n,
            aperture_m=self.fingers.aperture_m,
            object_height_m=self.object_height_m,
            supported=self.body.supported,
            dropped=self.dropped,
        )
