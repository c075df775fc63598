"""The pieces of the camera drivers, one by one: times, numbers, JPEG, multipart, pictures, discovery, V4L2."""

from __future__ import annotations

import contextlib
import os

import cv2
import numpy as np
import pytest
from camera_rig import CLOCK, HOST, gelsight, outcomes, sensor, served
from hypothesis import given
from hypothesis import strategies as st
from lsds_drivers.cameras import v4l2
from lsds_drivers.cameras.address import make_source
from lsds_drivers.cameras.discovery import find_camera
from lsds_drivers.cameras.jpeg import decode, end_of, size
from lsds_drivers.cameras.multipart import PartReader
from lsds_drivers.cameras.picture import Crop, Picture
from lsds_drivers.cameras.source import whole
from lsds_drivers.cameras.times import ExposureTimes, FrameNumbers
from lsds_drivers.cameras.v4l2 import V4l2Source
from lsds_mocks.wire.cameras.gelsight_mini import enlarged
from lsds_mocks.wire.mjpeg.camera import encode, torn
from lsds_mocks.wire.mjpeg.newest import Picture as Shown
from lsds_mocks.wire.mjpeg.server import BOUNDARY, part

from lsds.contracts import BuildContext
from lsds.errors import ConnectFailed, DataError, LsdsError
from tests.wire.waiting import until

MS = 1_000_000
NOISE = np.random.default_rng(0).integers(60, 190, (240, 320, 3), np.uint8)
SMOOTH = np.asarray(cv2.GaussianBlur(NOISE, (0, 0), 4), np.uint8)
JPEG = encode(NOISE, 90)


# -- times and numbers ------------------------------------------------------------------------------------


def test_a_stamp_counts_only_where_it_can_be_of_this_clock():
    times = ExposureTimes("auto")
    assert times.of(5000 * MS, 4990 * MS) == 4990 * MS
    assert times.from_device
    assert times.of(5040 * MS, 1_700_000_000_000 * MS) == 5040 * MS  # wall-clock time of a network camera
    assert not times.from_device
    assert times.of(5080 * MS, 3000 * MS) == 5080 * MS  # two seconds old: of another clock
    assert times.of(5120 * MS, None) == 5120 * MS
    assert ExposureTimes("arrival", 0.01).of(5000 * MS, 4990 * MS) == 4990 * MS


@given(st.lists(st.tuples(st.integers(0, 10**6), st.one_of(st.none(), st.integers(-(10**6), 10**7))), max_size=30))
def test_times_only_go_up_and_never_lie_ahead(steps):
    times, now, last = ExposureTimes("auto"), 10**9, None
    for step, stamp in steps:
        now += step + 1
        t_ns = times.of(now, None if stamp is None else now - stamp)
        assert t_ns <= now
        assert last is None or t_ns > last
        last = t_ns


def test_numbers_have_gaps_where_pictures_were_lost_and_go_on_after_a_restart():
    numbers = FrameNumbers()
    assert [numbers.of(n) for n in (17, 18, 21)] == [0, 1, 4]
    numbers.restart()
    assert [numbers.of(n) for n in (0, 1)] == [5, 6]
    assert [numbers.of(None), numbers.of(None)] == [7, 8]
    assert numbers.of(3) == 9  # counted back without a word: a new series


# -- JPEG -------------------------------------------------------------------------------------------------


def test_a_jpeg_is_measured_and_ended_by_its_headers():
    assert size(JPEG) == (320, 240)
    assert end_of(JPEG) == len(JPEG)
    assert end_of(JPEG + JPEG) == len(JPEG)
    assert end_of(b"ab" + JPEG, 2) == len(JPEG) + 2
    for cut in (0, 1, 3, 20, 300, len(JPEG) // 2, len(JPEG) - 1):
        assert end_of(JPEG[:cut]) is None


@given(st.binary(max_size=400), st.integers(0, 600))
def test_no_bytes_bring_the_jpeg_reader_down(noise, cut):
    for data in (noise, JPEG[:cut] + noise, b"\xff\xd8" + noise + b"\xff\xd9"):
        for call in (end_of, size, lambda d: decode(d, whole)):
            with contextlib.suppress(DataError):
                call(data)


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (b"", "not a JPEG"),
        (JPEG[:-200], "no end"),
        (torn(JPEG), "torn"),
        (encode(np.zeros((240, 320, 3), np.uint8), 90), "black"),
        (JPEG[:2] + JPEG[-2:], "header"),
    ],
)
def test_the_defect_of_a_frame_is_reported(data, word):
    with pytest.raises(DataError, match=word):
        decode(data, whole)


