"""`--report F.html` of `lsds run`: a run is recorded, and its report is made of the recording."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from lsds.session.run import Session


@contextmanager
def recording_for(page: Path | None, record: Path | None) -> Iterator[Path | None]:
    """Yield the file to record to: `record`, a temporary one if only a report is asked for, or None.

    Raises before anything moves if the report cannot be made.
    """
    if page is None:
        yield record
        return
    from lsds.session.recording.report.page import require_new

    require_new(page)
    if record is not None:
        yield record
        return
    with tempfile.TemporaryDirectory(prefix="lsds-report-") as folder:
        yield Path(folder) / f"{page.stem}.mcap"


def report_run(session: Session, page: Path, recording: Path, *, err: bool) -> None:
    """Write the report of a run that has ended, and state its file. Raises DataError."""
    from lsds.session.recording.report.page import write_report

    damage = write_report(recording, page, session.summary)
    click.echo(f"report: {page}", err=err)
    if damage:
        click.echo(f"warning: the report is incomplete: {damage}", err=True)
