"""The configuration of a rig: one frozen pydantic model, whose default is the simulated cell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ModelWrapValidatorHandler, create_model, model_validator

from lsds.contracts.kinds import CONFIG_KINDS, KINDS, Kind
from lsds.contracts.task import TaskOptions
from lsds.grip.options import GripOptions
from lsds.registry.backends import NO_DEVICE
from lsds.safety.deadlines import DeadlineOptions
from lsds.safety.guard import SafetyOptions
from lsds.tactile.options import TactileOptions


class BackendSection(BaseModel):
    """The section of one kind: the chosen backend, and options tables by backend name.

    The options tables are the extra keys: `[gripper.hand-e]` is the table `hand-e` of the section `gripper`. They are
    stored as written; the loader has validated them against each backend's options model.
    """

    model_config = ConfigDict(extra="allow", frozen=True)
    # Pydantic's own way to say what extra keys hold; its base class declares them as anything or None.
    __pydantic_extra__: dict[str, dict[str, Any]] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    backend: str

    @property
    def tables(self) -> Mapping[str, dict[str, Any]]:
        """All options tables, by backend name."""
        return self.__pydantic_extra__

    @property
    def chosen(self) -> bool:
        """True unless the backend is "none"."""
        return self.backend != NO_DEVICE

    @property
    def by_default(self) -> bool:
        """True if the user did not name the backend: it is the default of its kind, or chosen by a command."""
        return "backend" not in self.model_fields_set

    def options(self) -> dict[str, Any]:
        """Return the options table of the chosen backend, empty if the config has no such table."""
        bare = self.backend.rpartition(":")[2]
        return dict(self.tables.get(self.backend, self.tables.get(bare, {})))


class ControllerSection(BackendSection):
    """The section of the controller, with the switch between closed and open loop."""

    enabled: bool = Field(default=True, strict=True, description="false: detect slip but do not correct the grip")


class ScheduleOptions(BaseModel):
    """The rate of each task of the loop. The sensor is polled at eight times its nominal rate."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    gripper_rate_hz: float = Field(
        default=100.0, gt=0, le=1000, description="rate of reading the states of gripper and arm"
    )
    arm_rate_hz: float = Field(
        default=125.0, gt=0, le=1000, description="rate of commanding the arm and of sampling the simulated truth"
    )
    pose_rate_hz: float = Field(default=60.0, gt=0, le=1000, description="rate of reading the pose source")


