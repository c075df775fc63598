"""The sensor `video` and `lsds track`: good recordings give all their frames, bad ones one clear error."""

from __future__ import annotations

import json
import os
import re

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from lsds_plugins.replay.video import VideoOptions, VideoSensor

from lsds.calibration.sources import watched_recording
from lsds.cli.main import cli, main
from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.errors import DataError, StaleData
from lsds.registry import PluginHost
from lsds.session.track import track_recording
from lsds.tactile.feature_sets import FEATURE_SETS, NAMES
from tests.tactile.render import pad_positions, render
from tests.video_files import write_video

DOTS = pad_positions()


def moving(count=8, step=0.5):
    return [render(DOTS + np.array([step * i, 0.0]), seed=i) for i in range(count)]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return write_video(tmp_path_factory.mktemp("clip") / "clip.avi", moving())


def sensor(path, clock=None, **options):
    return VideoSensor(VideoOptions(path=str(path), **options), BuildContext(clock or VirtualClock()))


def track(path, *overrides):
    host = PluginHost()
    chosen = ["tactile.reference_frames=1", "sensor.backend=video", f'sensor.video.path="{path}"', *overrides]
    return track_recording(load_config(None, chosen, host=host), host)


# -- good recordings --------------------------------------------------------------------------------------


def test_frames_come_in_order_with_nominal_times(clip):
    frames = list(sensor(clip).frames())
    assert [f.seq for f in frames] == list(range(8))
    assert np.diff([f.t_ns for f in frames]).tolist() == [40_000_000] * 7
    assert all(np.array_equal(f.image, truth) for f, truth in zip(frames, moving(), strict=True))


def test_the_sensor_shows_each_frame_from_its_time_on_and_then_ends(clip):
    clock = VirtualClock(5_000_000_000)
    video = sensor(clip, clock)
    video.connect()
    seen = []

    def watch():
        while True:
            seen.append(video.read().seq)
            clock.sleep_until(clock.now() + 10_000_000)

    with pytest.raises(EOFError, match="ended after frame 7"):
        watch()
    assert sorted(set(seen)) == list(range(8))
    video.close()


def test_a_slow_reader_gets_the_newest_frame(clip):
    clock = VirtualClock()
    video = sensor(clip, clock)
    video.connect()
    clock.sleep_until(200_000_000)
    assert video.read().seq == 5


