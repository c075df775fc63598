"""`lsds run`: the closed loop, on hardware or in the simulated cell."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from lsds.cli.complete import fault_moment
from lsds.cli.output import json_option, require_writable, verbose_option, write_json
from lsds.cli.run_summary import full_table, short_table
from lsds.cli.set_option import set_option
from lsds.cli.threads import one_thread

if TYPE_CHECKING:
    from lsds.session.recording.writer import Images
    from lsds.session.run import Session


@click.command()
@click.argument("config", required=False, type=click.Path(dir_okay=False, path_type=Path))
@set_option("Override one option; repeatable.")
@click.option(
    "--seed", type=click.IntRange(min=0), default=None, help="Seed of every random stream; the same as --set seed=N."
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="NAME[:N][@MOMENT]",
    shell_complete=fault_moment,
    help="Let a part fail on purpose: a fault of lsds plugins, its severity 1 to 5, a stage of the job; repeatable, in "
    "addition to those of CONFIG.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("run.png"),
    show_default=True,
    help="Draw the run to this PNG.",
)
@click.option("--no-plot", is_flag=True, help="Draw nothing.")
@click.option(
    "--record",
    type=click.Path(dir_okay=False, path_type=Path),
    default=None,
    metavar="F.mcap",
    help="Keep everything the run takes in and sends out in this new file, for lsds replay, Foxglove and Rerun.",
)
@click.option(
    "--record-images",
    type=click.Choice(["lossless", "jpeg"]),
    default="lossless",
    show_default=True,
    help="Images of the recording; a replay of jpeg, a tenth of the size, is not exact.",
)
@click.option(
    "--view",
    default=None,
    metavar="WHERE",
    help="Show the run live: terminal; rerun (extra view); rerun+http://HOST:PORT/proxy; or write F.rrd for Rerun.",
)
@click.option(
    "--report",
    "page",
    type=click.Path(dir_okay=False, path_type=Path),
    default=None,
    metavar="F.html",
    help="Write this new page with plots, images, events and summary; it opens from disk.",
)
@verbose_option
@json_option
def run(
    config: Path | None,
    overrides: tuple[str, ...],
    seed: int | None,
    faults: tuple[str, ...],
    plot: Path,
    no_plot: bool,
    record: Path | None,
    record_images: Images,
    view: str | None,
    page: Path | None,
    verbose: bool,
    json_file: str | None,
) -> None:
    """Grasp, lift and hold an object, and close the gripper when it slips.

    Ctrl-C (or SIGTERM) stops the cell, keeps the grip, and still writes the results so far; it draws only if --plot is
    given.

    Without CONFIG it runs the simulated cell: a PVC pipe, gripped slightly too weakly, lifted at 3.8 cm/s.

    \b
    Exit codes:
        0  held: in the grip at the end; or the job has released it
        8  dropped
        9  slipped too far: in the grip, after more slip than task.max_slip_m
       10  crushed: gripped above task.fragile_n or task.max_grip_ratio
       11  not lifted: the fingers never gripped the object
       12  outside the model's validity: held, but the simulation is unreliable
        7  stopped for safety; 2 to 6: stopped by another error
      130  stopped by Ctrl-C; 143 by SIGTERM

    Takes: some 10 s in the simulated cell, the first run 30 s more to compile the gel; on hardware as long as the
    job.

    Writes: run.png (--plot), and the files of --json, --record, --report and --view.

    \b
    Examples:
      lsds run                                 run the simulated cell
      lsds run --json run.json --seed 7        write JSON, use another seed
      lsds run --set controller.enabled=false  no correction: dropped (8)
      lsds run --set controller.backend=pd --set controller.pd.literal_sign=true
                                               the paper's sign: dropped (8)
      lsds run --fault gripper-stuck@slip      the fingers stop: safety stop (7)
      lsds run --fault camera-noise:5@lift     noise from the lift on: stop (7)
      lsds run rig.toml --no-plot              run your own cell
      lsds run --verbose                       print every figure
      lsds run --view terminal                 watch it as text
      lsds run --record run.mcap               keep frames, states and commands
      lsds run --report run.html               look at the run in a browser
    """
    one_thread()
    from lsds.cli.faults import faults_override
    from lsds.cli.report import recording_for, report_run
    from lsds.session.run import run as run_session
    from lsds.session.verdict import Outcome

    chosen = (*overrides, *faults_override(faults, config), *([] if seed is None else [f"seed={seed}"]))
    # Check the output files before anything moves: a finished run cannot be repeated because a folder is missing.
    for target in (json_file, None if no_plot else plot):
        require_writable(target)

    def report(session: Session) -> None:
        if json_file != "-":
            click.echo(full_table(session.summary) if verbose else short_table(session.summary))
        if json_file is not None:
            write_json(session.summary, json_file)
        for fault in session.summary["faults"]:
            if fault["began_s"] is None:
                moment, came = fault["moment"], ", ".join(session.stages.names)
                click.echo(f"note: {fault['backend']} never began: no '{moment}' came (there were {came})", err=True)
        recorded = session.summary["recording"]
        if recorded is not None and record is not None:
            click.echo(f"recording: {recorded['file']}, {recorded['messages']} messages", err=json_file == "-")
        sys.stdout.flush()
        if not isinstance(session.fault, KeyboardInterrupt):
            draw(session)

    def draw(session: Session) -> None:
        if not no_plot and session.record.samples:
            session.draw(plot)
            click.echo(f"picture: {plot}", err=json_file == "-")

    with recording_for(page, record) as kept:
        session = run_session(
            config, chosen, finished=_fault_first(report), record=kept, images=record_images, view=view
        )
        if page is not None and kept is not None:
            target, source = page, kept
            _fault_first(lambda ended: report_run(ended, target, source, err=json_file == "-"))(session)
    if isinstance(session.fault, KeyboardInterrupt):
        # Drawing takes seconds, and the user who has interrupted waits for the end.
        asked = click.get_current_context().get_parameter_source("plot") is ParameterSource.COMMANDLINE
        _fault_first(draw if asked else _say_no_picture)(session)
    recorded = session.summary["recording"]
    if recorded is not None and recorded["problem"]:
        click.echo(f"warning: recording {recorded['file']}: {recorded['problem']}", err=True)
    if session.summary["view"]:
        click.echo(f"warning: view: {session.summary['view']}", err=True)
    verdict = session.verdict
    if verdict.exit_code and verdict.outcome is not Outcome.STOPPED:
        # The outcome of the lift comes before devices that did not close.
        for failure in getattr(session.fault, "exceptions", ()):
            click.echo(f"error: {failure}", err=True)
        raise click.exceptions.Exit(verdict.exit_code)
    if session.fault is not None:
        raise session.fault


def _say_no_picture(session: Session) -> None:
    if session.record.samples:
        click.echo("picture: not drawn after an interrupt; give --plot FILE to draw it anyway", err=True)


def _fault_first(report: Callable[[Session], None]) -> Callable[[Session], None]:
    """Return a report whose own failure, such as a full disk, does not hide the error that ended the run."""

    def reporting(session: Session) -> None:
        try:
            report(session)
        except Exception as error:
            if session.fault is None:
                raise
            session.fault.add_note(f"and while writing the results: {error}")

    return reporting
