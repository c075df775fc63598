"""`wire_mock`: a wire mock in a separate process, with faults that can be switched, a log of frames, and assertions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any, Self

from lsds.clock import NS_PER_S, WallClock, nanoseconds
from lsds.contracts.wire import ReceivedFrame
from lsds.errors import ConfigError, ConfigIssue, DeviceError
from lsds.registry.backends import did_you_mean
from lsds.registry.host import PluginHost
from lsds.support.mock_process import MockProcess
from lsds.testing.free_addresses import free_ports

CLOCK = WallClock()
"""The clock of the mock, too: monotonic time is the same in all processes of a machine."""
PREFERRED = ("tcp", "rtde", "http")
"""Faces that `address` names, in order of preference, if no transport is chosen."""
OPENED_BY_COMMAND_M = 1e-4
"""Increase of the aperture that counts as opening (m): half a position tick of a Hand-E, so no command causes less."""


class Truth(Mapping[str, Any]):
    """State of a mock's plant at one instant, by name or as attribute: `truth.aperture_m`. Units are SI."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._values:
            raise AttributeError(f"this mock's truth has no '{name}'; it has {', '.join(self._values)}")
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Truth({', '.join(f'{name}={value!r}' for name, value in self._values.items())})"


class MockHandle(Mapping[str, str]):
    """A wire mock in its own process: a mapping from the names of its faces to their addresses.

    As a context manager it starts on entry and stops on exit.
    """

    def __init__(self, name: str, *, transport: str | None, seed: int, options: Mapping[str, Any]) -> None:
        self.name = name
        self._transport = transport
        self._options = dict(options)
        self._seed = seed
        self._process: MockProcess | None = None
        self._named = 0
        self._frames: list[ReceivedFrame] = []
        self._since_ns = 0

    def start(self) -> Self:
        """Start the mock and wait until it listens. Raises ConnectFailed, and ConfigError for an unknown transport."""
        process = MockProcess(self.name, {**self._free_options(), **self._options}, seed=self._seed)
        self._process = process.start()
        self._frames = []
        self._since_ns = CLOCK.now()
        if self._transport is not None and self._transport not in process.addresses:
            self.stop()
            faces = tuple(process.addresses)
            remedy = did_you_mean(self._transport, faces) or f"its faces: {', '.join(faces)}"
            problem = f"'{self._transport}' is no face of this mock"
            raise ConfigError(f"mock {self.name}", [ConfigIssue("transport", problem, remedy)])
        return self

    def stop(self) -> None:
        """Stop the mock. A second call does nothing."""
        if self._process is not None:
            self._process.stop()

    @property
    def process(self) -> MockProcess:
        """The process. Raises DeviceError before `start`."""
        if self._process is None:
            raise DeviceError(f"mock {self.name}", "has not started", remedy="use it in a with statement")
        return self._process

    # -- addresses ----------------------------------------------------------------------------------------

    @property
    def transport(self) -> str:
        """Name of the face that `address`, `host` and `port` describe."""
        if self._transport is not None:
            return self._transport
        faces = self.process.addresses
        return next((face for face in PREFERRED if face in faces), next(iter(faces)))

    @property
    def address(self) -> str:
        """Address of the transport as the mock prints it: `tcp://HOST:PORT`, `HOST:PORT`, a URL or a path."""
        return self[self.transport]

    @property
    def host(self) -> str:
        """Host of the transport. Raises DeviceError for a transport that is not a TCP port."""
        return self._endpoint()[0]

    @property
    def port(self) -> int:
        """TCP port of the transport. Raises DeviceError for a transport that is not a TCP port."""
        return self._endpoint()[1]

    def __getitem__(self, face: str) -> str:
        return self.process.addresses[face]

    def __iter__(self) -> Iterator[str]:
        return iter(self.process.addresses)

    def __len__(self) -> int:
        return len(self.process.addresses)

    # -- faults -------------------------------------------------------------------------------------------

    @contextmanager
    def fault(self, kind: str, *, severity: int | None = None, **limits: Any) -> Iterator[None]:
        """Begin a fault now and end it with the block.

        `severity` is 1 to 5; `limits` are the other options of a fault: `face`, `probability`, `count`, and `when` and
        `nth` for a fault that a frame starts: `fault("drop", when="write 1000", nth=3, count=1)`. Raises DeviceError if
        the mock refuses it.
        """
        self._named += 1
        name = f"fault {self._named}"
        strength = {} if severity is None else {"severity": severity}
        self.process.inject(kind, **limits, **strength, name=name)
        self._since_ns = CLOCK.now()
        try:
            yield
        except BaseException:
            # Report the error of the block, not that of a mock that has ended.
            with suppress(DeviceError):
                self.process.request({"request": "end", "name": name})
            raise
        self.process.request({"request": "end", "name": name})

    # -- observations -------------------------------------------------------------------------------------

    @property
    def received(self) -> tuple[ReceivedFrame, ...]:
        """All frames that clients have sent, oldest first. Raises DeviceError if the mock has discarded some."""
        answer = self.process.request({"request": "received", "since": len(self._frames)})
        frames = [ReceivedFrame(**{**frame, "data": bytes.fromhex(frame["data"])}) for frame in answer["frames"]]
        if frames and frames[0].number != len(self._frames):
            problem = f"has discarded frames {len(self._frames)} to {frames[0].number - 1}"
            raise DeviceError(f"mock {self.name}", problem, remedy="read `received` more often")
        self._frames += frames
        return tuple(self._frames)

    @property
    def truth(self) -> Truth:
        """The present state of the plant, which no fault falsifies."""
        return self.truths(CLOCK.now())[-1]

    def truths(self, since_ns: int) -> list[Truth]:
        """Return the states of the plant since a time (monotonic ns), oldest first; the last one is the present."""
        return [Truth(truth) for truth in self.process.request({"request": "truths", "since_ns": since_ns})["truths"]]

    # -- assertions ---------------------------------------------------------------------------------------

    def mark(self) -> None:
        """Let the assertions regard only what happens from now on. `fault` does the same when it begins."""
        self._since_ns = CLOCK.now()

    def never_opened(self) -> None:
        """Raise AssertionError if the aperture has increased since the start, the last `fault` or `mark`."""
        truths = self.truths(self._since_ns)
        if "aperture_m" not in truths[-1]:
            raise DeviceError(f"mock {self.name}", "has no aperture", remedy="assert on a gripper")
        least = truths[0]
        for truth in truths:
            if truth.aperture_m > least.aperture_m + OPENED_BY_COMMAND_M:
                raise AssertionError(
                    f"{self.name} opened from {least.aperture_m * 1e3:.2f} mm to {truth.aperture_m * 1e3:.2f} mm, "
                    f"{self._after(truth)} after the start of the period; {self._last_frame(truth.t_ns)}"
                )
            if truth.aperture_m < least.aperture_m:
                least = truth

    def stopped_within(self, time_s: float) -> None:
        """Raise AssertionError if the device moves later than `time_s` after the start, the last `fault` or `mark`.

        Waits until that time has passed. A device that was at rest from the beginning passes, too.
        """
        deadline_ns = self._since_ns + nanoseconds(time_s)
        CLOCK.sleep_until(deadline_ns)
        for truth in self.truths(deadline_ns):
            if truth.moving:
                raise AssertionError(
                    f"{self.name} still moved {self._after(truth, deadline_ns)} after the start of the period, "
                    f"limit {time_s:g} s; {self._last_frame(truth.t_ns)}"
                )

    # -- inside -------------------------------------------------------------------------------------------

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.stop()

    def _free_options(self) -> dict[str, Any]:
        """Return options with which this mock takes free ports; none for an unknown mock, which the start reports."""
        host = PluginHost()
        if self.name.rpartition(":")[2] not in host.names("wire_mock"):
            return {}
        model = host.options_model(host.find("wire_mock", self.name))
        return {} if model is None else free_ports(model.model_fields)

    def _endpoint(self) -> tuple[str, int]:
        place = self.address.partition("://")[2] or self.address
        host, _, port = place.partition("/")[0].rpartition(":")
        if not port.isdigit():
            problem = f"'{self.transport}' is not a TCP port: {self.address}"
            raise DeviceError(f"mock {self.name}", problem, remedy="use .address, or choose another transport")
        return host.strip("[]"), int(port)

    def _after(self, truth: Truth, least_ns: int = 0) -> str:
        return f"{(max(truth.t_ns, least_ns) - self._since_ns) / NS_PER_S:.3f} s"

    def _last_frame(self, t_ns: int) -> str:
        frames = [frame for frame in self.received if frame.t_ns <= t_ns]
        return f"the last frame before it: {frames[-1].meaning}" if frames else "no frame arrived before it"


def wire_mock(name: str, *, transport: str | None = None, seed: int = 0, **options: Any) -> MockHandle:
    """Return a wire mock for a with statement: `with wire_mock("hand-e", transport="tcp") as mock`.

    It runs in a separate process, on free ports unless `options` name them. `transport` is the face that `mock.address`
    and `mock.port` describe. `options` are those that `lsds mock NAME --help` lists, with `faults` as a list of tables.
    """
    return MockHandle(name, transport=transport, seed=seed, options=options)