def test_a_folder_and_a_pattern_of_images(tmp_path):
    for i, image in enumerate(moving(4)):
        cv2.imwrite(str(tmp_path / f"{i:03}.png"), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    for source in (tmp_path, tmp_path / "*.png"):
        frames = list(sensor(source, rate_hz=10.0).frames())
        assert len(frames) == 4
        assert frames[3].t_ns == 300_000_000
        assert np.array_equal(frames[2].image, moving(4)[2])


@pytest.mark.parametrize(
    ("names", "times"),
    [
        (["f08.png", "f10.png", "f12.png", "f18.png", "f20.png"], [0, 1, 2, 5, 6]),
        (["f1.png", "f2.png", "f3.png", "f9.png", "g10.png"], [0, 1, 2, 3, 4]),
        (["1600.png", "1640.png", "1683.png", "1721.png", "1900.png"], [0, 1, 2, 3, 4]),
    ],
    ids=["numbers", "other names", "times"],
)
def test_a_gap_in_the_numbers_of_images_is_a_gap_in_time(tmp_path, names, times):
    for name, image in zip(names, moving(5), strict=True):
        cv2.imwrite(str(tmp_path / name), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    video = sensor(tmp_path)
    assert [frame.t_ns for frame in video.frames()] == [40_000_000 * time for time in times]
    assert any("2 images are missing" in note for note in video.notes) == (times[-1] == 6)


def test_times_from_a_list_and_from_the_file(clip, tmp_path):
    times = tmp_path / "times.txt"
    times.write_text("# seconds\n" + "\n".join(str(10 + 0.05 * i) for i in range(8)), encoding="utf-8")
    listed = [f.t_ns for f in sensor(clip, timestamps="list", times_file=str(times)).frames()]
    assert listed == [50_000_000 * i for i in range(8)]
    stored = [f.t_ns for f in sensor(clip, timestamps="file").frames()]
    assert np.allclose(np.diff(stored), 40_000_000, atol=1_000_000)


def test_velocities_follow_the_time_stamps(clip):
    fast = track(clip)
    slow = track(clip, "sensor.video.rate_hz=12.5")
    v_net = NAMES.index("v_net")
    quick, calm = (np.array(result.features)[1:, v_net] for result in (fast, slow))
    assert (quick > 0).all()
    assert np.allclose(quick, 2 * calm, rtol=1e-6)


def test_tracking_finds_the_motion(clip):
    result = track(clip)
    assert result.error is None
    assert result.reference.count == 63
    assert result.kept_fraction == [1.0] * 7
    moved = np.array([d.mean(axis=0) for d in result.displacement_m]) / result.metres_per_px
    assert np.allclose(moved[:, 0], 0.5 * np.arange(1, 8), atol=0.02)
    assert np.allclose(moved[:, 1], 0.0, atol=0.02)


def test_track_writes_its_results(clip, tmp_path):
    out, picture = tmp_path / "out.json", tmp_path / "out.png"
    done = CliRunner().invoke(cli, ["track", str(clip), "--json", str(out), "--plot", str(picture)])
    assert done.exit_code == 0, done.output
    data = json.loads(out.read_text())
    assert data["markers"] == 63
    assert len(data["per_frame"]["kept_fraction"]) == 7
    assert np.array(data["per_frame"]["displacement_m"]).shape == (7, 63, 2)
    assert len(data["features"]["v_net"]["values"]) == 7
    assert data["features"]["v_net"]["values"][0] is None, "the first velocity is undefined, not zero"
    assert cv2.imread(str(picture)).shape[0] > 400


def test_the_summary_lists_few_unusable_frames_and_verbose_all(tmp_path):
    dots = pad_positions()
    frames = [render(dots, seed=seed) for seed in range(3)] + [np.zeros_like(render(dots))] * 5
    write_video(tmp_path / "dark.avi", frames)
    short = CliRunner().invoke(cli, ["track", str(tmp_path / "dark.avi")]).output
    whole = CliRunner().invoke(cli, ["track", str(tmp_path / "dark.avi"), "--verbose"]).output
    assert len(re.findall(r"^  frame \d+ ", short, re.MULTILINE)) == 3
    assert re.search(r"^  2 more +listed with --verbose", short, re.MULTILINE)
    assert len(re.findall(r"^  frame \d+ ", whole, re.MULTILINE)) == 5
    assert "more" not in whole


def test_a_batch_goes_on_past_a_bad_recording(clip, tmp_path):
    (tmp_path / "good.avi").write_bytes(clip.read_bytes())
    (tmp_path / "empty.avi").write_bytes(b"")
    out = tmp_path / "all.json"
    code = main(["track", "--batch", str(tmp_path), "--json", str(out), "--jobs", "1"])
    data = json.loads(out.read_text())
    assert code == DataError.exit_code
    assert data["overview"]["recordings"] == 2
    assert data["overview"]["failed"] == 1
    errors = {r["source"].rpartition("/")[2]: r["error"] for r in data["recordings"]}
    assert errors["good.avi"] is None
    assert "empty" in errors["empty.avi"]


# -- bad ones ---------------------------------------------------------------------------------------------


def test_a_truncated_video_names_the_frame_and_keeps_the_earlier_ones(clip, tmp_path):
    cut = tmp_path / "cut.avi"
    cut.write_bytes(clip.read_bytes()[: int(clip.stat().st_size * 0.6)])
    result = track(cut)
    assert "cut.avi" in result.error
    assert "frame" in result.error
    assert result.reference is not None
    assert 0 < len(result.kept_fraction) < 7


def test_a_calibration_uses_the_frames_of_a_truncated_recording_and_warns(clip, tmp_path):
    broken = tmp_path / "broken.avi"
    broken.write_bytes(clip.read_bytes()[: len(clip.read_bytes()) * 6 // 10])
    warnings = []
    watched = watched_recording(str(broken), "load", None, (), {}, warnings.append)
    assert 0 < len(watched) < 7
    (line,) = warnings
    assert re.search(rf"broken.avi.*cannot be decoded.*the {len(watched)} frames before it are used", line)
    (tmp_path / "empty.avi").write_bytes(b"")
    with pytest.raises(DataError, match="the file is empty"):
        watched_recording(str(tmp_path / "empty.avi"), "load", None, (), {}, warnings.append)


def test_missing_empty_and_foreign_files(tmp_path):
    (tmp_path / "empty.avi").write_bytes(b"")
    (tmp_path / "text.avi").write_text("this is no video")
    (tmp_path / "nothing").mkdir()
    for name, words in (
        ("absent.avi", "no such file"),
        ("empty.avi", "empty"),
        ("text.avi", "not a video|cannot be decoded"),
        ("nothing", "no images"),
    ):
        with pytest.raises(DataError, match=words):
            list(sensor(tmp_path / name).frames())


def test_a_grey_video_is_refused_with_the_remedy(tmp_path):
    grey = [np.repeat(image[..., 1:2], 3, axis=2) for image in moving(3)]
    path = write_video(tmp_path / "grey.avi", grey)
    with pytest.raises(DataError, match=r"grey.*sensor\.video\.grey=true"):
        list(sensor(path).frames())
    assert len(list(sensor(path, grey=True).frames())) == 3


def test_a_reference_without_dots_is_an_error(tmp_path):
    plain = [render(np.empty((0, 2)), seed=i) for i in range(3)]
    result = track(write_video(tmp_path / "plain.avi", plain))
    assert "dots form a grid" in result.error
    assert "dis" in result.error


@pytest.mark.parametrize(("level", "word"), [(0, "black"), (255, "saturated")])
def test_an_unusable_frame_is_listed_and_passed_over(tmp_path, level, word):
    frames = moving(6)
    frames[3] = np.full_like(frames[3], level)
    result = track(write_video(tmp_path / "hurt.avi", frames))
    assert result.error is None
    assert len(result.kept_fraction) == 4
    [(number, reason)] = result.failures
    assert number == 3
    assert word in reason


def test_images_of_different_sizes(tmp_path):
    cv2.imwrite(str(tmp_path / "0.png"), moving(1)[0])
    cv2.imwrite(str(tmp_path / "1.png"), moving(1)[0][:200])
    with pytest.raises(DataError, match=r"1\.png: frame 1 is 320 x 200"):
        list(sensor(tmp_path).frames())


def test_times_that_do_not_increase_and_lists_that_end(clip, tmp_path):
    times = tmp_path / "times.txt"
    times.write_text("0\n0.04\n0.04\n", encoding="utf-8")
    with pytest.raises(DataError, match="frame 2 is stamped"):
        list(sensor(clip, timestamps="list", times_file=str(times)).frames())
    times.write_text("0\n0.04\n", encoding="utf-8")
    with pytest.raises(DataError, match="frame 2 has no time"):
        list(sensor(clip, timestamps="list", times_file=str(times)).frames())
    times.write_text("0\nsoon\n", encoding="utf-8")
    with pytest.raises(DataError, match="line 2: 'soon'"):
        list(sensor(clip, timestamps="list", times_file=str(times)).frames())


def test_reading_before_connecting_and_before_the_first_frame(clip):
    from lsds.errors import LifecycleError

    video = sensor(clip)
    with pytest.raises(LifecycleError):
        video.read()
    clock = VirtualClock(10)
    late = sensor(clip, clock)
    late.connect()
    clock._now = 0
    with pytest.raises(StaleData):
        late.read()


def test_run_reads_a_recording_through_the_same_loop(clip):
    from lsds.session.run import run as run_session

    overrides = [
        "tactile.reference_frames=1",
        "sensor.backend=video",
        f'sensor.video.path="{clip}"',
        "gripper.backend=none",
        "arm.backend=none",
    ]
    session = run_session(None, overrides)
    assert session.fault is None
    assert session.summary["outcome"] == "ended"
    assert session.summary["cycles"] == 7
    assert session.summary["figures_are"] == "measured"


def test_an_image_too_small_for_the_tracker_is_reported_and_does_not_stop_a_batch(clip, tmp_path):
    (tmp_path / "good.avi").write_bytes(clip.read_bytes())
    tiny = np.random.default_rng(0).integers(0, 255, (3, 16, 16, 3), np.uint8)
    write_video(tmp_path / "tiny.avi", list(tiny))
    out = tmp_path / "all.json"
    code = main(["track", "--batch", str(tmp_path), "--tracker", "dis", "--json", str(out), "--jobs", "1"])
    assert code == DataError.exit_code
    errors = {r["source"].rpartition("/")[2]: r["error"] for r in json.loads(out.read_text())["recordings"]}
    assert "16 x 16" in errors["tiny.avi"]
    assert errors["good.avi"] is None or "texture" in errors["good.avi"]


class Clumsy:
    """A tracker that trips over frame 3."""

    def __init__(self):
        from lsds_plugins.trackers.dotted.backends import lucas_kanade

        self._inner = lucas_kanade(None, None)
        self.start = self._inner.start

    def update(self, frame):
        if frame.seq == 3:
            raise IndexError("index 9 is out of bounds")
        return self._inner.update(frame)


def test_a_plugin_s_error_on_a_recording_is_reported_with_frame_and_reason(clip, monkeypatch):
    build = PluginHost.build

    def clumsy(host, kind, *rest):
        return Clumsy() if kind == "tracker" else build(host, kind, *rest)

    monkeypatch.setattr(PluginHost, "build", clumsy)
    result = track(clip)
    assert result.error.startswith(f"{clip}: tracker 'lk' raised IndexError at frame 3: index 9 is out of bounds")
    assert len(result.kept_fraction) == 2
    assert isinstance(result.cause, IndexError)
    assert main(["track", str(clip)]) == DataError.exit_code


def test_a_recording_that_takes_its_process_down_does_not_take_the_batch(clip, tmp_path, monkeypatch):
    from lsds.cli import track_session

    for name in ("a.avi", "deadly.avi", "z.avi"):
        (tmp_path / name).write_bytes(clip.read_bytes())
    spread = track_session.spread

    def deadly(work, sources, jobs):
        for source, found in spread(work, sources, 1):
            yield source, None if "deadly" in source else found

    monkeypatch.setattr(track_session, "spread", deadly)
    sources = track_session.find_videos([str(tmp_path)])
    errors = {r["source"]: r["error"] for r in track_session.track_many(sources, None, [], jobs=2)}
    assert sorted(errors) == sources
    assert [source for source, error in errors.items() if error] == [str(tmp_path / "deadly.avi")]


def test_odd_names_are_names(clip, tmp_path):
    for name in ("clip[1].avi", "clip \U0001f600 ü.avi", 'say "so".avi', "del\x7f.avi", "line\nbreak.avi", "1²2.avi"):
        (tmp_path / name).write_bytes(clip.read_bytes())
        assert main(["track", str(tmp_path / name)]) == 0, name


def test_a_name_that_is_no_text_is_refused_in_text(clip, tmp_path, capsys):
    """OpenCV crashes on such a name."""
    name = os.fsdecode(os.fsencode(tmp_path) + b"/latin\xfc.avi")
    with open(name, "wb") as file:
        file.write(clip.read_bytes())
    (tmp_path / "good.avi").write_bytes(clip.read_bytes())
    assert main(["track", name]) == DataError.exit_code
    assert r"latin\udcfc.avi: the name is not UTF-8 text (rename the file)" in capsys.readouterr().err
    out = tmp_path / "all.json"
    assert main(["track", "--batch", str(tmp_path), "--json", str(out), "--jobs", "1"]) == DataError.exit_code
    assert [r["error"] is None for r in json.loads(out.read_text())["recordings"]] == [True, False]


def test_a_raised_digit_in_an_images_name_is_no_number(tmp_path):
    for name in ("1²2.png", "1²10.png"):
        cv2.imwrite(str(tmp_path / name), moving(1)[0])
    assert len(list(sensor(tmp_path).frames())) == 2


def test_images_come_in_the_order_of_their_numbers(tmp_path):
    for i, image in enumerate(moving(12)):
        cv2.imwrite(str(tmp_path / f"frame{i}.png"), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    frames = list(sensor(tmp_path).frames())
    assert np.array_equal(frames[2].image, moving(3)[2])
    assert np.array_equal(frames[11].image, moving(12)[11])


def test_frames_are_all_counted_and_distances_are_distances(tmp_path):
    frames = [render(DOTS + np.array([0.6 * i, 0.8 * i]), seed=i) for i in range(6)]
    frames[3] = np.zeros_like(frames[3])
    summary = track(write_video(tmp_path / "slanted.avi", frames), "tactile.reference_frames=2").summary()
    assert summary["frames"] == 6
    assert len(summary["failures"]) == 1
    # The reference is the mean of the first two frames.
    assert summary["largest_displacement_px"] == pytest.approx(4.5, abs=0.1)


@pytest.mark.parametrize("times", [0.5, 2])
def test_speeds_and_distances_do_not_depend_on_the_size_of_the_video(clip, tmp_path, times):
    own = track(clip)
    images = [cv2.resize(image, None, fx=times, fy=times, interpolation=cv2.INTER_AREA) for image in moving()]
    other = track(write_video(tmp_path / "resized.avi", images))
    assert own.metres_per_px == pytest.approx(62.5e-6)
    assert own.notes == []
    assert "is assumed" in other.notes[0]
    largest = [result.summary()["largest_displacement_px"] for result in (own, other)]
    assert largest[1] == pytest.approx(largest[0], abs=0.1)
    for one, two in zip(own.displacement_m, other.displacement_m, strict=True):
        assert np.nanmedian(two[:, 0]) == pytest.approx(np.nanmedian(one[:, 0]), abs=3e-6)


def test_a_slow_recording_needs_no_option(tmp_path):
    """The age of frames matters to a cell that moves; a recording is read frame by frame."""
    result = track(write_video(tmp_path / "slow.avi", moving(), rate_hz=2.0))
    assert result.error is None
    assert result.t_s[-1] == pytest.approx(3.5)


def test_the_reason_why_no_frame_can_be_the_reference_is_reported(tmp_path):
    dark = [image * np.array([0, 1, 1], np.uint8) for image in moving()]
    assert (
        "none of 8 frames can be the reference; frame 0: the image has no red"
        in track(write_video(tmp_path / "dark.avi", dark)).error
    )
    black = [np.zeros_like(image) for image in moving()]
    assert "frame 0 is black" in track(write_video(tmp_path / "black.avi", black)).error


def test_a_video_that_is_turned_by_a_quarter_is_doubted(tmp_path):
    host = PluginHost()
    lit = host.build("sensor", "mock-gelsight-mini", {}, BuildContext(VirtualClock(), 0))
    lit.connect()
    lit._clock.sleep_until(500_000_000)
    image = lit.read().image
    upright, turned = ([np.ascontiguousarray(np.rot90(image, quarters))] * 6 for quarters in (0, 1))
    assert track(write_video(tmp_path / "upright.avi", upright)).notes == []
    assert "turn them back" in track(write_video(tmp_path / "turned.avi", turned)).notes[-1]


def test_dim_first_frames_are_no_reference_and_a_single_one_is_retaken_in_the_light(tmp_path):
    frames = moving(9, step=0.0)
    for i, gain in enumerate((0.4, 0.7, 0.9)):
        frames[i] = np.rint(frames[i] * gain).astype(np.uint8)
    dim = write_video(tmp_path / "dim.avi", frames)
    settled = track(dim, "tactile.reference_frames=2")
    assert settled.reference_frame.seq == 4
    assert len(settled.kept_fraction) == 4
    # From 0.4 to 0.7 is too much for a reference, from there on it is not.
    single = track(dim)
    assert single.reference_frame.seq == 1
    assert single.renewed == [1]
    never = track(dim, "tactile.reference_frames=7")
    assert "equally bright" in never.error
    assert never.frames == 9


def test_a_frame_saturated_in_the_colours_of_the_dots_is_unusable(tmp_path):
    frames = moving(4)
    frames[2] = frames[2].copy()
    frames[2][..., [0, 2]] = 255
    [(number, reason)] = track(write_video(tmp_path / "purple.avi", frames)).failures
    assert number == 2
    assert "saturated" in reason


@pytest.mark.parametrize("name", sorted(FEATURE_SETS))
def test_the_json_holds_the_named_features(clip, tmp_path, name):
    out = tmp_path / "out.json"
    assert main(["track", str(clip), "--features", name, "--json", str(out)]) == 0
    assert set(json.loads(out.read_text())["features"]) == set(FEATURE_SETS[name])


def test_features_are_for_one_recording_and_known(clip, capsys):
    assert main(["track", "--batch", str(clip.parent), "--features", "baseline"]) == 2
    assert "cannot be used with --batch" in capsys.readouterr().err
    assert main(["track", str(clip), "--features", "besaline"]) == 2
    assert "'baseline', 'proposed'" in capsys.readouterr().err