class PluginOptions(BaseModel):
    """Plugins that are not loaded."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    block: tuple[str, ...] = Field(default=(), description="distributions or plugins not to load")


class FingerSection(BackendSection):
    """One of several tactile sensors, `[sensors.NAME]`."""

    opposite: bool | None = Field(
        default=None,
        strict=True,
        description="true: this finger faces the first one; default: false for the first finger, true for all others",
    )


class FaultSection(BaseModel):
    """One fault, a table of `[[faults]]`: its other keys are options of that fault."""

    model_config = ConfigDict(extra="allow", frozen=True)

    backend: str
    finger: str = Field(default="", strict=True, description="the finger that it afflicts; empty: every one")

    def options(self) -> dict[str, Any]:
        """Return what is not `backend` or `finger`."""
        return dict(self.__pydantic_extra__ or {})


_SECTIONS: dict[Kind, type[BackendSection]] = {"controller": ControllerSection}


class _Settings(BaseModel):
    """The part of a configuration that does not depend on the kinds of backends."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    seed: int = Field(default=0, strict=True, ge=0, lt=2**63, description="seed of every random stream in the run")
    clock: Literal["auto", "virtual", "wall"] = Field(
        default="auto", description="auto: virtual if every chosen device can run on simulated time, else wall"
    )
    calibration: tuple[str, ...] = Field(
        default=(),
        description="files written by lsds calibrate, relative to this file: options that count below its own",
    )
    sensors: dict[str, FingerSection] = Field(
        default_factory=dict, description="several fingers by name, each like [sensor], which is then not allowed"
    )
    faults: tuple[FaultSection, ...] = Field(default=(), description="what goes wrong on purpose, one table each")
    tactile: TactileOptions = TactileOptions()
    grip: GripOptions = GripOptions()
    task: TaskOptions = TaskOptions()
    safety: SafetyOptions = SafetyOptions()
    deadlines: DeadlineOptions = DeadlineOptions()
    schedule: ScheduleOptions = ScheduleOptions()
    plugins: PluginOptions = PluginOptions()

    @model_validator(mode="wrap")
    @classmethod
    def _keep_default_backend(cls, data: Any, validate: ModelWrapValidatorHandler[Self]) -> Self:
        """Let a section hold only options tables; it keeps the default backend."""
        if not isinstance(data, Mapping):
            return validate(data)
        filled = dict(data)
        for kind in CONFIG_KINDS:
            filled[kind] = _with_default(filled.get(kind), kind)
        fingers = filled.get("sensors")
        if isinstance(fingers, Mapping) and fingers:
            if data.get("sensor") is not None:
                raise ValueError("[sensor] and [sensors] cannot be used together: configure one finger or several")
            if "" in fingers:
                raise ValueError("[sensors]: a finger needs a name, such as [sensors.left]")
            filled["sensors"] = {name: _with_default(finger, "sensor") for name, finger in fingers.items()}
        config = validate({key: value for key, value in filled.items() if value is not None})
        for kind in CONFIG_KINDS:
            _mark_default(getattr(config, kind), data.get(kind))
        for name, finger in config.sensors.items():
            _mark_default(finger, data["sensors"][name])
        return config

    @model_validator(mode="after")
    def _rates_fit_the_limits(self) -> _Settings:
        """Refuse rates at which commands would expire, or the watchdog would fire, between two ticks."""
        period = 1 / self.schedule.arm_rate_hz
        for name in ("command_lifetime_s", "watchdog_s"):
            if 2 * period > getattr(self.safety, name):
                raise ValueError(
                    f"schedule.arm_rate_hz = {self.schedule.arm_rate_hz:g} is too slow for safety.{name} = "
                    f"{getattr(self.safety, name):g}: at least two ticks must fit into it"
                )
        if 2 / self.schedule.gripper_rate_hz > self.safety.stale_after_s:
            raise ValueError(
                "schedule.gripper_rate_hz is too slow for safety.stale_after_s: two readings must fit into it"
            )
        return self

    def section(self, kind: Kind) -> BackendSection:
        """Return the section of a kind of backend; with several sensors, that of the first."""
        if kind == "sensor" and self.sensors:
            return next(iter(self.sensors.values()))
        found: BackendSection = getattr(self, kind)
        return found

    def as_tables(self) -> dict[str, Any]:
        """Return the configuration as nested tables, with either [sensor] or [sensors].

        The tables contain the values of the calibration files, so that the dump stands without them.
        """
        tables = self.model_dump() | {"calibration": ()}
        del tables["sensor" if self.sensors else "sensors"]
        return tables

    @property
    def fingers(self) -> dict[str, BackendSection]:
        """Return the sections of all sensors by finger name; a single sensor is called "finger"."""
        return dict(self.sensors) if self.sensors else {"finger": self.section("sensor")}


def _with_default(section: Any, kind: Kind) -> Any:
    if isinstance(section, Mapping) and "backend" not in section:
        return {"backend": KINDS[kind].default, **section}
    return section


def _mark_default(section: BackendSection, given: Any) -> None:
    """Record that a section got its backend by default."""
    if given is None or (isinstance(given, Mapping) and "backend" not in given):
        section.model_fields_set.discard("backend")


if TYPE_CHECKING:

    class RigConfig(_Settings):
        """All that decides a run, in one value: the settings, and a section for each kind of backend."""

        def __getattr__(self, kind: str) -> Any: ...

else:
    RigConfig = create_model(
        "RigConfig",
        __base__=_Settings,
        __module__=__name__,
        __doc__="All that decides a run, in one value: the settings, and a section for each kind of backend.",
        **{
            kind: (section, section(backend=KINDS[kind].default))
            for kind, section in ((kind, _SECTIONS.get(kind, BackendSection)) for kind in CONFIG_KINDS)
        },
    )
