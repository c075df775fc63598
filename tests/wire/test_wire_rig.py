"""The whole job over the wire: every real driver on every wire mock, around one plant, in real time."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lsds.config import load_config
from lsds.errors import ConfigError
from lsds.runtime.rig import Rig
from tests.wire.ur.arms import fresh_host

pytest.importorskip("rtde_control")
pytest.importorskip("pymodbus")

RIG = Path(__file__).resolve().parents[2] / "examples" / "rigs" / "wire.toml"


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def overrides(folder):
    """Addresses used only by this test, so that parallel runs do not collide."""
    host, port, truth_port = fresh_host(), free_port(), free_port()
    tty, calibration = folder / "hand.tty", folder / "truth.json"
    return [
        f"arm.ur5e.host={host}",
        f"cell.wire.mocks.ur5e.host={host}",
        f"gripper.hand-e.port={tty}",
        f"cell.wire.mocks.hand-e.pty={tty}",
        "cell.wire.mocks.hand-e.tcp_port=-1",
        "cell.wire.mocks.hand-e.urcap_port=-1",
        f"sensor.gelsight-mini.camera=http://127.0.0.1:{port}/?action=stream",
        f"cell.wire.mocks.gelsight-mini.port={port}",
        f"pose_source.aruco.camera=http://127.0.0.1:{truth_port}/?action=stream",
        f"pose_source.aruco.calibration={calibration}",
        f"cell.wire.mocks.truth-camera.port={truth_port}",
        f"cell.wire.mocks.truth-camera.calibration={calibration}",
        f"cell.wire.socket={folder / 'plant.sock'}",
        # Seven processes share two cores with a test run, so these limits are wider than in a cell.
        "safety.stale_after_s=1.5",
        "safety.watchdog_s=3.0",
        "safety.frozen_after_s=3.0",
        "safety.command_lifetime_s=0.5",
        "arm.ur5e.stale_after_ms=1000.0",
        "arm.ur5e.watchdog_hz=2.0",
        "gripper.hand-e.stale_after_ms=1000.0",
        # Long enough to slip and to be caught.
        "task.lift_s=1.5",
        "task.hold_s=0.3",
    ]


def lsds(*arguments, **keywords):
    command = [sys.executable, "-m", "lsds.cli.main", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **keywords)


def flags(folder):
    return [part for override in overrides(folder) for part in ("--set", override)]


def children_of(pid):
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(line) for line in listed.stdout.split()]


def test_a_recorded_run_over_the_wire_replays_bit_by_bit(tmp_path):
    pytest.importorskip("mcap")
    path = tmp_path / "run.mcap"
    run = lsds("run", RIG, *flags(tmp_path), "--no-plot", "--record", path, "--seed", 4)
    out, err = run.communicate(timeout=120)
    assert run.returncode == 0, out + err
    assert "warning" not in err
    again = lsds("replay", path, "--json", tmp_path / "replay.json")
    out, err = again.communicate(timeout=120)
    assert again.returncode == 0, out + err
    found = json.loads((tmp_path / "replay.json").read_text())
    assert found["identical"]
    assert found["cycles"] > 50


def test_a_run_starts_everything_holds_the_pipe_and_ends_everything(tmp_path):
    run = lsds("run", RIG, *flags(tmp_path), "--no-plot", "--json", tmp_path / "run.json", "--seed", 3)
    children = []
    deadline = time.monotonic() + 30
    while len(children) < 6 and time.monotonic() < deadline:
        children = children_of(run.pid)
        time.sleep(0.1)
    out, err = run.communicate(timeout=90)
    assert run.returncode == 0, out + err
    summary = json.loads((tmp_path / "run.json").read_text())
    assert summary["outcome"] == "held"
    assert summary["figures_are"] == "simulated"
    assert summary["frame_to_command_us"]["p50"] > 0
    assert 0 < summary["slip_distance_m"] < 0.02
    # The camera sees the gel's creep, too, which is no slip yet.
    assert summary["seen_slip_distance_m"] == pytest.approx(summary["slip_distance_m"], abs=0.003)
    assert summary["corrections"] > 0
    # Plant, gripper, arm, two cameras, and the arm's driver.
    assert len(children) == 6
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    assert list(tmp_path.glob("*.tty")) == []
    assert not (tmp_path / "plant.sock").exists()


def test_a_run_joins_mocks_that_already_serve_and_leaves_them_serving(tmp_path):
    common = flags(tmp_path)
    served = lsds("mock", "rig", RIG, *common, "--json")
    try:
        ready = json.loads(served.stdout.readline())
        assert set(ready["addresses"]) == {"plant", "hand-e", "ur5e", "gelsight-mini", "truth-camera"}
        # The second one finds the pipe in the grip of the first, lifted: it is put back for it.
        for _ in range(2):
            run = lsds("run", RIG, *common, "--no-plot", "--json", "-")
            out, err = run.communicate(timeout=90)
            assert run.returncode == 0, out + err
            summary = json.loads(out)
            # The need grows with the arm's jerks where commands come late.
            assert (summary["outcome"], summary["required_normal_force_n"] < 8) == ("held", True)
            assert served.poll() is None
    finally:
        served.send_signal(signal.SIGINT)
        served.communicate(timeout=20)
    assert served.returncode == 0


def test_ctrl_c_stops_the_cell_and_ends_the_mocks(tmp_path):
    run = lsds("run", RIG, *flags(tmp_path), "--no-plot")
    deadline = time.monotonic() + 30
    while not (tmp_path / "plant.sock").exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    children = []
    while len(children) < 6:
        assert time.monotonic() < deadline
        time.sleep(0.05)
        children = children_of(run.pid)
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=30)
    assert run.returncode != 0
    # A child that was just being started ends by itself, as soon as it sees that its parent has gone.
    deadline = time.monotonic() + 15
    while left := [pid for pid in children if Path(f"/proc/{pid}").exists()]:
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


def test_a_cell_on_the_wire_refuses_devices_that_would_live_in_another():
    with pytest.raises(ConfigError, match=r"cell\.backend.*mock-ur5e would live in another cell"):
        Rig(load_config(RIG, ["arm.backend=mock-ur5e"]))


def test_errors_of_a_mocks_table_are_reported_as_for_any_option():
    changes = ["cell.wire.mocks.hand-e.latncy_ms=3", "cell.wire.mocks.ur5e.model=ur7"]
    with pytest.raises(ConfigError) as caught:
        Rig(load_config(RIG, changes))
    assert "cell.wire.mocks.hand-e.latncy_ms: unknown key (did you mean 'latency_ms'?)" in str(caught.value)
    assert "cell.wire.mocks.ur5e.model: 'ur7' is not allowed (did you mean 'ur5e'?" in str(caught.value)


def test_a_missing_mock_is_one_tree_of_results(tmp_path):
    arguments = [*flags(tmp_path), "--set", "cell.wire.mocks.ur5e.host=192.0.2.7"]
    run = lsds("run", RIG, *arguments, "--no-plot", env={**os.environ})
    _, err = run.communicate(timeout=60)
    assert run.returncode == 4
    assert "not an address of the loopback interface" in err
    assert "Traceback" not in err
