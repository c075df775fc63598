"""Options of the e-Series driver."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Three = Annotated[list[float], Field(min_length=3, max_length=3)]

REACH_M = {"ur3e": 0.5, "ur5e": 0.85, "ur10e": 1.3, "ur16e": 0.9, "ur20": 1.75, "ur30": 1.3}


class UrOptions(BaseModel):
    """Options of `[arm.ur5e]` and the other sizes."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    host: str = Field(default="192.168.56.101", min_length=1, description="address of the controller")
    model: Literal["ur3e", "ur5e", "ur10e", "ur16e", "ur20", "ur30"] = Field(
        default="ur5e", description="model of the arm"
    )
    state_rate_hz: float = Field(default=250.0, ge=10, le=500, description="rate of the controller's state messages")
    speed_limit_m_s: float = Field(default=0.25, gt=0, le=3, description="maximum TCP speed to send")
    turn_limit_rad_s: float = Field(default=0.5, gt=0, le=6, description="maximum angular TCP speed to send")
    acceleration_limit_m_s2: float = Field(default=1.2, gt=0, le=10, description="maximum acceleration to send")
    stop_acceleration_m_s2: float = Field(
        default=2.0, gt=0, le=10, description="deceleration on stop and on command expiry"
    )
    stale_after_ms: float = Field(default=100.0, ge=10, le=2000, description="age above which a state is stale")
    watchdog_hz: float = Field(
        default=10.0, ge=2, le=50, description="rate of commands below which the controller stops its program"
    )
    connect_timeout_s: float = Field(default=10.0, gt=0, le=60, description="time limit for connecting, and for arming")
    tcp_offset: Six | None = Field(default=None, description="tool centre point to set when arming (m, rad)")
    payload_kg: float | None = Field(default=None, ge=0, le=35, description="payload to set when arming")
    payload_cog_m: Three = Field(default=[0.0, 0.0, 0.0], description="centre of gravity of the payload on the flange")
    unlock_protective_stop: bool = Field(
        default=False,
        description="let arm() unlock a protective stop; if false, a person unlocks it after finding the cause",
    )
    remote_control_check: bool = Field(default=True, description="refuse to arm if the arm is not in remote control")
    upper_registers: bool = Field(default=False, description="use registers 24-47, if another client uses 0-23")