@pytest.mark.parametrize("factor", [1, 2, 4, 8])
def test_decoding_smaller_keeps_the_picture(factor):
    large = np.asarray(cv2.resize(SMOOTH, (1280, 960), interpolation=cv2.INTER_CUBIC), np.uint8)
    large = np.clip(large + np.random.default_rng(1).normal(0, 1.5, large.shape), 0, 255).astype(np.uint8)
    small = decode(encode(large, 95), lambda width, height: factor)
    assert small.shape == (960 // factor, 1280 // factor, 3)
    wanted = cv2.resize(large, small.shape[1::-1], interpolation=cv2.INTER_AREA)
    assert np.abs(small.astype(float) - wanted).mean() < 3


# -- multipart --------------------------------------------------------------------------------------------


def reader(stream, sizes=(7, 1000, 3)):
    """A reader of bytes that come in odd portions."""
    at = [0, 0]

    def more():
        step = sizes[at[1] % len(sizes)]
        found = stream[at[0] : at[0] + step]
        at[0] += step
        at[1] += 1
        return found

    return PartReader("test", BOUNDARY, more, lambda: 0)


PARTS = [part(Shown(JPEG, n * MS, n)) for n in range(4)]
HEAD = f"--{BOUNDARY}\r\n".encode()


def bodies(stream, sizes=(7, 1000, 3)):
    """All that a reader gets of a stream: bodies, and DataError for damaged ones."""
    parts, found = reader(stream, sizes), []
    while True:
        try:
            found.append(parts.next().body)
        except DataError:
            found.append(DataError)
        except ConnectionError:
            return found


@given(st.lists(st.integers(1, 5000), min_size=1, max_size=5))
def test_parts_come_apart_however_the_bytes_arrive(sizes):
    assert bodies(HEAD + b"".join(PARTS), tuple(sizes)) == [JPEG] * 4


def test_a_part_cut_short_costs_itself_only():
    short = PARTS[1][: len(PARTS[1]) // 2]
    assert bodies(HEAD + PARTS[0] + short + HEAD + PARTS[2] + PARTS[3]) == [JPEG, DataError, JPEG, JPEG]


def test_without_a_length_the_boundary_ends_a_part():
    bare = b"Content-Type: image/jpeg\n\n" + JPEG + f"\r\n--{BOUNDARY}\r\n".encode()
    assert bodies(HEAD + bare + bare) == [JPEG, JPEG]


@given(st.integers(0, len(PARTS[0]) - 1), st.integers(0, 7))
def test_one_wrong_bit_costs_two_parts_at_most(place, bit):
    spoilt = bytearray(PARTS[1])
    spoilt[place] ^= 1 << bit
    found = bodies(HEAD + PARTS[0] + bytes(spoilt) + PARTS[2] + PARTS[3], (4096,))
    assert found[0] == JPEG
    assert found.count(JPEG) >= 2


@given(st.binary(max_size=3000))
def test_no_stream_brings_the_reader_down(noise):
    with contextlib.suppress(LsdsError):
        bodies(HEAD + noise + HEAD + noise)


# -- pictures ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("given_size", [(320, 240), (640, 480), (800, 600), (1640, 1232), (3280, 2464)])
def test_the_vendors_crop_gives_the_rendered_picture_back(given_size):
    picture = Picture(320, 240, Crop(border=0.0 if given_size == (320, 240) else 0.15))
    large = enlarged(SMOOTH, given_size)
    assert large.shape == (given_size[1], given_size[0], 3)
    back = picture.of(large)
    assert np.abs(back.astype(float) - SMOOTH).mean() < 0.6
    # Not moved by a fraction of a pixel, either: what is left over is not a gradient.
    shift, _ = cv2.phaseCorrelate(*(i[..., 1].astype(np.float64) for i in (SMOOTH, back)))
    assert np.abs(shift).max() < 0.05


def test_the_decoded_size_is_no_smaller_than_the_result_needs():
    picture = Picture(320, 240, Crop(border=0.15))
    assert [picture.reduction(w, h) for w, h in ((320, 240), (640, 480), (1640, 1232), (3280, 2464))] == [1, 1, 2, 4]
    assert Picture(240, 320, turn=270).reduction(640, 480) == 2
    assert Picture(320, 240, Crop(left=3)).reduction(3280, 2464) == 1


def test_cut_turn_flip_and_colours():
    image = np.zeros((64, 96, 3), np.uint8)
    image[:32, :48] = (200, 100, 50)  # upper left
    assert Picture(96, 64).of(image)[8, 8].tolist() == [200, 100, 50]
    assert Picture(64, 96, turn=90).of(image)[8, 56].tolist() == [200, 100, 50]
    assert Picture(96, 64, turn=180).of(image)[56, 88].tolist() == [200, 100, 50]
    assert Picture(64, 96, turn=270).of(image)[88, 8].tolist() == [200, 100, 50]
    assert Picture(96, 64, flip="horizontal").of(image)[8, 88].tolist() == [200, 100, 50]
    assert Picture(96, 64, flip="vertical").of(image)[56, 8].tolist() == [200, 100, 50]
    assert Picture(96, 64, swap_red_blue=True).of(image)[8, 8].tolist() == [50, 100, 200]
    assert Picture(48, 32, Crop(right=48, bottom=32)).of(image).min() == 50
    assert Picture(96, 64).of(image).base is None


def test_a_cropped_stream_is_distinguished():
    with served(gelsight(width=320, height=240)) as addresses:
        camera = sensor(addresses["http"], border=0.45, connect_timeout_s=0.6)
        with pytest.raises(ConnectFailed, match="crop less"):
            camera.connect()
        camera.close()


# -- which camera -----------------------------------------------------------------------------------------


@pytest.fixture
def by_id(tmp_path):
    folder = tmp_path / "by-id"
    folder.mkdir()
    for number, name in enumerate(["usb-GelSight_Mini_R0B_28AB-EFGH", "usb-Facebook_DIGIT_D20001", "usb-GelSight_X_2"]):
        node = tmp_path / f"video{2 * number}"
        node.write_bytes(b"")
        (folder / f"{name}-video-index0").symlink_to(node)
        (folder / f"{name}-video-index1").symlink_to(node)
    return folder


def test_a_camera_is_named_by_a_part_of_its_name(by_id):
    assert find_camera("test", "digit", by_id).endswith("D20001-video-index0")
    assert find_camera("test", "28AB-EFGH", by_id).endswith("EFGH-video-index0")
    assert find_camera("test", str(by_id.parent / "video0"), by_id).endswith("video0")


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ("RealSense", ["no camera's name holds 'RealSense'", "usb-Facebook_DIGIT_D20001-video-index0"]),
        ("GelSight", ["several cameras", "usb-GelSight_X_2-video-index0"]),
        ("97", ["there is no /dev/video97", "usb-GelSight_X_2-video-index0"]),
        ("/dev/nothing", ["there is no /dev/nothing"]),
    ],
)
def test_an_unknown_camera_lists_the_available_ones(by_id, wanted, words):
    with pytest.raises(ConnectFailed) as raised:
        find_camera("test", wanted, by_id)
    assert all(word in str(raised.value) for word in words)


