"""Frozen value types of the contracts: SI units, integer-nanosecond monotonic time, named frames.

`t_ns` is always the time at which the value was true (exposure, sampling) on the rig's clock, never its time of
arrival. `seq` counts from zero at the source, so a gap means a lost sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal, Protocol

from lsds.contracts.brief import brief

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

# -- sensing ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """The properties of a tactile sensor: image size, nominal rate, scale and the markers printed on its pad.

    `pad` is (rows, columns) of printed markers, None for a gel without markers. `rate_hz` is nominal; velocities use
    measured times only. `latency_s` is the typical time from exposure until the frame can be read.
    """

    width_px: int
    height_px: int
    rate_hz: float
    metres_per_px: float
    pad: tuple[int, int] | None = None
    latency_s: float = 0.03


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Frame:
    """One tactile image: uint8, (height, width, 3), RGB.

    `redrawn` is true where a video codec has drawn the whole image again, after images with only the changes
    (a key frame): faint detail then jumps although nothing has moved.
    """

    __repr__ = brief

    image: NDArray[np.uint8]
    t_ns: int
    seq: int
    redrawn: bool = False


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid pose, base <- body: position in metres, unit quaternion as x, y, z, w."""

    position_m: Vector3
    quaternion_xyzw: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class PoseSample:
    """Poses seen by a pose source at one instant, by body name; a body out of sight is absent."""

    t_ns: int
    seq: int
    poses: dict[str, Pose]


# -- gripper ----------------------------------------------------------------------------------------------


class Contact(Enum):
    """The state of the gripper's own object detection."""

    NONE = "none"
    OPENING = "opening"
    CLOSING = "closing"


@dataclass(frozen=True, slots=True)
class GripperSpec:
    """The properties of a parallel gripper. Aperture is the gap between the fingers, 0 closed, `stroke_m` open.

    `latency_s` is the typical time from a command until the fingers move.
    """

    stroke_m: float
    resolution_m: float
    speed_m_s: tuple[float, float]
    force_n: tuple[float, float]
    latency_s: float = 0.04


@dataclass(frozen=True, slots=True)
class GripperState:
    """The state of the gripper at `t_ns`. `target_m` is the aperture that it is moving to."""

    t_ns: int
    seq: int
    aperture_m: float
    target_m: float
    moving: bool
    contact: Contact = Contact.NONE


@dataclass(frozen=True, slots=True)
class GripperCommand:
    """Go to an aperture (m) at a finger speed (m/s), pushing with at most a force (N).

    A driver must not start the motion after `expires_ns`; a motion in progress at expiry continues to its
    target, because stopping half way, or opening, would drop the object.
    """

    aperture_m: float
    speed_m_s: float
    force_n: float
    expires_ns: int


# -- arm --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Twist:
    """Linear (m/s) and angular (rad/s) velocity of the TCP in the base frame."""

    linear_m_s: Vector3 = (0.0, 0.0, 0.0)
    angular_rad_s: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ArmSpec:
    """The properties of an arm: TCP speed and acceleration limits, and reach."""

    speed_m_s: float
    acceleration_m_s2: float
    reach_m: float


@dataclass(frozen=True, slots=True)
class ArmState:
    """The state of the arm at `t_ns`; `protective_stop` is true while its controller refuses to move."""

    t_ns: int
    seq: int
    tcp_pose: Pose
    tcp_twist: Twist
    protective_stop: bool = False


@dataclass(frozen=True, slots=True)
class ArmCommand:
    """Move the TCP with a Cartesian velocity until `expires_ns`, then decelerate to rest."""

    twist: Twist
    acceleration_m_s2: float
    expires_ns: int


# -- perception -------------------------------------------------------------------------------------------


class TrackFlag(Enum):
    """The quality of a marker's track; only `OK` is valid."""

    OK = 0
    LOST = 1
    OUT_OF_VIEW = 2
    INCONSISTENT = 3
    AMBIGUOUS = 4


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MarkerReference:
    """The markers of the undeformed gel.

    `xy_px` (N, 2) float64 positions; `cell` (N, 2) int (row, column) on the printed grid; `shape` (rows, columns);
    `pitch_px` mean distance between neighbours along columns (x) and rows (y); `axes` (2, 2) unit vectors of the
    grid's x and y directions in the image, so that the field of a rotated pad is differentiated along its rows.
    """

    __repr__ = brief

    xy_px: NDArray[np.float64]
    cell: NDArray[np.intp]
    shape: tuple[int, int]
    pitch_px: Vector2
    axes: NDArray[np.float64]
    image_size: tuple[int, int]

    @property
    def count(self) -> int:
        """Number of markers in the reference."""
        return int(self.xy_px.shape[0])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MarkerTracks:
    """Positions of the reference's markers in one frame.

    `xy_px` (N, 2), NaN where lost; `valid` (N,) bool; `flags` (N,) uint8, values of `TrackFlag`.
    """

    __repr__ = brief

    t_ns: int
    seq: int
    xy_px: NDArray[np.float64]
    valid: NDArray[np.bool_]
    flags: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DeformationField:
    """Displacement of the markers against the reference, and its rate over the measured frame interval.

    `position_m` (at rest), `displacement_m`, `velocity_m_s`: (N, 2) in the sensor's plane (x right, y down in the
    image), the latter two NaN where lost. `velocity_m_s` is NaN on the first frame and where a marker was lost in
    either frame. `dt_s` is the measured interval to the previous frame, NaN on the first.
    """

    __repr__ = brief

    t_ns: int
    seq: int
    dt_s: float
    reference: MarkerReference
    position_m: NDArray[np.float64]
    displacement_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    valid: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ContactPatch:
    """The contact patch: depth map (h, w) in metres at reduced resolution, and the fraction of the image deeper than
    the declared threshold. `pitch_m` is the width of a depth pixel, NaN if it is not known."""

    __repr__ = brief

    depth_m: NDArray[np.float32]
    threshold_m: float
    area_fraction: float
    pitch_m: float = math.nan


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FeatureVector:
    """Named features of one frame; `values` (F,) float64 in the order of `names`, NaN where undefined."""

    __repr__ = brief

    names: tuple[str, ...]
    values: NDArray[np.float64]

    def __getitem__(self, name: str) -> float:
        try:
            return float(self.values[self.names.index(name)])
        except ValueError:
            raise KeyError(f"no feature {name!r}; the features are {', '.join(self.names)}") from None


