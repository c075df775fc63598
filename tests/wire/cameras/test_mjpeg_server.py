"""The MJPEG mock against a client that is not ours: OpenCV's FFmpeg. And against clients that mean no good."""

from __future__ import annotations

import contextlib
import itertools
import socket
import threading
import urllib.request
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from camera_rig import RATE_HZ, age_ms, gelsight, nothing_left, served, time_camera, wait
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.mock_process import MockProcess
from lsds_mocks.wire.address import is_loopback
from lsds_mocks.wire.mjpeg.camera import encode, torn
from lsds_mocks.wire.mjpeg.options import CameraOptions
from lsds_mocks.wire.mjpeg.request import wish

from lsds.clock import WallClock
from lsds.errors import ConnectFailed
from tests.wire.waiting import until

CLOCK = WallClock()


def ages(url, reads, pause_s=0.0):
    """Read with OpenCV; return how old each picture was, and pictures a second."""
    capture = cv2.VideoCapture(url)
    assert capture.isOpened()
    found, begin = [], CLOCK.now()
    for _ in range(reads):
        good, image = capture.read()
        assert good
        found.append(age_ms(image))
        wait(pause_s)
    seconds = (CLOCK.now() - begin) / 1e9
    capture.release()
    return np.array(found), (reads - 1) / seconds


def test_opencv_reads_at_the_cameras_rate():
    with served(time_camera()) as addresses:
        found, rate = ages(addresses["http"], 40)
    assert 0.7 * RATE_HZ < rate < 1.15 * RATE_HZ
    assert np.median(found) < 60


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
def test_a_slow_reader_gets_the_newest_picture_not_a_backlog(size):
    """With one picture in hand and one on the way, a reader that comes every 0.2 s is at most about 0.2 s late."""
    with served(time_camera(*size)) as addresses:
        found, _ = ages(addresses["http"], 14, pause_s=0.2)
    assert np.median(found[5:]) < 380
    # No backlog: what it reads last is not older than what it read before.
    assert np.mean(found[-4:]) < np.mean(found[5:9]) + 150


def test_several_readers_each_get_all():
    with served(time_camera()) as addresses:
        captures = [cv2.VideoCapture(addresses["http"]) for _ in range(3)]
        for _ in range(10):
            shown = [capture.read() for capture in captures]
            assert all(good for good, _ in shown)
            assert max(age_ms(image) for _, image in shown) < 200
        for capture in captures:
            capture.release()


def test_a_snapshot_is_one_picture():
    with served(time_camera()) as addresses, urllib.request.urlopen(addresses["snapshot"], timeout=5) as answer:
        assert answer.headers["Content-Type"] == "image/jpeg"
        image = cv2.imdecode(np.frombuffer(answer.read(), np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (480, 640, 3)
    assert age_ms(image) < 500


def test_parts_contain_time_and_number():
    with served(time_camera()) as addresses, urllib.request.urlopen(addresses["http"], timeout=5) as answer:
        assert answer.headers.get_content_type() == "multipart/x-mixed-replace"
        stamps, numbers = [], []
        while len(numbers) < 4:
            line = answer.readline().decode("latin-1")
            if line.startswith("X-Timestamp:"):
                stamps.append(float(line.split(":")[1]))
            if line.startswith("X-Sequence:"):
                numbers.append(int(line.split(":")[1]))
    assert abs(stamps[-1] - CLOCK.now() / 1e9) < 1.0
    assert np.allclose(np.diff(stamps), np.diff(numbers) / RATE_HZ, atol=1e-5)


def ask(url, request, silent=False):
    address = urlsplit(url)
    with socket.create_connection((address.hostname, address.port), timeout=5) as connection:
        connection.sendall(request)
        if not silent:
            # A server that has already hung up has answered, too.
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_WR)
        answer = b""
        while True:
            try:
                more = connection.recv(4096)
            except ConnectionResetError:
                return answer
            if not more:
                return answer
            answer += more


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET /nothing HTTP/1.1\r\n\r\n", b"404"),
        (b"POST / HTTP/1.0\r\n\r\n", b"405"),
        (b"\x16\x03\x01\x02\0\x01\r\n\r\n", b"400"),
        (b"x" * 20_000, b"400"),
        (b"GET / HTTP/1.0", b"400"),
        (b"", b""),
    ],
)
def test_requests_that_are_none(request_, status):
    with served(time_camera()) as addresses:
        try:
            assert status in ask(addresses["http"], request_)[:20]
        except ConnectionResetError:
            assert len(request_) > 8192  # it hung up on a request that does not end
        assert ages(addresses["http"], 3)[1] > 0


