"""Options of the Robotiq drivers."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, Self
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from lsds_drivers.robotiq.figures import HAND_E, TWO_FINGER, Figures


class GripperOptions(BaseModel):
    """Options common to all Robotiq drivers. The default of a figure is the value of the model's manual."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    stroke_mm: float | None = Field(default=None, gt=0, le=200, description="aperture between fully open and closed")
    slowest_mm_s: float | None = Field(default=None, gt=0, le=500, description="speed at the lowest setting")
    fastest_mm_s: float | None = Field(default=None, gt=0, le=500, description="speed at the highest setting")
    weakest_n: float | None = Field(default=None, gt=0, le=500, description="force at the lowest setting")
    strongest_n: float | None = Field(default=None, gt=0, le=500, description="force at the highest setting")
    open_count: int = Field(default=3, ge=0, le=254, description="position register when fully open")
    closed_count: int = Field(default=228, ge=1, le=255, description="position register when fully closed")
    calibrate: bool = Field(default=False, description="arming closes and opens the fingers to measure both registers")
    keep_activation: bool = Field(default=True, description="arming moves nothing if the gripper is already active")
    poll_hz: float = Field(default=100.0, gt=0, le=190, description="rate of status readings")
    answer_timeout_ms: float = Field(
        default=100.0,
        gt=0,
        le=5000,
        description="maximum time for an answer; a request is repeated sooner if answers usually arrive sooner",
    )
    connect_timeout_s: float = Field(default=2.0, gt=0, le=60, description="time limit of connect()")
    activation_timeout_s: float = Field(default=5.0, gt=0, le=60, description="time limit of an activation")
    stale_after_ms: float = Field(default=300.0, gt=0, le=10_000, description="age above which a state is StaleData")
    reconnect_after_s: float = Field(default=1.0, gt=0, le=60, description="silence after which the port is reopened")
    life_check_s: float = Field(
        default=0.5,
        ge=0,
        le=60,
        description="time without a change of its status after which a gripper at rest is tested: its go-to bit is "
        "cleared and set again (not tried on a real gripper); 0: never",
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        figures = self.figures()
        if figures.closed_count <= figures.open_count:
            raise ValueError("closed_count must be above open_count: 0 is open in the position register")
        if figures.speed_m_s[0] >= figures.speed_m_s[1] or figures.force_n[0] >= figures.force_n[1]:
            raise ValueError("slowest_mm_s and weakest_n must be below fastest_mm_s and strongest_n")
        return self

    def figures(self) -> Figures:
        """Return the gripper's figures: those of the model, replaced by the options that are set."""
        base = self._base()
        slow, fast = base.speed_m_s
        weak, strong = base.force_n
        return replace(
            base,
            stroke_m=base.stroke_m if self.stroke_mm is None else self.stroke_mm * 1e-3,
            speed_m_s=(
                slow if self.slowest_mm_s is None else self.slowest_mm_s * 1e-3,
                fast if self.fastest_mm_s is None else self.fastest_mm_s * 1e-3,
            ),
            force_n=(
                weak if self.weakest_n is None else self.weakest_n,
                strong if self.strongest_n is None else self.strongest_n,
            ),
            open_count=self.open_count,
            closed_count=self.closed_count,
        )

    def _base(self) -> Figures:
        return HAND_E


class HandEOptions(GripperOptions):
    """Options of `[gripper.hand-e]`."""

    port: str = Field(
        description="serial port such as /dev/ttyUSB0, or tcp://host:port for RTU over TCP; lsds devices lists ports"
    )
    slave: int = Field(default=9, ge=1, le=247, description="Modbus address")
    baud: int = Field(default=115200, gt=0, description="baud rate of the serial port")

    @field_validator("port")
    @classmethod
    def _known_form(cls, port: str) -> str:
        tcp_address(port)
        if not port:
            raise ValueError("is empty; `lsds devices` lists the available ports")
        return port


class TwoFingerOptions(HandEOptions):
    """Options of `[gripper.robotiq-2f]`."""

    model: Literal[85, 140] = Field(default=85, description="2F-85 or 2F-140")

    def _base(self) -> Figures:
        return TWO_FINGER[self.model]


class UrcapOptions(GripperOptions):
    """Options of `[gripper.hand-e-urcap]`."""

    host: str = Field(min_length=1, description="address of the robot controller that runs Robotiq's URCap")
    port: int = Field(default=63352, ge=1, le=65535, description="port of the URCap's string server")


def tcp_address(port: str) -> tuple[str, int] | None:
    """Return host and port of tcp://host:port or socket://host:port; None for the name of a serial port.

    Raises ValueError for an address without either.
    """
    if "://" not in port:
        return None
    parts = urlsplit(port)
    if parts.scheme not in ("tcp", "socket") or not parts.hostname or parts.port is None:
        raise ValueError("should be a serial port's name, or tcp://host:port")
    return parts.hostname, parts.port