@dataclass(frozen=True, slots=True)
class ContactLoad:
    """The load of the object on the gel of one finger, in the sensor's plane (x right, y down in the image).

    `shear_n` force and `torque_nm` about the image's centre (positive from x to y), with one sigma of each. In newtons
    after calibration, else to a common factor. `normal_n` is what presses on the gel, NaN where the imprint does not
    tell.
    """

    shear_n: Vector2
    torque_nm: float
    shear_std_n: float
    torque_std_nm: float
    normal_n: float = math.nan
    normal_std_n: float = math.nan

    def since(self, before: ContactLoad) -> ContactLoad:
        """Return what has been added since another load; the normal force is that of now."""
        (x, y), (x0, y0) = self.shear_n, before.shear_n
        return replace(self, shear_n=(x - x0, y - y0), torque_nm=self.torque_nm - before.torque_nm)

    @property
    def force_n(self) -> float:
        """Magnitude of the shear force."""
        return math.hypot(*self.shear_n)


@dataclass(frozen=True, slots=True)
class Slide:
    """A slip that is wanted: how fast the object is to slide and to turn against the gel, without sign."""

    speed_m_s: float = 0.0
    rate_rad_s: float = 0.0


class Evidence(Protocol):
    """The signature of slip in the velocity field of a frame, see `lsds.tactile.slip_residual`."""

    def __call__(self, motion: Literal["rigid", "affine", "quadratic"] = "quadratic", least: int = 6) -> Any:
        """Return a `SlipResidual`; None with fewer than `least` markers in contact or no velocity."""
        ...


class Imprint(Protocol):
    """The motion of the object's imprint since the frame before, see `lsds.tactile.imprint`."""

    def __call__(self) -> Any:
        """Return an `ImprintMotion`; None on the first frame, with too few markers for the gel's motion, or without
        any edge in the image."""
        ...

    def recent(self) -> list[Any]:
        """Return the motions of this and the last few frames, the newest first, up to where one is not known."""
        ...


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Observation:
    """The input of a detector or an estimator: the present frame and nothing of the future.

    `frame` is the image with its views, `evidence` the signature of slip in the velocity field, `imprint` the motion of
    the object's imprint against the gel (`lsds.tactile`); each is computed once, on first use. `load` is what pulls at
    the gel since the reference (`lsds.tactile.contact_load`), None with too few markers. All are None in an
    observation that was not made by perception.
    `lost_share` is the share of the markers that were followed in the last frame and are lost in this one: what slips
    fast takes them along.
    """

    __repr__ = brief

    t_ns: int
    seq: int
    dt_s: float
    field: DeformationField
    contact: ContactPatch | None
    features: FeatureVector
    frame: Frame | None = None
    evidence: Evidence | None = None
    imprint: Imprint | None = None
    load: ContactLoad | None = None
    lost_share: float = 0.0


@dataclass(frozen=True, slots=True)
class Detection:
    """The result of a detector. `slip` None means that it abstains.

    `score` is the detector's statistic and `threshold` the value above which it reports slip; `confidence` in [0, 1] is
    the confidence in `slip`. `probability` is the calibrated probability of slip, NaN from a detector that knows none.
    """

    slip: bool | None
    score: float
    threshold: float
    confidence: float
    probability: float = math.nan


UNANSWERED = Detection(None, math.nan, math.nan, 0.0)
"""The detection of a detector that abstains."""


@dataclass(frozen=True, slots=True)
class SlipEstimate:
    """The slip velocity of the object against the gel, in the sensor's plane (x right, y down in the image).

    Standard deviations are one sigma of the estimator's error model. If `abstained` is true, the numbers are not valid.
    """

    velocity_m_s: Vector2
    velocity_std_m_s: Vector2
    angular_rad_s: float
    angular_std_rad_s: float
    speed_m_s: float
    speed_std_m_s: float
    abstained: bool = False


ABSTAINED = SlipEstimate((math.nan, math.nan), (math.nan, math.nan), math.nan, math.nan, math.nan, math.nan, True)
"""The estimate of an estimator that abstains."""


@dataclass(frozen=True, slots=True)
class CellTruth:
    """The true state of a simulated cell at `t_ns`, per finger unless stated otherwise.

    `slip_velocity_m_s` (x, y) is the object's velocity against the gel's base in the sensor's plane, counted only in
    gross slip (zero while more than a tenth of the contact patch sticks); `relative_velocity_m_s` always counts.
    `slip_distance_m` is the integral of slip speed. `supported` is true while the object rests on the table.
    """

    t_ns: int
    slip_velocity_m_s: Vector2
    relative_velocity_m_s: Vector2
    slip_angular_rad_s: float
    slip_distance_m: float
    stick_ratio: float
    normal_force_n: float
    tangential_force_n: float
    required_normal_force_n: float
    aperture_m: float
    object_height_m: float
    supported: bool
    dropped: bool
