"""Long work reports its progress: with a bar on a terminal, otherwise with a line at intervals."""

import contextlib
import io

import pytest

from lsds.cli import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(("every_s", "lines"), [(0, ["collecting", "collecting: 3 of 600"]), (20, ["collecting"])])
def test_where_there_is_no_terminal_it_is_a_line_now_and_then(monkeypatch, capsys, every_s, lines):
    monkeypatch.setattr(progress, "EVERY_S", every_s)
    with progress.Progress("collecting") as shown:
        shown.to(3, 600)
    assert capsys.readouterr().err.splitlines() == lines


@pytest.mark.parametrize("fails", [False, True])
def test_on_a_terminal_it_is_a_bar_that_is_full_at_the_end_unless_the_work_failed(monkeypatch, fails):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    with contextlib.suppress(KeyError), progress.Progress("collecting") as shown:
        shown.to(0, 0)
        shown.to(300, 600)
        if fails:
            raise KeyError
    assert "50%" in terminal.getvalue()
    assert ("100%" in terminal.getvalue()) is not fails
