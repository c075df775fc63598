"""Options of the study `certify`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, model_validator

from lsds.cli.threads import processes
from lsds.errors import DataError
from lsds_research.campaign_options import Cluster, Jobs, Out, Settings
from lsds_research.certify.duration import seconds_of


class CertifyOptions(BaseModel):
    """Estimate how likely a rig is to drop an object, and name the ranges in which it is most likely.

    Lifts of objects drawn from ranges, by the rig's algorithms, task and limits, in a simulated cell with the specs
    of its gripper and fingertip. Real devices are not touched. Runs are spent where the answer is least certain. The
    result is a probability with a 95 % interval, slip, grip and reaction time, dangerous zones, and failures as files
    that lsds run repeats. All of it is simulated.

    Takes: the time of --budget, or 1 to 3 s of one core per lift with --runs.

    \b
    Examples:
      lsds study certify --quick
      lsds study certify rig.toml --budget 10min --report certificate.html
      lsds study certify rig.toml --space objects.toml --runs 300 \\
          --found failures
      lsds study certify --budget 5min --plain
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    rig: str = Field(
        default="",
        description="rig file; default: the simulated cell",
        json_schema_extra={"metavar": "RIG", "argument": True},
    )
    budget: str = Field(
        default="10min",
        description="time to spend, as 90s, 10min or 2h; results then depend on the machine's speed",
        json_schema_extra={"metavar": "TIME"},
    )
    runs: int = Field(default=0, ge=0, le=1_000_000, description="number of lifts to spend, instead of a time")
    space: str = Field(
        default="",
        description="TOML file of ranges as for lsds study search; default: random objects",
        json_schema_extra={"metavar": "FILE"},
    )
    plain: bool = Field(default=False, description="draw evenly and count, to compare with")
    slip_mm: float = Field(
        default=0.0,
        ge=0,
        le=1000,
        description="a longer slip is a drop; 0: task.max_slip_m of the rig, or else 60",
    )
    found: str = Field(
        default="",
        description="folder for the worst failures",
        json_schema_extra={"metavar": "FOLDER", "writes": "folder"},
    )
    most: int = Field(default=5, ge=0, le=100, description="number of failures to save")
    settings: Settings = []
    out: Out = ""
    quick: bool = Field(default=False, description="48 lifts of one second, or as many as fit into a --budget")
    jobs: Jobs = Field(default_factory=processes, description="processes that lift")
    cluster: Cluster = ""

    @model_validator(mode="after")
    def _one_budget(self) -> CertifyOptions:
        if self.runs and "budget" in self.model_fields_set:
            raise ValueError("budget and runs exclude each other: give a time, or a number of lifts")
        if self.out and not self.runs:
            raise ValueError("out needs runs: a number of lifts can be continued, a time cannot")
        try:
            seconds_of(self.budget, "--budget")
        except DataError as error:
            raise ValueError(str(error)) from error
        return self
