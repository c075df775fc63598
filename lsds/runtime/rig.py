"""A rig: all devices and algorithms of a cell, built from one configuration, brought up and down together."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, cast

from lsds.clock import Clock, VirtualClock, WallClock, nanoseconds, seconds
from lsds.contracts.algorithms import Controller, Detector, Estimator, Tracker
from lsds.contracts.backend import BuildContext
from lsds.contracts.devices import Arm, Cell, Device, Gripper, Lifecycle, PoseSource, TactileSensor
from lsds.contracts.fault import OBSERVER, Fault
from lsds.contracts.job import Job
from lsds.contracts.kinds import CONFIG_KINDS, DEVICE_KINDS, KINDS, Kind
from lsds.contracts.stages import NEVER, SLIP, START, shared_stages
from lsds.errors import CallHangs, ConfigError, ConfigIssue, LsdsError, PluginError, raised_by
from lsds.registry.backends import Backend, did_you_mean
from lsds.registry.host import PluginHost
from lsds.runtime.bring_up_report import Result, bring_up_error
from lsds.runtime.cell_members import CellMembers
from lsds.safety.deadlines import CELL_STOP_S, Deadlines
from lsds.safety.device_calls import CALL_LOOK_S, Call, CellThread
from lsds.tactile.compiled import use_compiled

if TYPE_CHECKING:
    from lsds.config.model import BackendSection, FaultSection, RigConfig

HURRIED_STOP_S = 0.3
"""Time limit for stopping all devices after an interrupt (s); chosen, because a person waits."""
HURRIED_CLOSE_S = 1.0
"""Time limit for closing all devices after an interrupt (s); chosen, because a person waits."""
HUNG_S = 0.3
"""Time limit of a further call of a device that has hung once (s); chosen."""


def build_cell(config: RigConfig, clock: Clock) -> Any:
    """Return the cell that a configuration names, without any device. Raises ConfigError where it names none."""
    if not config.cell.chosen:
        raise ConfigError("rig", [ConfigIssue("cell.backend", "no cell is configured", 'write backend = "wire"')])
    from lsds.config.own import with_own_backends

    host = PluginHost()
    host.block(config.plugins.block)
    config = with_own_backends(config, host)
    return host.build("cell", config.cell.backend, config.cell.options(), BuildContext(clock, config.seed))


#: Kinds of which every finger has its own.
_OF_A_FINGER: tuple[Kind, ...] = ("sensor", "tracker", "detector", "estimator")


@dataclass(frozen=True, slots=True, eq=False)
class Finger:
    """One fingertip of a rig: its sensor, and algorithms whose state is its own.

    `opposite`: it looks at the object from the other side than the first. `label` names the sensor in messages.
    """

    name: str
    label: str
    opposite: bool
    sensor: TactileSensor
    tracker: Tracker
    detector: Detector
    estimator: Estimator


class Rig:
    """Builds every backend a configuration names; constructing does no I/O.

    Use it as a context manager: it connects on entry, and stops and closes everything on exit. `gripper`, `arm`,
    `pose_source` and `cell` are None where the configuration says so. A cell (a simulation's physics and truth) is
    built only where at least one chosen device lives in it, or where it serves its devices over the wire. `fingers`
    are all tactile fingertips; `sensor`, `tracker`, `detector` and `estimator` are the first one's.

    Raises ConfigError, PluginNotFound, PluginConflict, PluginLoadError, ContractMismatch.
    """

    fingers: tuple[Finger, ...]
    gripper: Gripper | None
    arm: Arm | None
    pose_source: PoseSource | None
    cell: Cell | None
    controller: Controller

    def __init__(self, config: RigConfig, host: PluginHost | None = None, *, clock: Clock | None = None) -> None:
        # Imported here: building pydantic models would slow down `import lsds`.
        from lsds.config.own import with_own_backends

        # Compiling takes some 20 s, once on a machine, and must not keep armed devices waiting.
        compiled = use_compiled(config.tactile.arithmetic)
        if compiled:
            from lsds.grip.compiled_belief import prepare

            prepare()
        # A recording keeps what was used, because the two differ in the last digits.
        tactile = config.tactile.model_copy(update={"arithmetic": "compiled" if compiled else "portable"})
        config = config.model_copy(update={"tactile": tactile})
        self.host = host or PluginHost()
        self.host.block(config.plugins.block)
        self.config = config = with_own_backends(config, self.host)
        kinds = [kind for kind in CONFIG_KINDS if config.section(kind).chosen and not KINDS[kind].late]
        chosen = {kind: self.host.find(kind, config.section(kind).backend) for kind in kinds}
        sensors = {name: self.host.find("sensor", section.backend) for name, section in config.fingers.items()}
        devices = [chosen[kind] for kind in DEVICE_KINDS if kind in chosen and kind != "sensor"]
        devices = [*sensors.values(), *devices]
        cell_members = CellMembers(chosen.get("cell"), devices)
        cell_members.require_compatible(self.host)
        self.virtual = _is_virtual(config, devices)
        self.thread = CellThread()
        self.deadlines = Deadlines(config.deadlines, virtual=self.virtual)
        self._hung: set[str] = set()
        self._hurried = self._closed = False
        self._close_by_ns: int | None = None
        self.clock: Clock = clock or (VirtualClock() if self.virtual else WallClock())
        self.context = BuildContext(self.clock, config.seed)
        if not cell_members.need_cell:
            chosen.pop("cell", None)
        self.backends: dict[Kind, Backend] = chosen
        self.stages = shared_stages(self.context)
        self.faults: tuple[tuple[FaultSection, Fault], ...] = tuple(
            (section, self._made("fault", section)) for section in config.faults
        )
        self._cell_is_sensed = cell_members.are_sensed
        for kind in CONFIG_KINDS:
            if kind == "sensor":
                self.fingers = tuple(self._finger(at, name) for at, name in enumerate(config.fingers))
            elif kind not in _OF_A_FINGER and not KINDS[kind].late:
                setattr(self, kind, self._build(kind, config.section(kind)) if kind in chosen else None)
        _require_effect(self)
        self._devices: list[tuple[str, str, Device]] = [
            (finger.label, sensors[finger.name].spec.name, finger.sensor) for finger in self.fingers
        ]
        for kind in DEVICE_KINDS:
            if kind != "sensor" and getattr(self, kind) is not None:
                self._devices.append((kind, config.section(kind).backend, getattr(self, kind)))

    @property
    def sensor(self) -> TactileSensor:
        """The first finger's sensor."""
        return self.fingers[0].sensor

    @property
    def tracker(self) -> Tracker:
        """The first finger's tracker."""
        return self.fingers[0].tracker

    @property
    def detector(self) -> Detector:
        """The first finger's detector."""
        return self.fingers[0].detector

    @property
    def estimator(self) -> Estimator:
        """The first finger's estimator."""
        return self.fingers[0].estimator

    @cached_property
    def job(self) -> Job:
        """The job that the configuration names; built when it is first asked for."""
        return cast("Job", self._build("job", self.config.section("job")))

    @property
    def own_cell(self) -> Cell | None:
        """The cell that the sensors live in; None for a recording or a real sensor, whatever is simulated with it."""
        return self.cell if self._cell_is_sensed else None

    @property
    def is_recording(self) -> bool:
        """Whether there are recordings to look at and nothing to move: every frame counts, and no clock does."""
        return self.gripper is None and self.arm is None and all(hasattr(f.sensor, "frames") for f in self.fingers)

    @property
    def devices(self) -> tuple[Device, ...]:
        """All devices, in the order in which they are brought up."""
        return tuple(device for _, _, device in self._devices)

    def connect(self) -> None:
        """Make every device readable, trying all of them.

        If any of them fails, the others are closed again and one BringUpError lists all. Closes everything also
        where an interrupt comes in the middle.
        """
        if self.cell is not None:
            try:
                self._call(self._cell_name, "connect", self.cell.connect)
            except BaseException as error:
                self._note(error)
                self._close_quietly()
                raise
        self._bring_up("connect")

    def arm_devices(self) -> None:
        """Make every device commandable; grippers and arms may move now. Raises BringUpError, everything closed."""
        self._bring_up("arm")

    def stop(self) -> tuple[str, ...]:
        """End all motion now, from any thread and state. Never raises; returns what went wrong, empty for nothing.

        A keyboard interrupt meanwhile is raised after every device was stopped.

        Under the wall clock every device is stopped in its own thread, and `CELL_STOP_S` bounds the whole call: a
        device that hangs keeps no other moving. Under the virtual clock it runs one after another and so stays
        deterministic.
        """
        problems: list[str] = []
        stops: list[Callable[[], None]]
        if self.virtual:
            stops = [partial(self._call, _who(kind, name), "stop", device.stop) for kind, name, device in self._devices]
        else:
            stops = [device.stop for _, _, device in self._devices]
        calls = [
            _guarded(call, f"{kind} {name}", problems)
            for call, (kind, name, _) in zip(stops, self._devices, strict=True)
        ]
        if self.virtual:
            try:
                _all_of(calls)
            finally:
                if self._closed:
                    self.thread.end()
            return tuple(problems)
        wall = WallClock()
        limit_s = HURRIED_STOP_S if self._hurried else CELL_STOP_S
        deadline = wall.now() + nanoseconds(limit_s)
        threads = [threading.Thread(target=call, name="lsds-stop", daemon=True) for call in calls]
        for thread in threads:
            thread.start()

        def await_(thread: threading.Thread) -> None:
            thread.join(max(0.0, seconds(deadline - wall.now())))

        _all_of([partial(await_, thread) for thread in threads])
        for thread, (kind, name, _) in zip(threads, self._devices, strict=True):
            if thread.is_alive():
                self._hung.add(_who(kind, name))
                problems.append(f"{kind} {name}: stop() did not return within {limit_s} s")
        return tuple(problems)

    def deadline(self, device: object, name: str) -> Call:
        """Return the mark of a call of one of its devices, with its deadline."""
        who = next((_who(kind, called) for kind, called, own in self._devices if own is device), "a device")
        return self.deadlines.of(who, name)

    def hurry(self) -> None:
        """Bound what is left to do (stopping, closing) to about a second: the run was interrupted by a person."""
        self._hurried = True
        if self._closed and self._close_by_ns is None:
            self._close_by_ns = WallClock().now() + nanoseconds(HURRIED_CLOSE_S)

    def disarm(self) -> None:
        """Take the power to move away from every device. Raises an ExceptionGroup of all failures."""
        self._all("disarming the rig", "disarm")

    def close(self) -> None:
        """Stop and close every device, last first. Does nothing the second time.

        Raises one ExceptionGroup of all failures; a device that hangs is named in it and left behind. An interrupt in
        the middle is raised after the others are closed.
        """
        if self._closed:
            return
        try:
            self.stop()
        except BaseException as error:
            self._note(error)
            raise
        finally:
            self._closed = True
            if self._hurried:
                self.hurry()
            try:
                self._all("closing the rig", "close")
            finally:
                self.thread.end()

    def __enter__(self) -> Rig:
        self.connect()
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if error is None:
            self.close()
            return
        self._note(error)
        # The first error is the cause; errors while closing become notes to it.
        for failure in self._close_quietly():
            error.add_note(f"and while closing: {type(failure).__name__}: {failure}")

    # -- inside -------------------------------------------------------------------------------------------

    def _made(self, kind: Kind, section: BackendSection | FaultSection) -> Any:
        return self.host.build(kind, section.backend, section.options(), self.context)

    def _build(self, kind: Kind, section: BackendSection, finger: str = "") -> Any:
        part = self._made(kind, section)
        for named, fault in self.faults:
            if fault.target == kind and named.finger in ("", finger):
                part = fault.around(part)
        return part

    def _finger(self, at: int, name: str) -> Finger:
        section = self.config.fingers[name]
        opposite = getattr(section, "opposite", None)
        parts = {kind: self._build(kind, self.config.section(kind), name) for kind in _OF_A_FINGER if kind != "sensor"}
        return Finger(
            name,
            f"sensor {name}" if self.config.sensors else "sensor",
            at > 0 if opposite is None else opposite,
            self._build("sensor", section, name),
            **parts,
        )

    @property
    def _cell_name(self) -> str:
        return _who("cell", self.config.section("cell").backend)

    def _call(self, who: str, name: str, function: Callable[[], None]) -> None:
        """Make one call of a device in the cell's thread, within its deadline. Raises CallHangs."""
        call = self.deadlines.of(who, name)
        limit_s = min(call.limit_s, HUNG_S) if who in self._hung else call.limit_s
        if name == "stop" and self._hurried:
            limit_s = min(limit_s, HURRIED_STOP_S)
        if self._close_by_ns is not None:
            limit_s = min(limit_s, max(CALL_LOOK_S, seconds(self._close_by_ns - WallClock().now())))
        try:
            self.thread.call(call._replace(limit_s=limit_s), function)
        except CallHangs:
            self._hung.add(who)
            raise

    def _note(self, error: BaseException) -> None:
        """Take note of an interrupt, and of a device that hangs."""
        if isinstance(error, KeyboardInterrupt):
            self.hurry()
        elif isinstance(error, CallHangs):
            self._hung.add(error.device)

    def _bring_up(self, step: str) -> None:
        results = []
        try:
            for kind, name, device in self._devices:
                error: Exception | None = None
                try:
                    self._call(_who(kind, name), step, getattr(device, step))
                except Exception as raised:
                    error = raised
                results.append(Result(kind, name, error))
        except BaseException as interrupt:
            self._note(interrupt)
            self._close_quietly()
            raise
        if any(result.error for result in results):
            failures = self._close_quietly()
            raise bring_up_error(step, results, failures) from next(r.error for r in results if r.error)

    def _close_quietly(self) -> tuple[Exception, ...]:
        try:
            self.close()
        except ExceptionGroup as group:
            return group.exceptions
        return ()

    def _all(self, doing: str, step: str) -> None:
        failures: list[Exception] = []
        interrupt: BaseException | None = None
        owned: list[tuple[str, str, Any]] = list(reversed(self._devices))
        if step == "close" and self.cell is not None:
            owned.append(("cell", self.config.section("cell").backend, self.cell))
        for kind, name, device in owned:
            call = partial(self._call, _who(kind, name), step, getattr(device, step))
            try:
                call()
            except Exception as error:
                error.add_note(f"while {doing}: {kind} {name}")
                failures.append(error if isinstance(error, LsdsError) else _explained(error, kind, name, step))
            except BaseException as error:
                interrupt = error
                self._note(error)
                _once_more(call, device)
        if interrupt is not None:
            raise interrupt
        if failures:
            raise ExceptionGroup(f"{doing}: {len(failures)} of {len(self._devices)} devices failed", failures)


def _require_effect(rig: Rig) -> None:
    """Refuse a fault of a part or a finger that there is not, or of a recording, which is looked at as it is."""
    issues = []
    for at, (section, fault) in enumerate(rig.faults):
        whole = fault.target == OBSERVER or fault.target not in _OF_A_FINGER
        if not whole and fault.target == "sensor" and rig.is_recording:
            problem = f"'{section.backend}' is a fault of a camera, and a recording is looked at as it is"
            issues.append(ConfigIssue(f"faults.{at}.backend", problem, "choose a fault of a tracker or detector"))
        elif whole and fault.target != OBSERVER and getattr(rig, fault.target, None) is None:
            problem = f"'{section.backend}' is a fault of the {fault.target}, and this rig has none"
            issues.append(ConfigIssue(f"faults.{at}.backend", problem, "leave it out"))
        elif section.finger and whole:
            problem = f"'{section.backend}' is no fault of a finger"
            issues.append(ConfigIssue(f"faults.{at}.finger", problem, "leave the key out"))
        elif section.finger and section.finger not in rig.config.fingers:
            known = f"there are {', '.join(rig.config.fingers)}"
            issues.append(ConfigIssue(f"faults.{at}.finger", f"no finger '{section.finger}'", known))
    if issues:
        raise ConfigError("rig", issues)


def require_moments(rig: Rig, job: Job | None = None) -> None:
    """Refuse a fault that is to begin with a stage that the job does not have, as far as the job declares its stages.

    `job` replaces the rig's own. Raises ConfigError.
    """
    stages = getattr(rig.job if job is None else job, "stages", None)
    if stages is None:
        return
    known = (START, SLIP, NEVER, *stages)
    issues = [
        ConfigIssue(
            f"faults.{at}.at",
            f"'{section.backend}' is to begin at '{fault.moment}', and no stage of this job has that name",
            " ".join(part for part in (did_you_mean(fault.moment, known), f"one of: {', '.join(known)}") if part),
        )
        for at, (section, fault) in enumerate(rig.faults)
        if fault.moment not in known
    ]
    if issues:
        raise ConfigError("rig", issues)


def _is_virtual(config: RigConfig, devices: Sequence[Backend]) -> bool:
    real = [device.spec.name for device in devices if not device.spec.virtual_time]
    if config.clock == "virtual" and real:
        problem = f"virtual time needs simulated devices only; real: {', '.join(real)}"
        raise ConfigError("rig", [ConfigIssue("clock", problem, 'write clock = "auto", or choose mock devices')])
    return config.clock == "virtual" or (config.clock == "auto" and not real)


def _guarded(call: Callable[[], None], label: str, problems: list[str]) -> Callable[[], None]:
    def run() -> None:
        try:
            call()
        except Exception as error:
            problems.append(f"{label}: stop() raised {type(error).__name__}: {error}")

    return run


def _all_of(calls: list[Callable[[], None]]) -> None:
    """Make every call, even after an interrupt, which is raised at the end."""
    interrupt: BaseException | None = None
    for call in calls:
        try:
            call()
        except BaseException as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt


def _once_more(call: Callable[[], None], device: Any) -> None:
    """Repeat a call that an interrupt cut short, so that no device stays half closed."""
    try:
        if getattr(device, "lifecycle", None) is not Lifecycle.CLOSED:
            call()
    except Exception:
        return


def _explained(error: Exception, kind: str, name: str, step: str) -> PluginError:
    """Return the error for an exception of a device that does not explain itself."""
    explained = raised_by(_who(kind, name), error, f"{step}()")
    explained.__cause__ = error
    return explained


def _who(kind: str, name: str) -> str:
    """How a device is called in messages: "gripper 'hand-e'"."""
    return f"{kind} '{name}'"
