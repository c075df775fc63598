"""Options of every wire camera."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, field_validator

from lsds_mocks.wire.address import is_loopback
from lsds_mocks.wire.faults import Fault


class CameraOptions(BaseModel):
    """Address, rate and faults of a wire camera."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    host: str = Field(default="127.0.0.1", description="loopback address to listen on")
    port: int = Field(default=8080, ge=0, le=65535, description="TCP port; 0 takes a free one")
    pipe: str = Field(default="", description="also write the JPEG images to this named pipe, created if absent")
    quality: int = Field(default=90, ge=1, le=100, description="JPEG quality")
    rate_hz: float = Field(default=25.0, gt=0.5, le=240, description="exposures per second, on absolute deadlines")
    latency_ms: float = Field(default=0.0, ge=0, le=30, description="delay between exposure and sending")
    cell: str = Field(default="", description="socket of a plant in another process; empty: its own scene")
    faults: list[Fault] = Field(default_factory=list, description="faults to inject")

    @field_validator("host")
    @classmethod
    def _only_loopback(cls, host: str) -> str:
        if not is_loopback(host):
            raise ValueError("a mock listens on loopback only, such as 127.0.0.1")
        return host
