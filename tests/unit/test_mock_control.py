"""The control channel of `lsds mock --control`, with a mock that has only the required methods."""

from __future__ import annotations

import io
import json
import sys
import threading

import pytest

from lsds.cli.mock_session import _control


class PlainMock:
    """Begins faults, and no more."""

    def __init__(self):
        self.faults = []

    def inject(self, fault):
        self.faults.append(fault)


@pytest.fixture
def answers(monkeypatch, capsys):
    def ask(mock, *requests):
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(json.dumps(request) + "\n" for request in requests)))
        stop = threading.Event()
        _control(mock, stop)
        assert stop.is_set()
        return [json.loads(line) for line in capsys.readouterr().out.splitlines()]

    return ask


def test_a_plain_mock_begins_faults(answers):
    mock = PlainMock()
    assert answers(mock, {"kind": "drop"}) == [{"ok": True}]
    assert mock.faults == [{"kind": "drop"}]


@pytest.mark.parametrize("request_", [{"kind": "drop", "name": "a"}, {"request": "end", "name": "a"}])
def test_a_plain_mock_begins_no_fault_that_it_cannot_end(answers, request_):
    mock = PlainMock()
    (answer,) = answers(mock, request_)
    assert not answer["ok"]
    assert "cannot end a fault" in answer["error"]
    assert mock.faults == []
