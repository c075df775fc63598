"""Options of the plant that wire mocks share."""

from __future__ import annotations

from pydantic import Field

from lsds_mocks.cell.options import CellOptions


class PlantOptions(CellOptions):
    """Options of `lsds mock plant`."""

    socket: str = Field(default="plant.sock", description="path of the socket that wire mocks connect to")
    aperture_mm: float = Field(default=50.0, ge=0, le=50, description="aperture of the fingers at the start")
