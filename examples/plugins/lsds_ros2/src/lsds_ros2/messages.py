"""Messages of ROS 2 from the values of lsds."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any

import lsds
import numpy as np

from geometry_msgs.msg import TwistStamped, WrenchStamped
from sensor_msgs.msg import Image

if TYPE_CHECKING:
    from lsds.contracts import FingerCycle


def image_of(finger: FingerCycle, stamp: Any) -> Image:
    """Return the image of a fingertip, encoding rgb8; its frame has the name of the finger."""
    pixels = np.ascontiguousarray(finger.frame.image)
    message = Image()
    message.header.stamp, message.header.frame_id = stamp, finger.finger
    message.height, message.width = pixels.shape[:2]
    message.encoding, message.is_bigendian, message.step = "rgb8", 0, 3 * pixels.shape[1]
    # rclpy checks an array as a whole, and anything else byte by byte.
    message.data = array("B", pixels.tobytes())
    return message


def wrench_of(finger: FingerCycle, stamp: Any) -> WrenchStamped:
    """Return the load on a finger: x right and y down in the image, z the normal force (N); torque about z (N m).

    Numbers that are not known are NaN.
    """
    message, load = WrenchStamped(), finger.observation.load
    message.header.stamp, message.header.frame_id = stamp, finger.finger
    x, y = (math.nan, math.nan) if load is None else load.shear_n
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z = float(x), float(y), math.nan if load is None else float(load.normal_n)
    torque.z = math.nan if load is None else float(load.torque_nm)
    return message


def twist_of(message: TwistStamped) -> lsds.Twist:
    """Return a velocity in the base frame, m/s and rad/s. Raises ValueError if a number is not finite."""
    linear, angular = message.twist.linear, message.twist.angular
    numbers = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    if not all(map(math.isfinite, numbers)):
        raise ValueError("the velocity has a number that is not finite")
    return lsds.Twist(numbers[:3], numbers[3:])