def test_no_permission_names_the_group(by_id, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(ConnectFailed, match="usermod -aG video"):
        find_camera("test", "digit", by_id)


def test_without_any_camera_the_message_reports_that(tmp_path):
    with pytest.raises(ConnectFailed, match="holds no camera"):
        find_camera("test", "GelSight", tmp_path)
    camera = HOST.build("sensor", "gelsight-mini", {}, BuildContext(CLOCK, 0))
    with pytest.raises(ConnectFailed):
        camera.connect()
    camera.close()


@pytest.mark.parametrize(
    ("camera", "kind"),
    [
        ("0", "V4l2Source"),
        ("GelSight", "V4l2Source"),
        ("/dev/video0", "V4l2Source"),
        ("http://127.0.0.1:8080/?action=stream", "HttpSource"),
        ("rtsp://camera/stream", "OpenCvSource"),
        ("clip.mp4", "OpenCvSource"),
        ("realsense", "RealSenseSource"),
        ("realsense:834412070000", "RealSenseSource"),
    ],
)
def test_every_way_to_name_a_camera(camera, kind):
    assert type(make_source("test", camera)).__name__ == kind


# -- V4L2, with a capture that behaves as OpenCV's does ---------------------------------------------------


class FakeCapture:
    """Imitates OpenCV's V4L2 capture of a UVC camera: undecoded JPEG as one row, or decoded BGR."""

    def __init__(self, frames, opens=True, mjpg=True):
        self._frames = list(frames)
        self._opens = opens
        self._mjpg = mjpg
        self.settings = {}

    def isOpened(self):
        return self._opens

    def set(self, key, value):
        self.settings[key] = value
        return True

    def get(self, key):
        if key == cv2.CAP_PROP_FOURCC:
            return float(cv2.VideoWriter.fourcc(*("MJPG" if self._mjpg else "YUYV")))
        return (CLOCK.now() - 7 * MS) / 1e6 if key == cv2.CAP_PROP_POS_MSEC else 0.0

    def read(self):
        return (True, self._frames.pop(0)) if self._frames else (False, None)

    def release(self):
        self._opens = False


@pytest.fixture
def node(tmp_path):
    path = tmp_path / "video0"
    path.write_bytes(b"")
    return str(path)


def test_undecoded_jpeg_is_decoded_no_larger_than_needed(node):
    capture = FakeCapture([np.frombuffer(JPEG, np.uint8)[None]])
    source = V4l2Source("test", node, lambda width, height: 2, size=(3280, 2464), opener=lambda path: capture)
    source.open(1.0)
    shot = source.shot(1.0)
    assert shot.image.shape == (120, 160, 3)
    assert 0 <= shot.arrived_ns - shot.stamp_ns < 100 * MS
    assert capture.settings[cv2.CAP_PROP_FRAME_WIDTH] == 3280
    assert capture.settings[cv2.CAP_PROP_CONVERT_RGB] == 0
    with pytest.raises(ConnectFailed, match="stopped sending"):
        source.shot(1.0)
    source.close()


def test_raw_pictures_are_left_to_opencv(node):
    capture = FakeCapture([np.ascontiguousarray(NOISE[..., ::-1])], mjpg=False)
    source = V4l2Source("test", node, opener=lambda path: capture)
    source.open(1.0)
    assert np.array_equal(source.shot(1.0).image, NOISE)
    assert capture.settings[cv2.CAP_PROP_CONVERT_RGB] == 1
    source.close()


def test_a_camera_in_use_reports_how_to_find_its_user(node):
    source = V4l2Source("test", node, opener=lambda path: FakeCapture([], opens=False))
    with pytest.raises(ConnectFailed, match="fuser"):
        source.open(1.0)


def test_a_whole_sensor_on_v4l2(node, monkeypatch):
    frames = [encode(enlarged(np.roll(NOISE, n, axis=1), (640, 480)), 90) for n in range(30)]
    rows = [np.frombuffer(frame, np.uint8)[None] for frame in frames]
    monkeypatch.setattr(
        v4l2.V4l2Source.__init__, "__kwdefaults__", {"size": None, "opener": lambda p: FakeCapture(rows)}
    )
    camera = sensor(node, skip_frames=2)
    camera.connect()
    samples, _ = outcomes(camera, 0.1)
    assert samples
    assert samples[0].image.shape == (240, 320, 3)
    assert camera.times_from_device
    assert until(lambda: camera.lost > 0, 3)
    camera.close()