def test_clients_that_vanish_leave_nothing_behind():
    mock = time_camera()
    with served(mock) as addresses, nothing_left():
        address = urlsplit(addresses["http"])
        for number in range(12):
            connection = socket.create_connection((address.hostname, address.port))
            if number % 3:
                connection.sendall(b"GET / HTTP/1.0\r\n\r\n" if number % 3 == 1 else b"GET")
            if number % 2:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            wait(0.02)
            connection.close()
        assert ages(addresses["http"], 3)[1] > 0


def test_more_clients_than_it_serves_are_turned_away():
    with served(time_camera()) as addresses:
        address = urlsplit(addresses["http"])
        held = [socket.create_connection((address.hostname, address.port)) for _ in range(24)]
        wait(0.2)
        for connection in held:
            connection.close()
        assert until(lambda: _opens(addresses["http"]), 5)


def _opens(url):
    capture = cv2.VideoCapture(url)
    good = capture.isOpened()
    capture.release()
    return good


def test_a_port_in_use_is_reported_with_the_remedy():
    with served(time_camera()) as addresses:
        port = urlsplit(addresses["http"]).port
        other = time_camera(port=port)
        with pytest.raises(ConnectFailed, match="--port 0"):
            other.start()
        other.close()


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.4", "example.org", "", "::"])
def test_only_loopback(host):
    assert not is_loopback(host)
    with pytest.raises(ValueError, match="loopback"):
        CameraOptions(host=host)


def test_other_loopback_addresses_serve_too():
    with served(time_camera(host="127.0.0.3")) as addresses:
        assert ages(addresses["http"], 3)[1] > 0


@given(st.binary(max_size=200))
def test_no_request_is_too_odd(request):
    assert wish(request) in ("stream", "snapshot", "bad-request", "bad-method", "not-found")


def test_an_idle_camera_renders_nothing():
    class Counting:
        pictures = 0

        def picture(self, t_ns, seq, since_start):
            self.pictures += 1
            return np.full((48, 64, 3), 90, np.uint8)

        def close(self):
            pass

    mock = time_camera()
    view = mock._view = Counting()
    with served(mock) as addresses:
        wait(0.2)
        assert view.pictures == 0
        urllib.request.urlopen(addresses["snapshot"], timeout=5).close()
        assert view.pictures > 0


def test_the_first_pictures_of_a_stream_are_dark_and_red_for_each_new_reader():
    with served(gelsight(width=320, height=240, noise=0.0)) as addresses:
        for _ in range(2):
            capture = cv2.VideoCapture(addresses["http"])
            means = [capture.read()[1].mean(axis=(0, 1))[::-1] for _ in range(6)]
            capture.release()
            settled = means[-1]
            assert np.allclose(means[0] / settled, (0.87, 0.66, 0.66), atol=0.04)
            assert np.allclose(means[4] / settled, 1, atol=0.02)
            wait(0.25)


def test_a_torn_picture_is_whole_at_its_ends():
    image = np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)
    whole = encode(image, 90)
    half = torn(whole)
    assert half.startswith(b"\xff\xd8")
    assert half.endswith(b"\xff\xd9")
    assert len(half) < 0.7 * len(whole)


def test_a_process_serves_it_and_takes_faults():
    with MockProcess("gelsight-mini", {"port": 0, "scene": "rest"}) as mock:
        capture = cv2.VideoCapture(mock.addresses["http"])
        assert capture.read()[1].shape == (480, 640, 3)
        mock.inject("black-frame", for_s=1.0)
        assert any(capture.read()[1].max() < 30 for _ in itertools.repeat(0, 20))
        capture.release()
        assert not mock.complaints


def test_it_can_be_closed_while_a_client_is_being_accepted(monkeypatch):
    camera = time_camera()
    address = urlsplit(camera.start()["http"])
    starts, entered = threading.Thread.start, threading.Event()

    def late(thread):
        entered.set()
        CLOCK.sleep_until(CLOCK.now() + 200_000_000)
        starts(thread)

    monkeypatch.setattr(threading.Thread, "start", late)
    with socket.create_connection((address.hostname, address.port), 2.0):
        assert entered.wait(2.0)
        camera.close()
