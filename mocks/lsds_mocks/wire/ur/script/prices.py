"""Prices of the controller's functions, in units of work (`work`); measured for expensive functions.

List functions pay in addition for the size of their arguments if that matters.
"""

from __future__ import annotations

USUAL = 20
"""Price of a function that is not in `PRICES`, units of work; chosen."""
MOVE = 3000
"""Price of any motion, which plans its path at the start."""

PRICES: dict[str, int] = dict.fromkeys(
    ("movej", "movel", "movep", "movec", "optimovej", "optimovel", "servoc", "servoj", "speedj", "speedl"), MOVE
) | {
    "stopj": 1000,
    "stopl": 1000,
    "get_inverse_kin": 1600,
    "get_inverse_kin_has_solution": 1600,
    "is_within_safety_limits": 1600,
    "get_forward_kin": 200,
    "get_actual_tool_flange_pose": 200,
    "get_actual_tcp_speed": 200,
    "get_target_tcp_speed": 200,
    "get_jacobian": 600,
    "get_jacobian_time_derivative": 1200,
    "get_mass_matrix": 150,
    "get_joint_torques": 600,
    "force": 150,
    "tool_contact": 100,
    "force_mode": 800,
    "pose_trans": 250,
    "pose_inv": 120,
    "pose_add": 300,
    "pose_sub": 300,
    "pose_dist": 300,
    "point_dist": 300,
    "interpolate_pose": 500,
    "wrench_trans": 500,
    "rotvec2rpy": 80,
    "rpy2rotvec": 500,
    "norm": 40,
    "integer_to_binary_list": 200,
    "to_str": 40,
    "str_cat": 60,
    "textmsg": 400,
    "popup": 400,
    "set_tcp": 60,
    "protective_stop": 1000,
    "socket_open": 2000,
    "socket_close": 300,
    "socket_send_int": 300,
    "socket_send_byte": 300,
    "socket_send_string": 300,
    "socket_send_line": 300,
    "socket_set_var": 300,
    "socket_get_var": 600,
    "socket_read_binary_integer": 300,
    "socket_read_byte_list": 300,
    "socket_read_ascii_float": 300,
    "socket_read_line": 300,
    "socket_read_string": 300,
}


def price(name: str) -> int:
    """Return the price of calling a function."""
    return PRICES.get(name, USUAL)
