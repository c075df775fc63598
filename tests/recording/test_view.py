"""Live views draw what happened, and neither a slow nor a lost one changes the run."""

from __future__ import annotations

import io
import math
import re
import socket

import pytest

from lsds.errors import DataError
from lsds.session.run import run
from lsds.session.view import view_of
from lsds.session.view.terminal import MOST_ROWS, TerminalView
from tests.recording.conftest import SHORT

ESCAPES = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")


class Terminal(io.StringIO):
    def isatty(self):
        return True


def shown(stream, columns, monkeypatch, **more):
    """The output of a view of a run, each cycle drawn."""
    from lsds.session import run as runs
    from lsds.session.view import terminal

    monkeypatch.setattr(terminal, "DRAWN_HZ", 10**9)
    monkeypatch.setattr(terminal, "PLAIN_HZ", 10**9)
    monkeypatch.setattr(runs, "view_of", lambda where: TerminalView(stream, columns))
    session = run(None, SHORT, view="terminal", **more)
    assert session.summary["view"] == ""
    return session, stream.getvalue()


@pytest.mark.parametrize("columns", [80, 40, 12])
def test_the_terminal_shows_image_and_numbers_in_its_width(monkeypatch, columns):
    cycles = []
    session, text = shown(Terminal(), columns, monkeypatch, observe=cycles.append)
    plain = ESCAPES.sub("", text)
    lines = plain.splitlines()
    assert max(map(len, lines)) <= columns
    assert sum(line.startswith("\u2580") for line in lines) == MOST_ROWS * len(cycles)
    if columns >= 40:
        assert sum("P(slip)" in line for line in lines) == len(cycles)
        last = cycles[-1]
        assert f"aperture  {1e3 * last.measured_m:.2f} mm" in plain
        stages = {line.split()[-1] for line in lines if " s  " in line}
        assert {"lift", "hold"} <= stages
    assert session.summary["outcome"] == "held"


def test_without_a_terminal_there_are_plain_lines(monkeypatch):
    _, text = shown(io.StringIO(), 80, monkeypatch)
    assert "\x1b" not in text
    assert all("P(slip)" in line for line in text.splitlines())


def test_a_view_that_fails_is_reported_and_the_run_goes_on(monkeypatch):
    class Gone(Terminal):
        def write(self, text):
            raise BrokenPipeError("the terminal has gone")

    from lsds.session import run as runs

    monkeypatch.setattr(runs, "view_of", lambda where: TerminalView(Gone(), 80))
    session = run(None, SHORT, view="terminal")
    assert session.summary["outcome"] == "held"
    assert "the terminal has gone" in session.summary["view"]


def test_what_is_no_view_is_refused_before_anything_moves(tmp_path):
    cycles = []
    with pytest.raises(DataError, match="no view 'televison'"):
        run(None, SHORT, view="televison", observe=cycles.append)
    assert not cycles
    pytest.importorskip("rerun")
    (tmp_path / "old.rrd").write_bytes(b"old")
    for where, why in (("old.rrd", "exists already"), ("missing/new.rrd", "no folder")):
        with pytest.raises(DataError, match=why):
            view_of(str(tmp_path / where))
    assert (tmp_path / "old.rrd").read_bytes() == b"old"


def test_reruns_own_reader_finds_every_series(tmp_path):
    pytest.importorskip("rerun", reason="needs the extra view")
    from rerun.chunk import RrdReader

    path = tmp_path / "run.rrd"
    cycles = []
    run(None, SHORT, view=str(path), observe=cycles.append)
    rows: dict[str, int] = {}
    for chunk in RrdReader(str(path)).stream():
        rows[chunk.entity_path] = rows.get(chunk.entity_path, 0) + chunk.num_rows
    assert rows["/finger/finger/image/markers"] == len(cycles)
    assert rows["/aperture/commanded_mm"] == sum(math.isfinite(cycle.held_m) for cycle in cycles)
    known = sum(math.isfinite(cycle.grip.slips) for cycle in cycles)
    assert rows["/slip/probability"] == known > 0
    assert rows["/stages"] >= 3


@pytest.mark.parametrize("refuses", [False, True])
def test_a_viewer_that_does_not_start_is_one_error_before_the_run(monkeypatch, refuses):
    """Without a display the viewer ends at once; without its program on the path nothing starts it."""
    rerun = pytest.importorskip("rerun", reason="the view in Rerun needs the extra view")
    from lsds.session.view import rerun as views

    def spawn(stream, **options):
        if refuses:
            raise RuntimeError("Failed to find Rerun Viewer executable in PATH.\n\nYou can install ...")

    monkeypatch.setattr(rerun.RecordingStream, "spawn", spawn)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        monkeypatch.setattr(views, "VIEWER_PORT", free.getsockname()[1])
        problem = "cannot be started: Failed to find" if refuses else "has not started"
        with pytest.raises(DataError, match=rf"{problem}.*--view run\.rrd"):
            run(None, SHORT, view="rerun")


def test_a_viewer_that_is_lost_does_not_hold_up_the_end_of_a_run(monkeypatch):
    rerun = pytest.importorskip("rerun", reason="the view in Rerun needs the extra view")
    limits_s = []

    def flush(stream, *, timeout_sec=1e38):
        limits_s.append(timeout_sec)
        raise RuntimeError("gRPC has been unable to connect")

    for name, answer in {"connect_grpc": lambda stream, where, **options: None, "flush": flush}.items():
        monkeypatch.setattr(rerun.RecordingStream, name, answer)
    session = run(None, SHORT, view="rerun+http://127.0.0.1:9/proxy")
    assert session.fault is None
    assert "unable to connect" in session.summary["view"]
    assert max(limits_s) < 60
