"""The examples run unchanged, each in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def run(script, folder, *arguments):
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / script), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.usefixtures("installed_host")
def test_a_job_in_ten_lines(tmp_path):
    assert "held after" in run("job.py", tmp_path)
    assert (tmp_path / "job.png").stat().st_size > 10_000


@pytest.mark.usefixtures("installed_host")
def test_a_reflex_next_to_an_arm_program(tmp_path):
    printed = run("reflex.py", tmp_path)
    assert "slip, the grip closes to" in printed
    assert printed.rstrip().endswith("released")


def test_an_own_detector_on_a_recording(tmp_path):
    import numpy as np

    from tests.tactile.render import pad_positions, render
    from tests.video_files import write_video

    dots = pad_positions()
    frames = [render(dots + np.array([0.4 * i, 0.0]), seed=i) for i in range(6)]
    write_video(tmp_path / "clip.avi", frames)
    assert run("own_detector.py", tmp_path, "clip.avi").startswith("5 frames: own rule")


def test_fingertips_in_mujoco(tmp_path):
    pytest.importorskip("mujoco")
    assert len((ROOT / "examples" / "mujoco_pipe.py").read_text().splitlines()) <= 15
    pressed, lifted, weaker, lost, image = run("mujoco_pipe.py", tmp_path).splitlines()
    # Half the weight of 0.3 kg is 1.47 N.
    assert lifted == "6.0 N hold 1.47 N, slip 0.0000 m"
    assert weaker == "4.0 N hold 1.47 N, slip 0.0000 m"
    assert pressed.endswith("slip 0.0000 m")
    assert float(lost.split()[-2]) > 0.01
    assert image == "the last image: (240, 320, 3)"


def test_fingertips_in_a_scene_of_your_own(tmp_path):
    pytest.importorskip("mujoco")
    _, *lines = (ROOT / "examples" / "mujoco_own_scene.py").read_text().splitlines()
    assert sum(bool(line) for line in lines) <= 15
    # The hand rises by 10 mm; a pad carries half the weight of 0.2 kg.
    assert run("mujoco_own_scene.py", tmp_path) == "height 0.060 m, load along y 0.98 N\n"


def test_no_example_is_left_out():
    assert {path.name for path in EXAMPLES} == {
        "job.py",
        "reflex.py",
        "own_detector.py",
        "mujoco_pipe.py",
        "mujoco_own_scene.py",
    }
