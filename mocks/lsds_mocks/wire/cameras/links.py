"""Choice of the plant that a wire camera records: a scripted one, or that of another process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from lsds.contracts import BuildContext
from lsds_mocks.cell.build import build_plant
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.link.remote import RemoteScene
from lsds_mocks.link.remote_gel import RemoteGel
from lsds_mocks.wire.cameras.script import RestingGel, ScriptedCell

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds.contracts.plant_links import SceneLink
    from lsds_mocks.link.protocols import GelLink
    from lsds_mocks.wire.cameras.options import Happening

APERTURE_MM = {"slide": 23.6, "hold": 21.5}


class LinkOptions(Protocol):
    """The options that choose a link."""

    @property
    def cell(self) -> str:
        """Address of another process's cell; empty for the scripted scene."""
        ...

    @property
    def scene(self) -> Happening:
        """The scripted scene."""
        ...

    @property
    def speed_mm_s(self) -> float:
        """Lifting speed of the arm in the scripted scene."""
        ...


def gel_link(options: LinkOptions, clock: Clock, seed: int) -> GelLink:
    """Return the gel that a tactile camera records. Raises ConnectFailed if no cell is at the address."""
    if options.cell:
        return RemoteGel(options.cell)
    if options.scene == "rest":
        context = BuildContext(clock, seed)
        return RestingGel(build_plant(CellOptions(), context.rng_seed("scripted plant 0")).gel)
    return _scripted(options, clock, seed)


def scene_link(options: LinkOptions, clock: Clock, seed: int) -> SceneLink:
    """Return the scene that a ground-truth camera records. Raises ConnectFailed if no cell is at the address."""
    if options.cell:
        return RemoteScene(options.cell)
    return _scripted(options, clock, seed)


def _scripted(options: LinkOptions, clock: Clock, seed: int) -> ScriptedCell:
    aperture = APERTURE_MM.get(options.scene, 50.0)
    speed = 0.0 if options.scene == "rest" else options.speed_mm_s
    return ScriptedCell(clock, seed, aperture_mm=aperture, speed_mm_s=speed)
