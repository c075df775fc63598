"""Functions of numbers, lists, poses and strings; independent of the arm."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

from lsds_mocks.wire.ur.pose_math import between, compose, difference, inverse, norm, rotation_of
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.program import LENGTH
from lsds_mocks.wire.ur.script.values import Pose, UrList, copied, to_text

_RANDOM = random.Random(0)


def _norm(value: Any) -> float:
    return norm(value) if isinstance(value, list) else abs(value)


def _pose_add(a: Any, b: Any) -> Pose:
    # Translations add; rotations follow each other.
    turned = compose([0, 0, 0, *a[3:]], [0, 0, 0, *b[3:]])
    return Pose([*(x + y for x, y in zip(a[:3], b[:3], strict=True)), *turned[3:]])


def _pose_sub(to: Any, start: Any) -> Pose:
    shift, rotation = difference(start, to)
    return Pose([*shift, *rotation])


def _wrench_trans(frame: Any, wrench: Any) -> UrList:
    force, torque = wrench[:3], wrench[3:]
    turned = compose([0, 0, 0, *frame[3:]], [*force, 0, 0, 0])[:3]
    moment = compose([0, 0, 0, *frame[3:]], [*torque, 0, 0, 0])[:3]
    x, y, z = frame[:3]
    arm = [y * turned[2] - z * turned[1], z * turned[0] - x * turned[2], x * turned[1] - y * turned[0]]
    return UrList([*turned, *(m + r for m, r in zip(moment, arm, strict=True))])


def _rpy_to_rotvec(rpy: Any) -> UrList:
    roll, pitch, yaw = rpy
    turned = compose(compose([0, 0, 0, 0, 0, yaw], [0, 0, 0, 0, pitch, 0]), [0, 0, 0, roll, 0, 0])
    return UrList(turned[3:])


def _rotvec_to_rpy(vector: Any) -> UrList:
    (a, b, _c), (d, e, _f), (g, h, i) = rotation_of(vector)
    pitch = math.asin(min(max(-g, -1.0), 1.0))
    if abs(math.cos(pitch)) < 1e-9:
        return UrList([math.atan2(-b, e) if g < 0 else math.atan2(b, e), pitch, 0.0])
    return UrList([math.atan2(h, i), pitch, math.atan2(d, a)])


def _integer(value: Any) -> int:
    return math.floor(float(value))


def _to_num(text: Any) -> float | int:
    try:
        return float(text) if any(mark in str(text) for mark in ".eE") else int(text)
    except ValueError:
        raise ScriptError(f"to_num: '{text}' is no number") from None


def _str_sub(text: str, index: int, length: int | None = None) -> str:
    return text[int(index) :] if length is None else text[int(index) : int(index) + int(length)]


def _list(length: Any, initial: Any = 0, *_: Any) -> UrList:
    if int(length) > LENGTH:
        raise ScriptError(f"make_list: a list has at most {LENGTH} elements")
    return UrList([copied(initial) for _ in range(int(length))])


def _binary_to_integer(*bits: Any) -> int:
    return sum(int(bool(bit)) << place for place, bit in enumerate(bits))


def _integer_to_binary(number: Any) -> UrList:
    return UrList([bool(int(number) >> place & 1) for place in range(32)])


def _size(value: Any) -> Any:
    if isinstance(value, list) and value and isinstance(value[0], list):
        return UrList([len(value), len(value[0])])
    return len(value)


def _mat_transpose(value: Any) -> UrList:
    return UrList([UrList(row) for row in zip(*value, strict=True)])


def _joined(a: Any, b: Any) -> str:
    text = to_text(a) + to_text(b)
    if len(text) > LENGTH:
        raise ScriptError(f"str_cat: a text has at most {LENGTH} characters")
    return text


def _random() -> float:
    return _RANDOM.random()


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "sqrt": math.sqrt,
    "pow": lambda base, exponent: float(base) ** exponent,
    "log": lambda base, number: math.log(number, base),
    "ceil": lambda value: math.ceil(value),
    "floor": lambda value: math.floor(value),
    "d2r": math.radians,
    "r2d": math.degrees,
    "norm": _norm,
    "length": len,
    "size": _size,
    "transpose": _mat_transpose,
    "get_list_length": len,
    "make_list": _list,
    "random": _random,
    "pose_trans": lambda a, b: Pose(compose(a, b)),
    "pose_inv": lambda a: Pose(inverse(a)),
    "pose_add": _pose_add,
    "pose_sub": _pose_sub,
    "pose_dist": lambda a, b: norm([x for part in difference(a, b) for x in part]),
    "point_dist": lambda a, b: norm(difference(a, b)[0]),
    "interpolate_pose": lambda a, b, share: Pose(between(a, b, share)),
    "wrench_trans": _wrench_trans,
    "rotvec2rpy": _rotvec_to_rpy,
    "rpy2rotvec": _rpy_to_rotvec,
    "str_cat": _joined,
    "str_len": len,
    "str_at": lambda text, index: text[int(index)],
    "str_empty": lambda text: text == "",
    "str_find": lambda text, target, start=0: text.find(target, int(start)),
    "str_sub": _str_sub,
    "to_str": to_text,
    "to_num": _to_num,
    "binary_list_to_integer": lambda bits: _binary_to_integer(*bits),
    "integer_to_binary_list": _integer_to_binary,
    "int": _integer,
}
"""By the script's name."""
