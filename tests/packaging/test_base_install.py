"""The base install alone, without numba and matplotlib: recordings are tracked, and a hardware config comes up."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from lsds_mocks.mock_process import MockProcess

from tests.tactile.render import pad_positions, render
from tests.video_files import write_video

BARE = """
import sys
for name in ("numba", "llvmlite", "matplotlib"):
    sys.modules[name] = None  # as if they were not installed
"""


def bare(code, *arguments):
    """Run Python without the extras; return its exit code and output."""
    command = [sys.executable, "-c", BARE + code, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


LSDS = "from lsds.cli.main import main; sys.exit(main())"


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    frames = [render(pad_positions() + np.array([0.4 * i, 0.0]), seed=i) for i in range(6)]
    return write_video(tmp_path_factory.mktemp("clip") / "clip.avi", frames)


def test_a_recording_is_tracked_and_a_picture_is_one_line_with_the_remedy(clip, tmp_path):
    code, out, err = bare(LSDS, "track", str(clip), "--json", "-")
    assert code == 0, err
    assert json.loads(out)["frames"] == 6
    code, _, err = bare(LSDS, "track", str(clip), "--plot", str(tmp_path / "clip.png"))
    assert code == 3
    assert err.strip().endswith("pip install 'lsds-tactile[plot]'")
    assert "Traceback" not in err


def test_the_simulated_cell_is_one_line_with_the_remedy():
    code, _, err = bare(LSDS, "run", "--no-plot")
    assert code == 3
    assert err.count("\n") == 1
    assert "pip install 'lsds-tactile[sim]'" in err


RIG = """
import lsds
camera, port = sys.argv[1:]
config = ["sensor.backend=gelsight-mini", f"sensor.gelsight-mini.camera={camera}", "gripper.backend=hand-e",
          f"gripper.hand-e.port={port}", "arm.backend=none", "cell.backend=none"]
with lsds.Rig(lsds.load_config(None, config)) as rig:
    rig.arm_devices()
    clock = rig.clock
    for _ in range(300):
        clock.sleep_until(clock.now() + 10_000_000)
        try:
            frame, state = rig.sensor.read(), rig.gripper.read()
            break
        except lsds.LsdsError:
            continue
    print(frame.image.shape, round(state.aperture_m, 3))
"""


def test_a_hardware_config_comes_up_on_real_protocols():
    pytest.importorskip("pymodbus")
    camera = MockProcess("gelsight-mini", {"port": 0, "scene": "rest"})
    gripper = MockProcess("hand-e", {"tcp_port": 0, "urcap_port": -1, "activated": True})
    with camera, gripper:
        code, out, err = bare(RIG, camera.addresses["http"], gripper.addresses["tcp"])
    assert code == 0, err
    assert out.startswith("(240, 320, 3)")
