"""Messages between the plant and the wire faces, one packet each."""

from __future__ import annotations

import struct
from enum import IntEnum

import numpy as np

from lsds.contracts import CellTruth
from lsds.contracts.plant_links import FingerState, Load, Scene
from lsds_mocks.gel.state import GelState


class Kind(IntEnum):
    """First byte of every packet."""

    WANT = 1
    DRIVE = 2
    HOLD = 3
    FOLLOW = 4
    ASK_GEL = 5
    ASK_SCENE = 6
    FINGERS = 7
    LOAD = 8
    GEL = 9
    SCENE = 10
    TRUTH = 11
    ASK_OPTIONS = 12
    OPTIONS = 13
    RESET = 14


class Want(IntEnum):
    """The state that a client receives at every step."""

    NOTHING = 0
    FINGERS = 1
    LOAD = 2
    TRUTH = 3


LARGEST_MESSAGE = 1 << 20
"""Size of the buffer that receives a packet, bytes; chosen."""
WANT = struct.Struct("<BB")
DRIVE = struct.Struct("<B3d")
FOLLOW = struct.Struct("<Bq2d")
ASK = struct.Struct("<Bq")
_FINGERS = struct.Struct("<Bq2d2?d")
_LOAD = struct.Struct("<Bqd")
_SCENE = struct.Struct("<Bq?2d")
_TRUTH = struct.Struct("<Bq12d2?")
_GEL = struct.Struct("<Bqi?4dB6d")
_NO_GEL = -1
"""Number of points in an answer without a gel state; without contact the number is 0."""


def pack_fingers(f: FingerState) -> bytes:
    """Return the packet."""
    return _FINGERS.pack(Kind.FINGERS, f.t_ns, f.aperture_m, f.target_m, f.moving, f.stalled, f.normal_n)


def unpack_fingers(data: bytes) -> FingerState:
    """Return what a packet holds."""
    return FingerState(*_FINGERS.unpack(data)[1:])


def pack_load(load: Load) -> bytes:
    """Return the packet."""
    return _LOAD.pack(Kind.LOAD, load.t_ns, load.pull_n)


def unpack_load(data: bytes) -> Load:
    """Return what a packet holds."""
    return Load(*_LOAD.unpack(data)[1:])


def pack_scene(t_ns: int, scene: Scene | None) -> bytes:
    """Return the answer for an instant."""
    arm, body = (0.0, 0.0) if scene is None else (scene.arm_m, scene.object_m)
    return _SCENE.pack(Kind.SCENE, t_ns, scene is not None, arm, body)


def unpack_scene(data: bytes) -> tuple[int, Scene | None]:
    """Return the instant asked for, and the scene or None."""
    _, t_ns, known, arm, body = _SCENE.unpack(data)
    return t_ns, Scene(t_ns, arm, body) if known else None


def pack_truth(t: CellTruth) -> bytes:
    """Return the packet."""
    return _TRUTH.pack(
        Kind.TRUTH,
        t.t_ns,
        *t.slip_velocity_m_s,
        *t.relative_velocity_m_s,
        t.slip_angular_rad_s,
        t.slip_distance_m,
        t.stick_ratio,
        t.normal_force_n,
        t.tangential_force_n,
        t.required_normal_force_n,
        t.aperture_m,
        t.object_height_m,
        t.supported,
        t.dropped,
    )


def unpack_truth(data: bytes) -> CellTruth:
    """Return what a packet holds."""
    _, t_ns, sx, sy, rx, ry, *rest = _TRUTH.unpack(data)
    return CellTruth(t_ns, (sx, sy), (rx, ry), *rest)


def pack_gel(t_ns: int, state: GelState | None) -> bytes:
    """Return the answer for an instant."""
    if state is None:
        return _GEL.pack(Kind.GEL, t_ns, _NO_GEL, False, *[0.0] * 4, 0, *[0.0] * 6)
    points = state.pressure_n.shape[0]
    reach = state.reach_m
    low, high = (0.0, 0.0) if reach is None else reach
    head = _GEL.pack(
        Kind.GEL,
        t_ns,
        points,
        reach is not None,
        state.indentation_m,
        state.normal_force_n,
        low,
        high,
        state.fine,
        *state.placement,
        *state.body,
    )
    arrays = (state.deflection_m, state.shear_n, state.pressure_n)
    cells = state.cells if len(state.cells) else np.zeros(points)
    numbers = b"".join(np.ascontiguousarray(a, "<f8").tobytes() for a in arrays)
    return head + numbers + state.slid.tobytes() + np.ascontiguousarray(cells, "<i4").tobytes()


def unpack_gel(data: bytes) -> tuple[int, GelState | None]:
    """Return the instant asked for, and the gel's state or None."""
    _, t_ns, points, has_reach, depth, force, low, high, fine, *place = _GEL.unpack_from(data)
    if points == _NO_GEL:
        return t_ns, None
    numbers = np.frombuffer(data, "<f8", 5 * points, _GEL.size)
    slid = np.frombuffer(data, np.bool_, points, _GEL.size + 40 * points)
    deflection, shear = numbers[: 2 * points].reshape(2, points), numbers[2 * points : 4 * points].reshape(2, points)
    reach = (low, high) if has_reach else None
    cells = np.frombuffer(data, "<i4", points, _GEL.size + 41 * points).copy() if fine else np.zeros(0, np.int32)
    x, y, angle, *body = place
    pressure = numbers[4 * points :]
    return t_ns, GelState(
        deflection, shear, pressure, slid, depth, force, reach, fine, cells, (x, y, angle), (body[0], body[1], body[2])
    )
