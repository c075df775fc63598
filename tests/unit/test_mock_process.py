"""The control channel of a mock's process: answers belong to their requests, and a stopped mock starts again."""

from __future__ import annotations

import queue

import pytest

from lsds.errors import DeviceError
from lsds.support.mock_process import MockProcess


def test_a_mock_that_was_stopped_starts_again():
    mock = MockProcess("hand-e", {"tcp_port": 0, "pty": ""})
    for _ in range(2):
        mock.start()
        assert mock.addresses
        mock.stop()
        assert not mock.alive


def test_after_a_late_answer_no_request_is_answered_wrongly(monkeypatch):
    with MockProcess("hand-e", {"tcp_port": 0, "pty": ""}) as mock:
        given = mock._lines.get

        def late(timeout):
            raise queue.Empty

        monkeypatch.setattr(mock._lines, "get", late)
        with pytest.raises(DeviceError, match="does not answer"):
            mock.request({"request": "received"})
        monkeypatch.setattr(mock._lines, "get", given)
        with pytest.raises(DeviceError, match="did not answer the request before"):
            mock.request({"request": "truths"})
