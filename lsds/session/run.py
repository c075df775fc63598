"""Run a job from config to summary, without printing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.clock import perf_ns, seconds
from lsds.config import RigConfig
from lsds.contracts import CellTruth, Cycle, Frame, Job, MarkerReference
from lsds.contracts.events import TruthKnown
from lsds.contracts.stages import Stages
from lsds.errors import LsdsError, PluginError
from lsds.runtime.engine import Engine
from lsds.runtime.observers import Observers, ObserverStatistics
from lsds.runtime.rig import Rig, require_moments
from lsds.safety.device_calls import call_of
from lsds.session.parts import loaded, with_parts
from lsds.session.record import RunRecord
from lsds.session.recording import recorder_of
from lsds.session.summary import summarise
from lsds.session.truth_log import TruthLog
from lsds.session.verdict import Verdict
from lsds.session.view import view_of
from lsds.support.blas import one_blas_thread
from lsds.support.extras import require
from lsds.support.tracebacks import forget_locals

if TYPE_CHECKING:
    from lsds.session.recording.writer import Images, RecordingWriter
    from lsds.session.view import View


LAST_WRITES_S = 10.0
"""Time in which a recording may write what waits when the run has ended, s."""


@dataclass(frozen=True, slots=True, repr=False)
class Session:
    """A finished run. `fault` is the error or Ctrl-C that ended it early, None if it ran to the end; `stages` holds
    when each stage began; `verdict` is the outcome with its reason.

    Errors while closing, after a run without a fault, become its `fault` (an ExceptionGroup); the summary
    is of the run, and has none then.
    """

    summary: dict[str, Any]
    record: RunRecord
    truths: Sequence[CellTruth]
    reference_frame: Frame | None
    reference: MarkerReference | None
    fault: BaseException | None
    stages: Stages
    verdict: Verdict

    def __repr__(self) -> str:
        figures = self.summary.get("figures_are", "")
        return f"Session({self.verdict.sentence}; {self.summary['cycles']} cycles, {figures})"

    def require_uninterrupted(self) -> None:
        """Raise the Ctrl-C or the request to terminate that ended the run: it ends a campaign, too."""
        if isinstance(self.fault, KeyboardInterrupt):
            raise self.fault

    def frame(self) -> Any:
        """Return one row a frame as a pandas DataFrame: the fields of `Sample`, in SI units, and `t_s` since the start.

        Raises MissingExtra without pandas.
        """
        require("pandas", extra="data", purpose="a table of the run")
        import pandas as pd

        table = pd.DataFrame([asdict(sample) for sample in self.record.samples])
        if len(table):
            table.insert(0, "t_s", (table["t_ns"] - table["t_ns"].iloc[0]) * 1e-9)
        return table

    def draw(self, path: Path) -> None:
        """Write the picture of the run. Raises DataError where the file cannot be written."""
        from lsds.errors import DataError
        from lsds.session.pictures.run import plot_run

        if self.reference_frame is None or self.reference is None:
            return
        try:
            plot_run(path, self.record, self.truths, self.reference_frame, self.reference, self.summary)
        except (OSError, ValueError) as error:
            raise DataError(f"{path}: the picture cannot be written: {error}") from error


@one_blas_thread()
def run(
    config: RigConfig | Mapping[str, Any] | str | Path | None = None,
    overrides: str | Sequence[str] | Mapping[str, Any] = (),
    *,
    job: Job | None = None,
    observe: Callable[[Cycle], object] | None = None,
    finished: Callable[[Session], object] | None = None,
    record: str | Path | None = None,
    images: Images = "lossless",
    view: str | None = None,
    tracker: Any = None,
    detector: Any = None,
    estimator: Any = None,
    controller: Any = None,
) -> Session:
    """Load, connect, arm, run the job, close. An error during the run becomes `fault`; an earlier one is raised.

    `config` is a configuration, its file, or config keys with values ({"task.lift_s": 1}); None is the simulated cell.
    `overrides` change its keys: texts ("task.lift_s=1"), or keys with values. `job` replaces that of the config;
    `observe` is called with every cycle. Whatever ends the run, the cell is stopped and closed, and the summary
    contains everything recorded until then. `finished` is called with the session when the cell has been stopped and
    before it is closed, so that results are safe first.
    `record` is a new file, F.mcap, that keeps everything the run takes in and sends out; `images` are kept "lossless",
    or as "jpeg" in a tenth of the space, from which a replay is not exact. Raises DataError before anything moves where
    it cannot be created; what goes wrong with it later is in `summary["recording"]["problem"]`. `view` shows the run
    while it goes on, see `lsds.session.view.view_of`; what goes wrong with it is in `summary["view"]`. `tracker`,
    `detector`, `estimator` and `controller` replace those of the config: an object, or a class that is built for each
    finger.
    """
    chosen = loaded(config, overrides)
    if isinstance(job, type):
        raise PluginError(f"job is the class {job.__name__}; give an object: {job.__name__}()")
    parts = {"tracker": tracker, "detector": detector, "estimator": estimator, "controller": controller}
    return _without_locals(_run_once(chosen, parts, job, observe, finished, record, images, view))


def _without_locals(session: Session) -> Session:
    """Return a session whose fault does not keep the cell alive: the functions that referred to it have ended."""
    forget_locals(session.fault)
    return session


def _run_once(
    config: RigConfig,
    parts: Mapping[str, Any],
    job: Job | None,
    observe: Callable[[Cycle], object] | None,
    finished: Callable[[Session], object] | None,
    record: str | Path | None,
    images: Images,
    view: str | None,
) -> Session:
    with with_parts(config, parts) as complete:
        rig = Rig(complete)
    require_moments(rig, job)
    with rig:
        watcher = view_of(view) if view is not None else None
        with ExitStack() as unless_it_runs:
            if watcher is not None:
                unless_it_runs.callback(watcher.close)
            recorder = recorder_of(rig, record, images)
            if recorder is not None:
                unless_it_runs.callback(recorder.discard)
            rig.arm_devices()
            engine = Engine(rig, job)
            unless_it_runs.pop_all()
        session = _run(rig, engine, observe, recorder, watcher)
        if isinstance(session.fault, KeyboardInterrupt):
            rig.hurry()
        if finished is not None:
            finished(session)
        try:
            rig.close()
        except ExceptionGroup as failures:
            # A run that has ended well is not lost because a device would not close.
            if session.fault is None:
                session = replace(session, fault=failures)
            else:
                for failure in failures.exceptions:
                    session.fault.add_note(f"and while closing: {type(failure).__name__}: {failure}")
    return session


def _run(
    rig: Rig,
    engine: Engine,
    observe: Callable[[Cycle], object] | None,
    recorder: RecordingWriter | None = None,
    watcher: View | None = None,
) -> Session:
    """Run the job on a rig that is armed, and make its summary."""
    rate_hz = rig.config.schedule.arm_rate_hz
    truths = TruthLog(rig.own_cell, rate_hz)
    record = RunRecord(truths)
    # The summary is made from the record. Recording takes microseconds, so it runs inline and drops nothing.
    engine.observers.add("record", record.observe)
    # Other observers of a cycle (a live view, say) run in the caller's thread.
    watching: Observers[Cycle] = Observers(threaded=False)
    if observe is not None:
        watching.add("observe", observe)
    if recorder is not None:
        engine.events.add("recording", recorder.observe, recorder.close)
    if watcher is not None:
        engine.events.add("view", watcher.observe, watcher.close)

    def sample(now_ns: int) -> None:
        truth = truths.sample(now_ns)
        if truth is not None:
            engine.events.publish(TruthKnown(now_ns, truth))

    if rig.own_cell is not None:
        engine.every("truth", sample, rate_hz)
    with ExitStack() as ending:
        ending.callback(engine.events.close, LAST_WRITES_S)
        fault, summary, verdict = _summarised(
            rig, engine, record, truths, watching, sample, observes=observe is not None
        )
        if recorder is not None:
            recorder.summary = summary
    of_events = {own.name: own for own in engine.events.statistics()}
    summary["recording"] = None if recorder is None else _recorded(recorder, of_events["recording"])
    summary["view"] = None if watcher is None else of_events["view"].failure
    perception = engine.perception
    truths.release()
    return Session(
        summary, record, truths.samples, perception.reference_frame, perception.reference, fault, rig.stages, verdict
    )


def _summarised(
    rig: Rig,
    engine: Engine,
    record: RunRecord,
    truths: TruthLog,
    watching: Observers[Cycle],
    sample: Callable[[int], None],
    *,
    observes: bool,
) -> tuple[BaseException | None, dict[str, Any], Verdict]:
    """Run the engine to its end; return the error that ended it early, the summary and the verdict."""
    begun, began_ns = perf_ns(), rig.clock.now()
    fault: BaseException | None = None
    try:
        if not observes:
            engine.run()
        else:
            with closing(iter(engine)) as cycles:
                for cycle in cycles:
                    watching.publish(cycle)
        sample(rig.clock.now())
    except (LsdsError, KeyboardInterrupt) as error:
        fault = error
    except Exception as error:
        call = call_of(error)
        who = "a backend" if call is None else f"{call.who} in {call.name}()"
        note = "; ".join(getattr(error, "__notes__", ()))
        fault = PluginError(f"{who} raised {type(error).__name__}: {error} ({note}) (lsds --debug run shows where)")
        fault.__cause__ = error
    finally:
        wall_s = seconds(perf_ns() - begun)
        simulated_s = seconds(rig.clock.now() - began_ns)
        engine.observers.close()
    observers = (*engine.observers.statistics(), *watching.statistics())
    failures = [observer.failure for observer in observers if observer.failure]
    if failures and fault is None:
        fault = PluginError(f"an observer of the run failed: {failures[0]}")
    summary, verdict = summarise(
        rig, engine, record.samples, truths.samples, wall_s=wall_s, simulated_s=simulated_s, fault=fault
    )
    return fault, summary, verdict


def _recorded(recorder: RecordingWriter, statistics: ObserverStatistics) -> dict[str, Any]:
    """Return what became of the recording."""
    problem = statistics.failure
    if statistics.dropped and not problem:
        problem = f"{statistics.dropped} events were lost: the disk is too slow; a replay will not be exact"
    return {
        "file": str(recorder.path),
        "messages": recorder.written,
        "events": statistics.delivered,
        "lost": statistics.dropped,
        "problem": problem,
    }
