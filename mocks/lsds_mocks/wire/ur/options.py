"""Options of `lsds mock ur5e` and the other sizes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lsds_mocks.wire.faults import Fault

Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Three = Annotated[list[float], Field(min_length=3, max_length=3)]


class UrOptions(BaseModel):
    """Options of an e-Series arm's wire face. All ports are the controller's own; give each arm its own address."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    host: str = Field(default="127.0.0.1", description="loopback address to listen on; another one for each arm")
    model: Literal["ur3e", "ur5e", "ur10e", "ur16e"] = Field(default="ur5e", description="model of the arm")
    version: str = Field(
        default="5.19.0.1210631", pattern=r"^\d+\.\d+\.\d+\.\d+$", description="reported software version"
    )
    serial: str = Field(default="20235501234", pattern=r"^20\d+$", description="reported serial number")
    q_rad: Six = Field(
        default=[-1.6007, -1.7271, -2.2030, -0.8080, 1.5951, -0.0310],
        description="joint positions at the start",
    )
    tcp_offset: Six = Field(default=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], description="tool centre point on the flange")
    payload_kg: float = Field(default=0.0, ge=0, le=35, description="payload set at the start")
    payload_cog_m: Three = Field(default=[0.0, 0.0, 0.0], description="centre of gravity of the payload")
    powered: bool = Field(default=True, description="start with power on and brakes released")
    remote_control: bool = Field(default=True, description="start in remote control")
    floor_m: float | None = Field(default=None, description="height of a floor under the tool, in the base frame")
    programs: str = Field(default="", description="folder with .script files that `load` finds by name")
    urcap_host: str = Field(default="127.0.0.1", description="host from which external_control.urp requests its script")
    urcap_port: int = Field(
        default=50002, ge=1, le=65535, description="port from which external_control.urp requests its script"
    )
    socket_ports: list[Annotated[int, Field(ge=1, le=65535)]] | None = Field(
        default=None,
        description="local ports that programs may open; default: those on which a program's sender listens",
    )
    cell: str = Field(default="", description="socket of a shared plant; empty: no plant")
    faults: list[Fault] = Field(default_factory=list, description="faults to inject")
