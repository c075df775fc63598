"""The gripper lifts: in the simulated cell, and over TCP with its wire mock on the plant of a rig."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import lsds
import pytest

RIG = Path(__file__).resolve().parents[1] / "rig.toml"


@pytest.mark.parametrize("seed", [0, 5])
def test_a_simulated_lift_holds(seed: int) -> None:
    session = lsds.run(overrides=["gripper.backend=mock-onrobot-rg2", "task.lift_s=1.0", f"seed={seed}"])
    assert session.fault is None
    assert session.summary["outcome"] == "held"


def test_a_lift_over_tcp_holds(tmp_path: Path) -> None:
    pytest.importorskip("rtde_control", reason="the arm's driver needs ur_rtde: pip install 'lsds-tactile[ur]'")
    box, camera = free_port(), free_port()
    arm = f"127.{64 + os.getpid() % 128}.{os.getpid() // 128 % 250 + 1}.9"
    overrides = [
        f"gripper.onrobot-rg2.port={box}",
        f"cell.wire.mocks.onrobot-rg2.port={box}",
        f"sensor.gelsight-mini.camera=http://127.0.0.1:{camera}/?action=stream",
        f"cell.wire.mocks.gelsight-mini.port={camera}",
        f"arm.ur5e.host={arm}",
        f"cell.wire.mocks.ur5e.host={arm}",
        f"cell.wire.socket={tmp_path / 'plant.sock'}",
        # Five processes share the cores with a test run, so these limits are wider than in a cell.
        "safety.stale_after_s=1.5",
        "safety.watchdog_s=3.0",
        "safety.frozen_after_s=3.0",
        "safety.command_lifetime_s=0.5",
        "arm.ur5e.stale_after_ms=1000.0",
        "arm.ur5e.watchdog_hz=2.0",
        "gripper.onrobot-rg2.stale_after_ms=1000.0",
        "gripper.onrobot-rg2.timeout_s=0.2",
        "task.lift_s=1.5",
        "task.hold_s=0.3",
    ]
    result = tmp_path / "run.json"
    sets = [part for override in overrides for part in ("--set", override)]
    command = [sys.executable, "-m", "lsds.cli.main", "run", str(RIG), "--no-plot", "--json", str(result), *sets]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads(result.read_text())
    assert summary["outcome"] == "held"
    assert summary["figures_are"] == "simulated"


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])
