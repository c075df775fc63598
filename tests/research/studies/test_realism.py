"""Side by side with recordings: what is measured on known motion, and that a clip is a function of its seed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from lsds_research.studies.realism.camera import camera_row, camera_table
from lsds_research.studies.realism.clips import OBJECTS, draw
from lsds_research.studies.realism.film import film, write
from lsds_research.studies.realism.imprint import BANDS, MOTIONS, PLACES
from lsds_research.studies.realism.options import RealismOptions
from lsds_research.studies.realism.quantiles import inside, overlap, quantiles
from lsds_research.studies.realism.quantities import QUANTITIES, clip_samples
from lsds_research.studies.realism.study import find_videos

from lsds.cli.main import cli
from lsds.cli.track_session import track_one
from lsds.errors import DataError

CENTRE = np.array([159.5, 119.5])
DATA = Path(os.environ.get("LSDS_DATA", "")) / "incipient_slip" / "videos"
SHORT = RealismOptions(recordings="", clips=2, fidelity="winkler", least_frames=12, most_frames=14)


def painted(xy, hidden=()):
    """One image of dots at `xy` (N, 2), drawn to a sixteenth of a pixel."""
    image = np.full((240, 320, 3), (110, 125, 130), np.uint8)
    for number, centre in enumerate(xy):
        if number not in hidden:
            at = tuple(int(v) for v in np.rint(centre * 16))
            cv2.circle(image, at, 6 * 16, (30, 35, 38), -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(image, (0, 0), 0.9)


def samples_of(motion, tmp_path, hidden=()):
    """What is measured where dots of a 7 x 9 pad move by `motion(offset from the centre, frame)` px."""
    column, row = np.meshgrid(np.arange(9) - 4.0, np.arange(7) - 3.0)
    rest = np.stack([column.ravel(), row.ravel()], axis=1) * 32
    frames = [painted(CENTRE + rest + motion(rest, k), hidden if k else ()) for k in range(7)]
    path = tmp_path / "clip.avi"
    write(frames, path, "FFV1")
    return clip_samples(track_one(str(path), None, []))


def test_a_translation_is_travel_and_speed_and_nothing_else(tmp_path):
    found = samples_of(lambda rest, k: k * np.array([0.75, 1.0]), tmp_path)
    assert found["peak_speed_px"][0] == pytest.approx(1.25, abs=0.1)
    assert np.median(found["speed_px"]) == pytest.approx(1.25, abs=0.02)
    assert found["displacement_px"].max() == pytest.approx(7.5, abs=0.1)
    assert np.abs(found["divergence"]).max() < 1e-3
    assert np.abs(found["curl"]).max() < 1e-3
    assert found["clip_loss"][0] == 0


def test_an_expansion_is_divergence(tmp_path):
    found = samples_of(lambda rest, k: 0.005 * k * rest, tmp_path)
    assert found["divergence"][-1] == pytest.approx(2 * 0.03, rel=0.05)
    assert np.abs(found["curl"]).max() < 2e-3


def test_a_rotation_is_curl(tmp_path):
    found = samples_of(lambda rest, k: 0.005 * k * rest[:, ::-1] * [-1, 1], tmp_path)
    assert found["curl"][-1] == pytest.approx(2 * 0.03, rel=0.05)
    assert np.abs(found["divergence"]).max() < 2e-3


def test_hidden_dots_are_lost(tmp_path):
    found = samples_of(lambda rest, k: 0 * rest, tmp_path, hidden=(10, 20, 30, 40))
    assert found["clip_loss"][0] == pytest.approx(4 / 63)
    assert set(found) == {q.key for q in QUANTITIES}


def test_overlap_of_equal_disjoint_and_half_shared_samples():
    a = np.random.default_rng(0).normal(size=4000)
    b = np.random.default_rng(1).normal(size=3000)
    assert overlap(a, a) == pytest.approx(1)
    assert overlap(a, b) > 0.94
    assert overlap(a, b + 100) == 0
    assert overlap(a, np.concatenate([b, b + 100])) == pytest.approx(0.5, abs=0.05)
    assert inside(b, a) == pytest.approx(0.9, abs=0.03)
    assert inside(b + 100, a) == 0


def test_overlap_where_most_values_are_the_same():
    zeros = np.zeros(95)
    assert overlap(np.append(zeros, np.full(5, 0.1)), np.append(zeros, np.full(5, 0.3))) == pytest.approx(
        0.95, abs=0.06
    )
    assert overlap(np.zeros(50), np.zeros(70)) == 1
    assert overlap(np.zeros(50), np.ones(50)) == 0
    assert overlap(np.zeros(0), np.ones(50)) == 0
    assert quantiles(np.zeros(0))["p50"] is None


def test_every_object_has_its_turn_and_clips_differ():
    clips = [draw(SHORT, k) for k in range(len(OBJECTS))]
    assert {clip.cell["object"] for clip in clips} == set(OBJECTS)
    assert draw(SHORT, 3) == clips[3]
    assert len({clip.force_n for clip in clips}) > 1


def test_a_clip_is_the_same_bit_by_bit():
    clip = draw(SHORT, 0)
    first, again, other = film(clip, 5), film(clip, 5), film(clip, 6)
    assert len(first) == clip.frames
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[-1], other[-1])


def test_the_first_frame_is_untouched_unless_the_clip_begins_with_a_grip():
    clip = next(c for c in (draw(SHORT, k) for k in range(50)) if c.grip_s > 0)
    assert clip.hand_m_s(0.0) == 0
    assert clip.lift_s > clip.grip_s
    assert clip.hand_m_s(clip.release_s) == 0


def test_camera_figures_of_known_noise():
    rng = np.random.default_rng(0)
    still = [(120 + rng.normal(0, 2, (240, 320, 3))).round().astype(np.uint8) for _ in range(30)]
    still[0] = (still[0] * [0.87, 0.66, 0.66]).astype(np.uint8)
    row = camera_row(still)
    assert row["sigma_red"] == pytest.approx(2.0, abs=0.1)
    assert abs(row["lag1"]) < 0.05
    assert row["dim"] is True
    assert row["drift_levels"] is None
    assert camera_table([row])["dim_share"] == 1


def run(*arguments):
    return CliRunner().invoke(cli, ["chart", "realism", *arguments])


def test_a_folder_without_videos_is_one_clear_error(tmp_path):
    done = run("--recordings", str(tmp_path), "--plot", str(tmp_path / "r.png"))
    assert done.exit_code != 0
    assert "no videos there" in done.output + str(done.exception)
    with pytest.raises(DataError, match="there is no such folder"):
        find_videos(str(tmp_path / "none"), 0)


def test_a_video_that_cannot_be_read_is_named(tmp_path):
    (tmp_path / "broken.avi").write_bytes(b"no video at all")
    done = run("--recordings", str(tmp_path), "--clips", "1", "--plot", str(tmp_path / "r.png"))
    assert done.exit_code != 0
    said = done.output + str(done.exception)
    assert "broken.avi" in said
    assert "take it out of the folder" in said


@pytest.mark.skipif(
    "LSDS_DATA" not in os.environ or not DATA.is_dir(),
    reason="needs real recordings: set LSDS_DATA to a folder that holds incipient_slip/",
)
def test_chart_realism(tmp_path):
    plot, table, result = tmp_path / "r.png", tmp_path / "r.csv", tmp_path / "r.json"
    done = run(
        "--recordings",
        str(DATA),
        "--videos",
        "2",
        "--clips",
        "2",
        "--seed",
        "9",
        "--plot",
        str(plot),
        "--csv",
        str(table),
        "--json",
        str(result),
    )
    assert done.exit_code == 0, done.output
    assert "simulated: 2 clips" in done.output
    assert plot.stat().st_size > 10_000
    assert len(table.read_text().splitlines()) == 1 + 2 * len(QUANTITIES)
    found = json.loads(result.read_text())
    assert [row["of"] for row in found["camera"]] == ["real", "simulated"]
    assert {row["of"] for row in found["relief"]} == {"real", "simulated", "simulated, no grain"}
    assert len(found["relief"]) == 3 * (len(PLACES) * len(BANDS) + len(MOTIONS))
    assert all(0 <= row["overlap"] <= 1 for row in found["rows"] if row["of"] == "simulated")
