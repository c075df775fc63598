"""Progress of long work: a bar on a terminal, otherwise (log file, pipe) a line at intervals."""

from __future__ import annotations

import sys
from types import TracebackType

import click

from lsds.clock import NS_PER_S, perf_ns

EVERY_S = 20
"""Interval of lines of progress outside a terminal, s; chosen."""
_BAR_STEPS = 1000
"""Steps of the bar in a terminal; chosen."""


class Progress:
    """`with Progress("collecting") as progress: progress.to(done, whole)`, on stderr."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._reported_ns = perf_ns()
        self._bar = click.progressbar(length=_BAR_STEPS, label=label, file=sys.stderr) if sys.stderr.isatty() else None

    def __enter__(self) -> Progress:
        if self._bar is None:
            click.echo(self._label, err=True)
        else:
            self._bar.__enter__()
        return self

    def to(self, done: int, whole: int) -> None:
        """Report progress: `done` of `whole` items."""
        if self._bar is not None:
            self._bar.update(_BAR_STEPS * done // max(whole, 1) - self._bar.pos)
        elif perf_ns() - self._reported_ns > EVERY_S * NS_PER_S:
            self._reported_ns = perf_ns()
            click.echo(f"{self._label}: {done} of {whole}", err=True)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            if error is None:
                self._bar.update(_BAR_STEPS - self._bar.pos)
            self._bar.__exit__(kind, error, trace)
