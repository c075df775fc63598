"""One run of the loop from config to summary, kept apart from how it is printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lsds.clock import perf_ns, seconds
from lsds.config import load_config
from lsds.contracts import CellTruth, Frame, MarkerReference
from lsds.errors import LsdsError, PluginError
from lsds.loop import Cycle, Loop
from lsds.observers import Observers
from lsds.record import RunRecord
from lsds.rig import Rig
from lsds.summary import summarise


@dataclass(frozen=True, slots=True)
class Session:
    """A finished run. `fault` is what ended it early (an error, or Ctrl-C), None for a run to the end."""

    summary: dict[str, Any]
    record: RunRecord
    truths: Sequence[CellTruth]
    reference_frame: Frame | None
    reference: MarkerReference | None
    fault: BaseException | None

    def draw(self, path: Path) -> None:
        """Write the picture of the run. Raises DataError where the file cannot be written."""
        from lsds.errors import DataError
        from lsds.plots.run_plot import plot_run

        if self.reference_frame is None or self.reference is None:
            return
        try:
            plot_run(path, self.record, self.truths, self.reference_frame, self.reference, self.summary)
        except (OSError, ValueError) as error:
            raise DataError(f"{path}: the picture cannot be written: {error}") from error


def run_session(config_file: Path | None, overrides: Sequence[str]) -> Session:
    """Load, connect, arm, run, close. What ends the run early becomes `fault`; an error before it is raised.

    Whatever ends it, the cell is stopped and closed, and what was recorded until then is in the summary.
    """
    config = load_config(config_file, overrides)
    record = RunRecord()
    fault: BaseException | None = None
    with Rig(config) as rig:
        rig.arm_devices()
        # The record is what the summary is made from, and costs microseconds: it is taken inline, nothing is dropped.
        observers: Observers[Cycle] = Observers(threaded=False)
        observers.add("record", record.observe)
        loop = Loop(rig, observers)
        begun, began_ns = perf_ns(), rig.clock.now()
        try:
            loop.run()
        except (LsdsError, KeyboardInterrupt) as error:
            fault = error
        except Exception as error:
            note = "; ".join(getattr(error, "__notes__", ()))
            fault = PluginError(
                f"a backend raised {type(error).__name__}: {error} ({note}); the cell was stopped "
                "(lsds --debug run shows where)"
            )
            fault.__cause__ = error
        finally:
            wall_s = seconds(perf_ns() - begun)
            simulated_s = seconds(rig.clock.now() - began_ns)
            observers.close()
        failures = [observer.failure for observer in observers.statistics() if observer.failure]
        if failures and fault is None:
            fault = PluginError(f"the record of the run is incomplete: {failures[0]}")
        summary = summarise(rig, loop, record.samples, wall_s=wall_s, simulated_s=simulated_s, fault=fault)
    return Session(
        summary, record, loop.truth.samples, loop.perception.reference_frame, loop.perception.reference, fault
    )
