"""A rendered RealSense recording through the vendor's own `rs.pipeline`, unmodified, and through our driver."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from camera_rig import HOST, markers, outcomes
from lsds_mocks.scene.stage import Stage
from lsds_mocks.wire.cameras.realsense import record

from lsds.clock import WallClock
from lsds.contracts import BuildContext
from lsds.contracts.plant_links import Scene
from lsds.errors import ConnectFailed

try:
    import pyrealsense2 as rs
except ImportError as error:  # libusb, or the extra, is not there
    pytest.skip(f"pyrealsense2 cannot be imported: {error}", allow_module_level=True)

FRAMES, RATE_HZ = 45, 60.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    stage = Stage(640, 480, [1])
    scenes = [Scene(0, 0.05 + 0.0005 * n, 0.0) for n in range(FRAMES)]
    images = [(round(n * 1e9 / RATE_HZ), stage.render(scene, scene, n)) for n, scene in enumerate(scenes)]
    path = tmp_path_factory.mktemp("realsense") / "truth.db3"
    assert record("test", str(path), stage.camera, RATE_HZ, images) == FRAMES
    return path, stage, [image for _, image in images]


def test_the_vendors_pipeline_plays_it(recording):
    path, stage, images = recording
    pipeline, config = rs.pipeline(), rs.config()
    config.enable_device_from_file(str(path), False)
    profile = pipeline.start(config)
    profile.get_device().as_playback().set_real_time(False)
    shown = {}
    while len(shown) < FRAMES - 5:
        good, frames = pipeline.try_wait_for_frames(1000)
        if not good:
            break
        colour = frames.get_color_frame()
        if colour:
            shown[colour.get_frame_number()] = np.array(colour.get_data())
        assert not frames.get_depth_frame() or abs(frames.get_depth_frame().get_distance(10, 10) - 0.45) < 1e-3
    intrinsics = profile.get_stream(rs.stream.color).as_video_stream_profile().intrinsics
    pipeline.stop()
    assert len(shown) > FRAMES * 0.6
    assert all(np.array_equal(image, images[number]) for number, image in shown.items())
    assert intrinsics.fx == pytest.approx(stage.camera.matrix[0, 0])
    assert intrinsics.coeffs == pytest.approx(stage.camera.distortion.tolist())


def test_the_pose_source_reads_it_with_its_own_intrinsics(recording):
    path, _, _ = recording
    options = {"camera": f"realsense:{path}", "markers": markers(), "skip_frames": 0}
    source = HOST.build("pose_source", "aruco", options, BuildContext(WallClock(), 0))
    source.connect()
    samples = [source.read()]
    with contextlib.suppress(EOFError):
        for _ in range(100):
            samples += outcomes(source, 0.05)[0]
    with pytest.raises(EOFError):
        source.read()
    source.close()
    seen = {sample.seq: sample.poses for sample in samples}
    assert len(seen) > 10
    assert all(set(poses) == {"gripper", "object"} for poses in seen.values())


def test_an_unplayable_file_is_reported(tmp_path):
    for camera in (f"realsense:{tmp_path / 'none.db3'}", "realsense:000000000000", "realsense"):
        options = {"camera": camera, "markers": markers(), "connect_timeout_s": 2.0}
        source = HOST.build("pose_source", "aruco", options, BuildContext(WallClock(), 0))
        with pytest.raises(ConnectFailed, match=r"rs-enumerate-devices|there are"):
            source.connect()
        source.close()
    with pytest.raises(ConnectFailed, match=r"\.db3"):
        record("test", str(tmp_path / "truth.bag"), Stage(640, 480, [1]).camera, 60.0, [])
