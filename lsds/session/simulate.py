"""Many simulated runs: results as they come, from several processes that keep compiled kernels and gel matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from lsds.config import RigConfig, load_config
from lsds.config.overrides import override_texts
from lsds.contracts import CellTruth
from lsds.errors import DataError, LsdsError
from lsds.session.run import Session, run
from lsds.session.verdict import Verdict
from lsds.support.numeric import is_whole
from lsds.support.processes import DIED, spread

Scenario: TypeAlias = RigConfig | str | Path | Mapping[str, Any] | Sequence[str]
"""A configuration, its file, config keys with values, or overrides as text ("task.lift_s=1"). A text that ends in
`.toml` and has no `=` is a file; any other text is one override of the default."""
_Plain: TypeAlias = RigConfig | tuple[str | None, tuple[str, ...]] | DataError
"""A scenario: a configuration, or its file and overrides, or why it cannot run."""
_Item: TypeAlias = tuple[int, _Plain]
"""Number and scenario."""
VIRTUAL = "clock=virtual"
"""Refuses a config with a real device: many runs must not move one."""


@dataclass(frozen=True, slots=True)
class SimulatedRun:
    """The result of one scenario; `number` is its place among those given.

    `error` is why it could not run, or why its figures are missing, "" otherwise. If it ran, `summary` and `verdict`
    are those of `lsds.run`, and `figures` is what the function `figures` returned. `truths` are the states of the cell,
    empty unless they were asked for.
    """

    number: int
    summary: dict[str, Any]
    verdict: Verdict | None
    figures: Any = None
    truths: tuple[CellTruth, ...] = ()
    error: str = ""

    def __repr__(self) -> str:
        outcome = self.error or (self.verdict.sentence if self.verdict is not None else "")
        return f"SimulatedRun({self.number}: {outcome})"


def simulate(
    scenarios: Iterable[Scenario],
    *,
    jobs: int = 1,
    figures: Callable[[Session], Any] | None = None,
    truths: bool = False,
) -> Iterator[SimulatedRun]:
    """Run scenarios in simulated time and yield each result when it is done, whatever its place among them.

    All scenarios are read before the first runs. `jobs` is the number of processes; a crash ends only the scenario that
    caused it, and results do not depend on the number. Parts that the program registers must then be registered at the
    top of its main module: a process imports that, but runs nothing below `if __name__ == "__main__":`.

    `figures` computes something from a run's session in the process that ran it: a function of a module, with a result
    that pickle can write and read. `truths` keeps the states of the cell, some 100 kB a second. A scenario that cannot
    run, because its config is wrong or names a real device, has an `error`, as has one whose `figures` raise. Raises
    DataError if no process starts, for arguments of other types, or if `figures` cannot be sent to a process.
    """
    if not is_whole(jobs) or jobs < 1:
        raise DataError(f"jobs = {jobs!r}: must be a whole number from 1 on")
    if isinstance(scenarios, str | Path | Mapping | RigConfig):
        raise DataError(f"{scenarios!r} is one scenario: give a list of scenarios")
    if not isinstance(scenarios, Iterable):
        raise DataError(f"{scenarios!r} is no list of scenarios")
    if figures is not None and not callable(figures):
        raise DataError(f"figures = {figures!r}: must be a function of a run's session")
    if jobs > 1 and figures is not None:
        problem = _unsendable(figures)
        if problem:
            raise DataError(f"figures = {figures!r} {problem}; give a function of a module, or jobs = 1")
    items = [(number, _plain(scenario)) for number, scenario in enumerate(scenarios)]
    return _results(items, jobs, partial(_run_one, figures=figures, truths=truths, sends=jobs > 1))


def _unsendable(value: Any) -> str:
    """Return why another process cannot get a value, "" if it can."""
    from multiprocessing.reduction import ForkingPickler

    try:
        sent = ForkingPickler.dumps(value)
    except Exception as error:
        return f"cannot be sent to other processes ({error})"
    try:
        # The other process reads it in the same way.
        ForkingPickler.loads(sent)
    except Exception as error:
        return f"cannot be received by other processes ({type(error).__name__}: {error})"
    return ""


def _results(items: list[_Item], jobs: int, work: Callable[[_Item], SimulatedRun]) -> Iterator[SimulatedRun]:
    for (number, _), result in spread(work, items, jobs):
        yield result if result is not None else SimulatedRun(number, {}, None, error=DIED)


def _plain(scenario: Scenario) -> _Plain:
    """Return a scenario as a configuration, as a file and overrides, or as the error of a value. Raises DataError for
    anything else."""
    if isinstance(scenario, RigConfig):
        return scenario
    if isinstance(scenario, Path) or (isinstance(scenario, str) and scenario.endswith(".toml") and "=" not in scenario):
        return str(scenario), ()
    if isinstance(scenario, str):
        return None, (scenario,)
    if isinstance(scenario, Mapping):
        try:
            return None, tuple(override_texts(scenario))
        except TypeError as error:
            return DataError(str(error))
    if isinstance(scenario, Sequence) and all(isinstance(text, str) for text in scenario):
        return None, tuple(scenario)
    raise DataError(
        f"{scenario!r} is no scenario: give a config, its file, a mapping of config keys, or a list of texts"
    )


def _run_one(
    item: _Item,
    *,
    figures: Callable[[Session], Any] | None,
    truths: bool,
    sends: bool = False,
) -> SimulatedRun:
    number, scenario = item
    try:
        if isinstance(scenario, DataError):
            raise scenario
        if isinstance(scenario, RigConfig):
            config = scenario.model_copy(update={"clock": "virtual"})
        else:
            config = load_config(scenario[0], [*scenario[1], VIRTUAL])
        session = run(config)
        session.require_uninterrupted()
    except LsdsError as error:
        return SimulatedRun(number, {}, None, error=f"{type(error).__name__}: {error}")
    result = SimulatedRun(number, session.summary, session.verdict)
    if truths:
        result = replace(result, truths=tuple(session.truths))
    if figures is None:
        return result
    named = getattr(figures, "__name__", "figures")
    try:
        found = figures(session)
    except (Exception, SystemExit) as error:
        return replace(result, error=f"{named} raised {type(error).__name__}: {error}")
    problem = _unsendable(found) if sends else ""
    if problem:
        return replace(result, error=f"the result of {named}, of type {type(found).__name__}, {problem}")
    return replace(result, figures=found)
