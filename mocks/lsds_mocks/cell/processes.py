"""The cell on the wire: a plant and wire mocks in separate processes, started by a rig or already running."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field, field_validator

from lsds.errors import ConfigError, ConfigIssue, ConnectFailed
from lsds.registry.host import PluginHost
from lsds.registry.options import validated
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.link.private_socket import make_private, runtime_folder
from lsds_mocks.link.remote import NoPlant, RemoteArm, RemoteFingers, RemoteScene, RemoteTruth
from lsds_mocks.mock_process import MockProcess

if TYPE_CHECKING:
    from lsds.contracts import BuildContext, CellTruth

STALE_TRUTH_S = 0.5
"""Age above which the plant's newest truth counts as stale, s; chosen."""


def default_socket() -> str:
    """Return the path at which this user's plant is found, in a folder that only this user can enter."""
    return str(runtime_folder() / "plant.sock")


class ProcessCellOptions(BaseModel):
    """Options of `[cell.wire]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    socket: str = Field(default="", description="socket of the plant; empty: one per user")
    start: bool = Field(default=True, description="start plant and mocks if none are running")
    plant: CellOptions = Field(
        default_factory=CellOptions, description="options of the plant: object, friction, fingers"
    )
    mocks: dict[str, dict[str, Any]] = Field(
        default_factory=lambda: {"hand-e": {"activated": True}, "ur5e": {}, "gelsight-mini": {}},
        description="wire mocks to start, each with its options, by name",
    )

    @field_validator("mocks")
    @classmethod
    def _no_plant(cls, mocks: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
        if "plant" in mocks or "rig" in mocks:
            raise ValueError("the plant is started anyway; name device mocks only")
        return mocks


class ProcessCell:
    """A `Cell` whose devices are reached over their own protocols. Real time only: `advance` does nothing."""

    def __init__(self, options: ProcessCellOptions, context: BuildContext) -> None:
        self.options = options
        self.socket = options.socket or default_socket()
        _check(options.mocks)
        self._clock = context.clock
        self._seed = context.seed
        self._processes: list[MockProcess] = []
        self._truth: RemoteTruth | None = None
        self._closing = False

    def connect(self) -> None:
        """Connect to a running plant and reset its object; without one, start the plant and all mocks.

        Raises ConnectFailed.
        """
        with contextlib.suppress(NoPlant):
            self._truth = RemoteTruth(self.socket)
        if self._truth is not None:
            self._truth.reset()
            return
        if not self.options.start:
            remedy = "start it: lsds mock rig RIG.toml"
            raise ConnectFailed("cell wire", f"no plant serves at '{self.socket}'", remedy=remedy)
        self.start()
        self._truth = RemoteTruth(self.socket)

    def start(self) -> dict[str, Mapping[str, str]]:
        """Start plant and mocks; return the addresses of each. On ConnectFailed all of them are stopped."""
        if not self.options.socket:
            make_private(Path(self.socket).parent)
        wanted = [("plant", {"socket": self.socket, **_changed(self.options.plant)})]
        wanted += [(name, {"cell": self.socket, **options}) for name, options in self.options.mocks.items()]
        try:
            for name, options in wanted:
                if self._closing:
                    raise ConnectFailed("cell wire", "was closed while it was starting")
                process = MockProcess(name, options, seed=self._seed)
                self._processes.append(process)
                process.start()
        except BaseException:
            self.close()
            raise
        return {process.name: process.addresses for process in self._processes}

    def finger_link(self) -> RemoteFingers:
        """Return a link to the fingers of the plant. Raises ConnectFailed if no plant serves at the socket."""
        return RemoteFingers(self.socket)

    def arm_link(self) -> RemoteArm:
        """Return a link to the load of the arm. Raises ConnectFailed as `finger_link` does."""
        return RemoteArm(self.socket)

    def scene_link(self) -> RemoteScene:
        """Return a link to the scene. Raises ConnectFailed as `finger_link` does."""
        return RemoteScene(self.socket)

    @property
    def broken(self) -> str:
        """Name of a mock that has ended unexpectedly, empty if none."""
        return next((process.name for process in self._processes if not process.alive), "")

    def advance(self, t_ns: int) -> None:
        """Do nothing: the plant runs in real time."""

    def truth(self) -> CellTruth:
        """Return the plant's newest truth. Raises StaleData if it has stopped, ConnectFailed before `connect`."""
        if self._truth is None:
            raise ConnectFailed("cell wire", "is not connected", remedy="connect() first")
        return self._truth.truth(self._clock.now(), STALE_TRUTH_S)

    def close(self) -> None:
        """Disconnect, and stop the processes that this cell has started."""
        self._closing = True
        if self._truth is not None:
            self._truth.close()
            self._truth = None
        # The mocks end in parallel; the plant, on which they depend, ends after them.
        for mock in self._processes[1:]:
            mock.ask_to_end()
        while self._processes:
            self._processes.pop().stop()


def _changed(options: CellOptions) -> dict[str, Any]:
    return options.model_dump(exclude_defaults=True)


def _check(mocks: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise ConfigError with everything that is wrong with the mocks' tables, PluginNotFound for an unknown mock."""
    host = PluginHost()
    issues: list[ConfigIssue] = []
    for name, table in mocks.items():
        model = host.options_model(host.find("wire_mock", name))
        try:
            if model is not None:
                validated(model, table, f"cell.wire.mocks.{name}")
        except ConfigError as error:
            issues += error.issues
    if issues:
        raise ConfigError("rig", issues)
