"""Measure the arm's wire mock: `python -m tests.wire.ur.bench [--seconds N] [--json FILE]`.

Rates and arrival times are read by a client of our own, commands are given by ur_rtde. All figures are of the mock.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
import time
from pathlib import Path

from lsds_mocks.mock_process import MockProcess

from tests.wire.ur.arms import fresh_host
from tests.wire.ur.rtde_client import Client

NAMES = (
    "timestamp",
    "target_q",
    "target_qd",
    "target_qdd",
    "target_current",
    "target_moment",
    "actual_q",
    "actual_qd",
    "actual_current",
    "joint_control_output",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "target_TCP_pose",
    "target_TCP_speed",
    "actual_digital_input_bits",
    "joint_temperatures",
    "robot_mode",
    "joint_mode",
    "safety_mode",
    "speed_scaling",
    "target_speed_fraction",
    "runtime_state",
    "robot_status_bits",
    "safety_status_bits",
    "standard_analog_input0",
    "standard_analog_output0",
)


def quantiles(values, *shares):
    ordered = sorted(values)
    return [ordered[min(int(share * len(ordered)), len(ordered) - 1)] for share in shares]


def processor_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def stream(process, host, seconds):
    """Packages of 27 variables over a time: rate, losses, steps, gaps between arrivals, and what the mock needed."""
    with Client(host) as client:
        client.outputs(*NAMES)
        client.start()
        arrivals, stamps = [], []
        used, began = processor_s(process.pid), time.perf_counter()
        while time.perf_counter() - began < seconds:
            stamps.append(client.sample()["timestamp"])
            arrivals.append(time.perf_counter())
        used = processor_s(process.pid) - used
    gaps_ms = [1e3 * (b - a) for a, b in itertools.pairwise(arrivals)]
    steps = [b - a for a, b in itertools.pairwise(stamps)]
    p50, p99, p999, worst = quantiles(gaps_ms, 0.5, 0.99, 0.999, 1.0)
    return {
        "packages": len(stamps),
        "rate_hz": (len(arrivals) - 1) / (arrivals[-1] - arrivals[0]),
        "lost": sum(round(step / 0.002) - 1 for step in steps),
        "steps_exact": all(abs(step - 0.002) < 1e-9 for step in steps),
        "gap_ms": {"p50": p50, "p99": p99, "p99.9": p999, "max": worst},
        "core_share": used / (arrivals[-1] - began),
    }


def commands(process, host):
    """Measure the duration of ur_rtde's calls while its control program runs."""
    from rtde_control import RTDEControlInterface
    from rtde_receive import RTDEReceiveInterface

    began = time.perf_counter()
    receive = RTDEReceiveInterface(host)
    receiving, began = time.perf_counter() - began, time.perf_counter()
    control = RTDEControlInterface(host)
    controlling = time.perf_counter() - began
    blocking, moving = [], []
    for _ in range(200):
        began = time.perf_counter()
        control.setPayload(1.0, [0.0, 0.0, 0.01])
        blocking.append(1e3 * (time.perf_counter() - began))
    for number in range(40):
        began = time.perf_counter()
        control.speedJ([0.05 if number % 2 else -0.05, 0, 0, 0, 0, 0], 5.0, 0.002)
        while not receive.getActualQd()[0]:
            pass
        moving.append(1e3 * (time.perf_counter() - began))
        control.speedStop(20.0)
    used, began = processor_s(process.pid), time.perf_counter()
    time.sleep(3.0)
    share = (processor_s(process.pid) - used) / (time.perf_counter() - began)
    control.stopScript()
    control.disconnect()
    receive.disconnect()
    return {
        "construct_receive_ms": 1e3 * receiving,
        "construct_control_ms": 1e3 * controlling,
        "blocking_ms": dict(zip(("p50", "p95", "max"), quantiles(blocking, 0.5, 0.95, 1.0), strict=True)),
        "speed_to_motion_ms": dict(zip(("p50", "p95", "max"), quantiles(moving, 0.5, 0.95, 1.0), strict=True)),
        "core_share_with_program": share,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    with MockProcess("ur5e", {"host": fresh_host()}) as process:
        host = process.addresses["rtde"].partition(":")[0]
        result = {"figures_are": "of the mock", "load_average": os.getloadavg()[0]}
        result["stream"] = stream(process, host, arguments.seconds)
        result["commands"] = commands(process, host)
    text = json.dumps(result, indent=2)
    if arguments.json == "-":
        print(text)
    else:
        Path(arguments.json).write_text(text + "\n")


if __name__ == "__main__":
    sys.exit(main())
