"""Options of the Robotiq wire mocks: faces, gripper parameters, object between the fingers."""

from __future__ import annotations

from typing import Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from lsds_mocks.wire.address import on_loopback
from lsds_mocks.wire.faults import Fault

OFF = -1
"""Port number that disables a face."""


class RobotiqOptions(BaseModel):
    """Options common to all grippers; the defaults are those of a Hand-E."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    pty: str = Field(
        default="", description="symbolic link to create to the serial line; without it, only the /dev name is printed"
    )
    host: str = Field(default="127.0.0.1", description="loopback address to listen on")
    tcp_port: int = Field(
        default=54321, ge=OFF, le=65535, description="port of RTU over TCP; 0: any free port, -1: none"
    )
    urcap_port: int = Field(
        default=63352, ge=OFF, le=65535, description="port of URCap strings; 0: any free port, -1: none"
    )
    slave: int = Field(default=9, ge=1, le=247, description="Modbus address")
    baud: int = Field(default=115200, ge=0, description="baud rate whose byte time is emulated (8N1); 0: no emulation")
    turnaround_ms: float = Field(default=3.5, ge=0, le=100, description="delay from the end of a request to its answer")
    latency_ms: float = Field(default=0.0, ge=0, le=1000, description="delay from a written command to motion")

    stroke_mm: float = Field(default=50.0, gt=0, le=200, description="aperture between the two end ticks")
    open_tick: int = Field(default=3, ge=0, le=254, description="position register when fully open")
    closed_tick: int = Field(default=228, ge=1, le=255, description="position register when fully closed")
    slowest_mm_s: float = Field(default=20.0, gt=0, le=500, description="speed at rSP 0")
    fastest_mm_s: float = Field(default=150.0, gt=0, le=500, description="speed at rSP 255")
    weakest_n: float = Field(default=20.0, gt=0, le=500, description="force at rFR 0")
    strongest_n: float = Field(default=185.0, gt=0, le=500, description="force at rFR 255")
    activated: bool = Field(default=False, description="start active, as after an earlier activation")
    activation_s: float = Field(
        default=1.5, ge=0.2, le=3, description="minimum duration of closing and opening during activation"
    )
    aperture_mm: float | None = Field(
        default=None, ge=0, description="aperture of the fingers at the start; default: open"
    )

    object_mm: float | None = Field(
        default=None,
        gt=0,
        description="width of an object between the fingers; it is put there when the gripper has been activated",
    )
    hollow_mm: float | None = Field(
        default=None,
        gt=0,
        description="inner width of an object around the fingers; it is put there when the gripper has been activated",
    )
    object_stays: bool = Field(
        default=False, description="the object is in the way of an activation, too, which fails with fault 0x0D"
    )
    stiffness_n_mm: float = Field(default=30.0, gt=0, description="stiffness of one finger on the object")
    cell: str = Field(default="", description="socket of a plant shared with other mocks")
    faults: list[Fault] = Field(default_factory=list, description="faults to inject")

    @field_validator("host")
    @classmethod
    def _loopback(cls, host: str) -> str:
        if not on_loopback(host):
            raise ValueError("a mock listens on loopback only: localhost, or one of 127.0.0.0/8")
        return host

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.closed_tick <= self.open_tick:
            raise ValueError("closed_tick must be above open_tick: 0 is open in the position register")
        if self.slowest_mm_s > self.fastest_mm_s or self.weakest_n > self.strongest_n:
            raise ValueError("slowest_mm_s and weakest_n must not be above fastest_mm_s and strongest_n")
        if self.aperture_mm is not None and self.aperture_mm > self.stroke_mm:
            raise ValueError("aperture_mm must not be above stroke_mm")
        return self


class HandEOptions(RobotiqOptions):
    """Options of the wire mock `hand-e`."""


class TwoFinger85Options(RobotiqOptions):
    """Options of the wire mock `robotiq-2f-85`."""

    stroke_mm: float = Field(default=85.0, gt=0, le=200, description="aperture between the two end ticks")
    strongest_n: float = Field(default=235.0, gt=0, le=500, description="force at rFR 255")


class TwoFinger140Options(RobotiqOptions):
    """Options of the wire mock `robotiq-2f-140`."""

    stroke_mm: float = Field(default=140.0, gt=0, le=200, description="aperture between the two end ticks")
    slowest_mm_s: float = Field(default=30.0, gt=0, le=500, description="speed at rSP 0")
    fastest_mm_s: float = Field(default=250.0, gt=0, le=500, description="speed at rSP 255")
    weakest_n: float = Field(default=10.0, gt=0, le=500, description="force at rFR 0")
    strongest_n: float = Field(default=125.0, gt=0, le=500, description="force at rFR 255")
