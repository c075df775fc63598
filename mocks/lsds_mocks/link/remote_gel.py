"""The gel of a plant in another process, with a local model that renders it; the only link that needs the physics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds_mocks.cell.build import build_plant
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.link.packets import Kind, Want, unpack_gel
from lsds_mocks.link.remote import PlantSocket

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.state import GelState


class RemoteGel:
    """A `GelLink`; `gel` is a local model, made from the plant's options, that renders the states."""

    def __init__(self, address: str) -> None:
        self._plant = PlantSocket(address, Want.NOTHING)
        self._plant.send(bytes([Kind.ASK_OPTIONS]))
        options = CellOptions.model_validate_json(self._plant.first()[1:])
        self.gel: GelModel = build_plant(options, [0]).gel

    def at(self, t_ns: int) -> GelState | None:
        """Request the gel at an instant; wait until the physics has passed it."""
        return self._plant.ask(Kind.ASK_GEL, t_ns, unpack_gel)

    def close(self) -> None:
        """Close."""
        self._plant.close()
