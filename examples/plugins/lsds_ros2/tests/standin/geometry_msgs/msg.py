"""Velocities and forces."""

from __future__ import annotations

from dataclasses import dataclass, field

from std_msgs.msg import Header


@dataclass
class Vector3:
    """A vector."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Twist:
    """Linear and angular velocity."""

    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
class TwistStamped:
    """A velocity with its time and frame."""

    header: Header = field(default_factory=Header)
    twist: Twist = field(default_factory=Twist)


@dataclass
class Wrench:
    """Force and torque."""

    force: Vector3 = field(default_factory=Vector3)
    torque: Vector3 = field(default_factory=Vector3)


@dataclass
class WrenchStamped:
    """Force and torque with their time and frame."""

    header: Header = field(default_factory=Header)
    wrench: Wrench = field(default_factory=Wrench)
