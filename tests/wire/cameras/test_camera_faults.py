"""Every camera driver against every fault of its mock: errors that lsds can explain, no hang, nothing left behind."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
from urllib.parse import urlsplit

import pytest
from camera_rig import (
    CLOCK,
    aruco,
    calibration,
    gelsight,
    nothing_left,
    outcomes,
    sensor,
    served,
    truth_camera,
    until,
    wait,
)

from lsds.clock import seconds
from lsds.errors import ConfigError, ConnectFailed, DataError, DeviceError, StaleData

FAULTS = {
    "drop": {},
    "delay": {"delay_ms": 150.0},
    "corrupt": {},
    "truncate": {},
    "split": {"delay_ms": 15.0},
    "duplicate": {},
    "freeze": {},
    "disconnect": {},
    "black-frame": {},
    "torn-frame": {},
}
LASTS_S = 0.25
PATIENCE_S = 4.0
OF_THE_CAMERA = ("freeze", "black-frame", "torn-frame")


def fresh(device):
    """Whether a sample can be read that was taken just now."""
    try:
        return CLOCK.now() - device.read().t_ns < 200_000_000
    except (StaleData, DataError):
        return False


def survives(mock, device, kind):
    """Let a fault strike for a while; the device comes back."""
    device.connect()
    begin = CLOCK.now()
    mock.inject({"kind": kind, "for_s": LASTS_S, **FAULTS[kind]})
    samples, raised = outcomes(device, LASTS_S + 0.1)
    assert until(lambda: fresh(device), PATIENCE_S), f"{kind}: not back after {PATIENCE_S} s; said {raised}"
    numbers = [sample.seq for sample in samples]
    assert numbers == sorted(numbers)
    closing = CLOCK.now()
    device.close()
    assert seconds(CLOCK.now() - closing) < 2.5
    assert seconds(CLOCK.now() - begin) < PATIENCE_S + 4
    return raised


@pytest.fixture(scope="module")
def tactile():
    mock = gelsight()
    with served(mock) as addresses:
        yield mock, addresses["http"]


@pytest.fixture(scope="module")
def watching():
    mock = truth_camera(rate_hz=30.0)
    with served(mock) as addresses:
        yield mock, addresses["http"]


# All drivers read by the same pump: the first goes through every fault, the others through what they do with pictures.
@pytest.mark.parametrize(
    ("driver", "kind"),
    [*(("gelsight-mini", kind) for kind in FAULTS), ("uvc-tactile", "disconnect"), ("uvc-tactile", "torn-frame")],
)
def test_a_tactile_camera_over_http(tactile, driver, kind):
    mock, address = tactile
    with nothing_left():
        survives(mock, sensor(address, driver), kind)


@pytest.mark.parametrize("kind", ["disconnect", "corrupt", *OF_THE_CAMERA])
def test_the_pose_source(watching, kind, tmp_path):
    mock, address = watching
    with nothing_left():
        survives(mock, aruco(address, calibration(tmp_path)), kind)


@pytest.mark.parametrize("kind", OF_THE_CAMERA)
def test_a_tactile_camera_through_a_pipe(kind, tmp_path):
    mock = gelsight(pipe=str(tmp_path / "gel.mjpeg"))
    with served(mock) as addresses, nothing_left():
        survives(mock, sensor(addresses["pipe"]), kind)


@pytest.mark.parametrize(("kind", "word"), [("black-frame", "black"), ("torn-frame", "torn"), ("truncate", "short")])
def test_a_damaged_frame_is_reported_once_and_the_last_good_one_stays(kind, word):
    mock = gelsight()
    with served(mock) as addresses:
        camera = sensor(addresses["http"])
        camera.connect()
        before = camera.read()
        mock.inject({"kind": kind, "count": 1})
        samples, raised = outcomes(camera, 0.3)
        camera.close()
    assert [type(error) for error in raised] == [DataError]
    assert word in str(raised[0])
    assert "frame " in str(raised[0])
    assert samples[0].seq >= before.seq
    assert len(samples) > 3


def test_a_picture_that_stands_still_is_stale():
    mock = gelsight()
    with served(mock) as addresses:
        camera = sensor(addresses["http"], still_after_ms=150.0)
        camera.connect()
        mock.inject({"kind": "freeze", "for_s": 0.6})
        _, raised = outcomes(camera, 0.5)
        assert any("stood still" in str(error) for error in raised)
        assert until(lambda: fresh(camera), PATIENCE_S)
        camera.close()


def test_a_camera_that_went_away_is_stale_then_comes_back_with_later_numbers():
    mock = gelsight()
    with served(mock) as addresses:
        camera = sensor(addresses["http"], stale_after_ms=100.0)
        camera.connect()
        last = camera.read()
        mock.inject({"kind": "disconnect", "for_s": 0.4})
        _, raised = outcomes(camera, 0.4)
        assert any(isinstance(error, StaleData) for error in raised)
        assert until(lambda: fresh(camera), PATIENCE_S)
        assert camera.lost >= 1
        again = camera.read()
        assert again.seq > last.seq
        assert again.t_ns > last.t_ns
        camera.close()


def test_no_camera_at_the_address():
    with nothing_left():
        camera = sensor("http://127.0.0.1:9/stream")
        begin = CLOCK.now()
        with pytest.raises(ConnectFailed, match="camera on"):
            camera.connect()
        assert seconds(CLOCK.now() - begin) < 2
        camera.close()


def test_connecting_can_be_tried_again():
    mock = gelsight()
    address = mock.start()["http"]
    mock.close()
    with nothing_left():
        camera = sensor(address)
        with pytest.raises(ConnectFailed):
            camera.connect()
        with served(gelsight(port=urlsplit(address).port)):
            camera.connect()
            assert fresh(camera)
            camera.close()


def test_an_idle_camera_that_is_disconnected_refuses_for_as_long():
    mock = gelsight()
    with served(mock) as addresses:
        mock.inject({"kind": "disconnect", "for_s": 0.3})
        wait(0.1)
        camera = sensor(addresses["http"])
        with pytest.raises(ConnectFailed):
            camera.connect()
        wait(0.3)
        camera.connect()
        camera.close()


def answering(reply):
    """A server that answers every connection with the same bytes and then keeps silent."""
    listener = socket.create_server(("127.0.0.1", 0))
    held = []

    def run():
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            # Held before it is answered: who hangs up meanwhile must not keep it from being closed.
            held.append(connection)
            with contextlib.suppress(OSError):
                connection.settimeout(1.0)
                connection.recv(4096)
                connection.sendall(reply)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    address = f"http://127.0.0.1:{listener.getsockname()[1]}/"

    def close():
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(timeout=3.0)
        for connection in held:
            connection.close()

    return address, close


MULTIPART = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n"


@pytest.mark.parametrize(
    "reply",
    [
        b"",
        b"what?\r\n\r\n",
        b"HTTP/1.0 404 Not Found\r\n\r\n",
        b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<html>",
        b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n",
        MULTIPART,
        MULTIPART + b"--b\r\nContent-Length: 5\r\n\r\nhello\r\n--b\r\n",
        MULTIPART + b"--b\r\nContent-Type: text/plain\r\n\r\nhello\r\n--b\r\n",
        MULTIPART + b"\0" * 100_000,
    ],
    ids=["silence", "no-http", "404", "page", "no-boundary", "nothing", "no-jpeg", "text", "zeros"],
)
def test_something_else_than_a_camera(reply):
    with nothing_left():
        url, close = answering(reply)
        try:
            camera = sensor(url, connect_timeout_s=0.4)
            begin = CLOCK.now()
            with pytest.raises(ConnectFailed):
                camera.connect()
            camera.close()
            assert seconds(CLOCK.now() - begin) < 3.5
        finally:
            close()


def test_an_unknown_fault_is_refused():
    mock = gelsight()
    with pytest.raises(ConfigError, match="black-frame"):
        mock.inject({"kind": "crc"})
    mock.close()


def test_a_pipe_without_a_writer(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with nothing_left():
        camera = sensor(str(path), connect_timeout_s=0.3)
        with pytest.raises(ConnectFailed, match="who writes"):
            camera.connect()
        camera.close()


def test_every_error_names_the_device():
    with pytest.raises(DeviceError, match="gelsight-mini"):
        sensor("http://[bad").connect()
