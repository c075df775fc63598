"""Script functions on numbers, lists, poses and strings; independent of the arm.

The price of a call depends on the size of its arguments and of its result (`script/work`).
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from lsds_mocks.wire.ur.pose_math import between, compose, difference, inverse, norm, rotation_of
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.operations import MOST_ELEMENTS, Operations, whole
from lsds_mocks.wire.ur.script.values import Pose, UrList

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.script.work import Work

INTEGER_BITS = 32
"""Number of bits of an integer of URScript."""
_RANDOM = random.Random(0)


def _norm(value: Any) -> float:
    return norm(value) if isinstance(value, list) else abs(value)


def _pose_add(a: Any, b: Any) -> Pose:
    # Translations add; rotations multiply.
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


def _pow(base: Any, exponent: Any) -> Any:
    return float(base) ** float(exponent)


def _floor(value: Any) -> int:
    return whole(math.floor(float(value)))


def _ceil(value: Any) -> int:
    return whole(math.ceil(float(value)))


def _to_num(text: Any) -> float | int:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ScriptError(f"to_num: '{str(text)[:40]}' is no number")
    is_integer = not any(mark in str(text) for mark in ".eE") and abs(number) < 2**31
    return int(number) if is_integer else number


def _str_at(text: str, index: Any) -> str:
    return text[_place(text, index, len(text) - 1)]


def _str_sub(text: str, index: Any, length: Any = None) -> str:
    first = _place(text, index, len(text))
    return text[first:] if length is None else text[first : first + max(0, int(length))]


def _str_find(text: str, target: str, start: Any = 0) -> int:
    return text.find(target, _place(text, start, len(text)))


def _place(text: str, index: Any, last: int) -> int:
    if not isinstance(text, str):
        raise ScriptError("type_error: a string is expected")
    if not 0 <= int(index) <= last:
        raise ScriptError(f"index {int(index)} is out of range: 0 to {last}")
    return int(index)


def _binary_to_integer(bits: Any) -> int:
    if len(bits) > INTEGER_BITS:
        raise ScriptError(f"binary_list_to_integer: an integer has {INTEGER_BITS} bits")
    return sum(int(bool(bit)) << place for place, bit in enumerate(bits))


def _integer_to_binary(number: Any) -> UrList:
    return UrList([bool(int(number) >> place & 1) for place in range(INTEGER_BITS)])


def _size(value: Any) -> Any:
    if isinstance(value, list) and value and isinstance(value[0], list):
        return UrList([len(value), len(value[0])])
    return len(value)


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
    "pow": _pow,
    "log": lambda base, number: math.log(number, base),
    "ceil": _ceil,
    "floor": _floor,
    "d2r": math.radians,
    "r2d": math.degrees,
    "norm": _norm,
    "length": len,
    "size": _size,
    "get_list_length": len,
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
    "str_len": len,
    "str_at": _str_at,
    "str_empty": lambda text: text == "",
    "str_find": _str_find,
    "str_sub": _str_sub,
    "to_num": _to_num,
    "binary_list_to_integer": _binary_to_integer,
    "integer_to_binary_list": _integer_to_binary,
    "int": _floor,
}


class _Growing:
    """Functions whose result may be much larger than their arguments, so that they pay in advance."""

    def __init__(self, work: Work, operations: Operations) -> None:
        self._work = work
        self._operations = operations

    def make_list(self, length: Any, initial: Any = 0, *_: Any) -> UrList:
        """Return a list of copies of a value."""
        if int(length) > MOST_ELEMENTS:
            raise ScriptError(f"make_list: a list has at most {MOST_ELEMENTS} elements")
        self._work.spend(2 * max(0, int(length)))
        return UrList([self._operations.copied(initial) for _ in range(int(length))])

    def transpose(self, matrix: Any) -> UrList:
        """Return the transpose of a matrix."""
        self._work.spend(4 * sum(map(len, matrix)))
        return UrList([UrList(row) for row in zip(*matrix, strict=True)])

    def str_cat(self, a: Any, b: Any) -> str:
        """Return the concatenated texts of two values."""
        return self._operations.text(a) + self._operations.text(b)

    def to_str(self, value: Any) -> str:
        """Return a value's text."""
        return self._operations.text(value)


NAMES = (*FUNCTIONS, "make_list", "transpose", "str_cat", "to_str")


def functions(work: Work, operations: Operations) -> dict[str, Callable[..., Any]]:
    """Return all functions by their names in scripts; each pays for its arguments and its result."""
    growing = _Growing(work, operations)
    found = FUNCTIONS | {name: getattr(growing, name) for name in NAMES if name not in FUNCTIONS}
    return {name: _paying(function, work, operations) for name, function in found.items()}


def _paying(function: Callable[..., Any], work: Work, operations: Operations) -> Callable[..., Any]:
    def called(*arguments: Any, **named: Any) -> Any:
        for argument in arguments:
            if isinstance(argument, (list, str)):
                work.spend(2 * len(argument))
        return operations.checked(function(*arguments, **named))

    return called
