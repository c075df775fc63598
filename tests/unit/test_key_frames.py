"""Key frames of a codec are marked when read, but only if there are other frames between them."""

from __future__ import annotations

import cv2
import pytest
from lsds_plugins.replay.reader import open_reader
from lsds_plugins.replay.video import VideoOptions, VideoSensor
from tactile.render import pad_positions, render
from video_files import write_video

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.session.track import watch

COUNT = 30
DOTS = pad_positions()


@pytest.fixture(scope="module")
def frames():
    return [render(DOTS, seed=number % 5) for number in range(COUNT)]


@pytest.fixture(scope="module")
def clip(frames, tmp_path_factory):
    """A video of frames that are changes, with a whole one now and then."""
    return write_video(tmp_path_factory.mktemp("clip") / "clip.mp4", frames, codec="mp4v")


def whole_frames(path):
    """Numbers of the frames that the codec calls whole, asked for on its own."""
    capture, found = cv2.VideoCapture(str(path)), []
    while capture.grab():
        if int(capture.get(cv2.CAP_PROP_FRAME_TYPE)) == ord("I"):
            found.append(int(capture.get(cv2.CAP_PROP_POS_FRAMES)) - 1)
    capture.release()
    return found


def test_a_key_frame_after_frames_of_changes_is_redrawn_and_the_first_is_not(clip):
    whole = whole_frames(clip)
    assert whole[0] == 0
    assert 1 < len(whole) < COUNT / 2
    redrawn = [number for number, picture in enumerate(open_reader(str(clip)).images()) if picture.redrawn]
    assert redrawn == whole[1:]


def test_if_every_frame_is_whole_none_is_redrawn(frames, tmp_path):
    for name, codec in (("a.avi", "MJPG"), ("b.avi", "FFV1")):
        path = write_video(tmp_path / name, frames[:6], codec=codec)
        assert whole_frames(path) == list(range(6))
        assert not any(picture.redrawn for picture in open_reader(str(path)).images())
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number}.png"), frames[number])
    assert not any(picture.redrawn for picture in open_reader(str(tmp_path)).images())


def test_each_reading_begins_again(clip):
    reader = open_reader(str(clip))
    first, again = ([picture.redrawn for picture in reader.images()] for _ in range(2))
    assert first == again
    assert any(first)


@pytest.mark.parametrize("options", [{}, {"size": (160, 120)}])
def test_the_sensor_s_frames_say_so_at_any_size(clip, options):
    sensor = VideoSensor(VideoOptions(path=str(clip), **options), BuildContext(VirtualClock()))
    assert [frame.seq for frame in sensor.frames() if frame.redrawn] == whole_frames(clip)[1:]


def test_the_perception_s_frames_say_so_too_and_the_imprint_is_less_sure_of_them(clip):
    watched = {cycle.frame.seq: (cycle.observation.frame.redrawn, cycle.observation.imprint()) for cycle in watch(clip)}
    whole = whole_frames(clip)[1:]
    assert [number for number, (redrawn, _) in watched.items() if redrawn] == whole
    known = {number: motion.redrawn for number, (_, motion) in watched.items() if motion is not None}
    assert [number for number, redrawn in known.items() if redrawn] == [number for number in whole if number in known]
