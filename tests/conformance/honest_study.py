"""A small study and a small command that keep their contracts; the mutants are these with one mistake each."""

from __future__ import annotations

import click
import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import StudyResult, StudyTable

COLUMNS = (("name", "throw", ""), ("m", "m", ".2f"), ("far", "far", ""))
PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c6360606060000000050001"
    "a5f645400000000049454e44ae426082"
)


class Options(BaseModel):
    """How far a ball flies."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    throws: int = Field(default=3, ge=1, description="number of throws")
    seed: int = Field(default=0, ge=0, description="seed of the throws")


class HonestStudy:
    timed = ("taken_s",)

    def __init__(self, options, context):
        self.options = options

    def run(self, tick):
        rng = np.random.default_rng(self.options.seed)
        rows = []
        for i in range(self.options.throws):
            rows.append(self.row(i, float(rng.normal(20.0, 3.0))))
            tick(i + 1, self.options.throws)
        return self.result(rows)

    def row(self, i, distance_m):
        taken_s = float(np.random.default_rng().random())
        return {"name": f"throw {i}", "m": distance_m, "far": distance_m > 20.0, "taken_s": taken_s}

    def result(self, rows):
        most = StudyTable((("m", "farthest, m", ".1f"),), [{"m": max(row["m"] for row in rows)}])
        return StudyResult("simulated throws of a ball", COLUMNS, rows, draw=self.draw, more=[most], notes=["no wind"])

    def draw(self, path):
        path.write_bytes(PIXEL)


@click.command()
@click.option("--times", default=1, help="How often.")
def honest_command(times):
    """Greet.

    \b
    Examples:
      lsds honest-command --times 2
    """
    raise AssertionError("a check has invoked the command")


@click.group()
def honest_group():
    """Greet in several languages."""


honest_group.add_command(honest_command, "english")
