"""`lsds.testing.wire_mock` with the GelSight Mini, read by OpenCV and by plain HTTP clients."""

from __future__ import annotations

import contextlib
import socket
import time

import cv2
import pytest

from lsds.testing import wire_mock
from tests.wire.waiting import until

SILENT = 100
"""More clients than the camera lets wait for their request."""


@pytest.fixture(scope="module")
def mock():
    with wire_mock("gelsight-mini", width=320, height=240) as mock:
        yield mock
        assert mock.process.complaints == ""


def snapshot(mock, timeout_s=2.0):
    """The bytes that a request for one picture returns."""
    answer = b""
    with socket.create_connection((mock.host, mock.port), timeout_s) as link:
        link.settimeout(timeout_s)
        link.sendall(b"GET /snapshot HTTP/1.0\r\n\r\n")
        while piece := link.recv(1 << 16):
            answer += piece
    return answer


def test_opencv_sees_black_pictures_only_while_the_fault_is_on(mock):
    camera = cv2.VideoCapture(mock.address, cv2.CAP_FFMPEG)
    if not camera.isOpened():
        pytest.skip("this build of OpenCV reads no HTTP streams")

    def black():
        return camera.read()[1].max() < 10

    try:
        assert not black()
        with mock.fault("black-frame"):
            assert until(black)
        assert until(lambda: not black())
        assert mock.received[-1].meaning.startswith("GET /?action=stream HTTP/1.")
        assert mock.received[-1].face == "http"
    finally:
        camera.release()


def test_a_disconnect_lasts_as_long_as_its_block(mock):
    assert b"image/jpeg" in snapshot(mock)
    with mock.fault("disconnect"):
        for _ in range(5):
            with contextlib.suppress(OSError):
                assert snapshot(mock) == b""
            time.sleep(0.03)
    assert b"image/jpeg" in snapshot(mock)


def test_the_second_request_starts_a_disconnect(mock):
    with mock.fault("disconnect", when="GET snapshot", nth=2):
        assert b"image/jpeg" in snapshot(mock)
        with contextlib.suppress(OSError):
            assert snapshot(mock) == b""


def test_truth_of_a_gel_at_rest(mock):
    truth = mock.truth
    assert (truth.normal_n, truth.indentation_m, truth.object, truth.moving) == (0.0, 0.0, "none", False)


def test_silent_clients_do_not_keep_out_one_that_asks(mock):
    with contextlib.ExitStack() as links:
        for _ in range(SILENT):
            links.enter_context(socket.create_connection((mock.host, mock.port), 2))
        start = time.monotonic()
        assert b"image/jpeg" in snapshot(mock)
        assert time.monotonic() - start < 1.0  # the camera waits 2 s for a request
