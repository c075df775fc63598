"""Round trips, strokes and load of the Robotiq mock and drivers, measured: `python tests/wire/robotiq/bench.py`.

Figures are of the mock, which emulates a line at 115200 baud and a turnaround of 3.5 ms, and of this machine.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.wire.robotiq.rig import CLOCK, build, options_for, serving, to  # noqa: E402

TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def quantiles_ms(times_s):
    ordered = sorted(times_s)
    return {
        f"p{share}": round(1e3 * ordered[min(len(ordered) - 1, len(ordered) * share // 100)], 3)
        for share in (50, 95, 99)
    }


def timed(call, n):
    times = []
    for _ in range(n):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return quantiles_ms(times)


def cpu_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def raw_serial(mock):
    import serial

    request = bytes.fromhex("09 04 07 D0 00 03 B1 CE")
    with serial.Serial(mock.addresses["pty"], 115200, timeout=1) as line:

        def ask():
            line.write(request)
            assert len(line.read(11)) == 11

        return timed(ask, 400)


def strings(mock):
    host, port = mock.addresses["urcap"].split(":")
    with socket.create_connection((host, int(port))) as client:

        def ask():
            client.sendall(b"GET POS\n")
            client.recv(100)

        return timed(ask, 2000)


def third_party(mock):
    import pyrobotiqgripper

    found = {}
    start = time.perf_counter()
    client = pyrobotiqgripper.RobotiqGripper(com_port=mock.addresses["pty"])
    found["connect_ms"] = round(1e3 * (time.perf_counter() - start), 1)
    start = time.perf_counter()
    client.activate()
    found["activate_s"] = round(time.perf_counter() - start, 3)
    found["status_ms"] = timed(client.readStatus, 400)
    for speed in (255, 128, 0):
        client.open()
        start = time.perf_counter()
        client.close(speed=speed)
        found[f"close_at_{speed}_s"] = round(time.perf_counter() - start, 3)
    client.open()
    client.disconnect()
    return found


def strokes(gripper):
    """Each stroke's time and its error against 50 mm over speed, from commands to states."""
    found = {}
    for speed in (0.020, 0.085, 0.150):
        gripper.command(to(0.05, within_s=5))
        while gripper.read().moving or gripper.read().aperture_m < 0.0499:
            time.sleep(0.002)
        sent = gripper.command(to(0.0, speed_m_s=speed, within_s=5))
        start = last = None
        while last is None:
            state = gripper.read()
            if start is None and state.aperture_m < 0.0499:
                start = state.t_ns
            if state.aperture_m <= 0:
                last = state.t_ns
            time.sleep(0.001)
        taken, wanted = (last - start) * 1e-9, 0.05 / sent.speed_m_s
        found[f"{1e3 * sent.speed_m_s:.0f}_mm_s"] = {"s": round(taken, 3), "error": round(taken / wanted - 1, 3)}
    return found


def driver(name, mock):
    gripper = build(name, options_for(name, mock))
    start = time.perf_counter()
    gripper.connect()
    found = {"connect_ms": round(1e3 * (time.perf_counter() - start), 1)}
    gripper.arm()
    found["read_us"] = {k: round(1e3 * v, 1) for k, v in timed(gripper.read, 2000).items()}
    found["command_us"] = {k: round(1e3 * v, 1) for k, v in timed(lambda: gripper.command(to(0.05)), 500).items()}
    latencies, ages = [], []
    for i in range(60):
        target = gripper.command(to(0.045 if i % 2 else 0.044)).aperture_m
        start = CLOCK.now()
        while abs(gripper.read().target_m - target) > 1e-6:
            time.sleep(0.0003)
        latencies.append((CLOCK.now() - start) * 1e-9)
        ages.append((CLOCK.now() - gripper.read().t_ns) * 1e-9)
        time.sleep(0.013 + 0.0007 * (i % 7))
    found["command_to_echo_ms"], found["age_of_state_ms"] = quantiles_ms(latencies), quantiles_ms(ages)
    found["stop_ms"] = timed(gripper.stop, 40)
    found["strokes"] = strokes(gripper)
    before, start, cpu, mock_cpu = gripper.counts.requests, time.perf_counter(), cpu_s("self"), cpu_s(mock.pid)
    time.sleep(3)
    took = time.perf_counter() - start
    found["requests_per_s"] = round((gripper.counts.requests - before) / took, 1)
    found["driver_cpu_percent"] = round(100 * (cpu_s("self") - cpu) / took, 1)
    found["mock_cpu_percent"] = round(100 * (cpu_s(mock.pid) - mock_cpu) / took, 1)
    start = time.perf_counter()
    gripper.close()
    found["close_ms"] = round(1e3 * (time.perf_counter() - start), 1)
    return found


def measure():
    found = {}
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder)) as mock:
        start, cpu = time.perf_counter(), cpu_s(mock.pid)
        time.sleep(2)
        found["mock_idle_cpu_percent"] = round(100 * (cpu_s(mock.pid) - cpu) / (time.perf_counter() - start), 1)
        found["serial_round_trip_ms"] = raw_serial(mock)
        found["urcap_get_ms"] = strings(mock)
        found["pyrobotiqgripper"] = third_party(mock)
        for name in ("hand-e", "hand-e-tcp", "hand-e-urcap"):
            found[name] = driver(name, mock)
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder), baud=0, turnaround_ms=0.0) as mock:
        found["serial_round_trip_without_line_ms"] = raw_serial(mock)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", metavar="FILE", help="write the figures there; - for standard output")
    arguments = parser.parse_args()
    found = measure()
    if arguments.json and arguments.json != "-":
        Path(arguments.json).write_text(json.dumps(found, indent=2) + "\n")
    elif arguments.json:
        print(json.dumps(found, indent=2))
    else:
        show(found)


def show(found, indent=""):
    for key, value in found.items():
        if isinstance(value, dict) and any(isinstance(v, dict) for v in value.values()):
            print(f"{indent}{key}")
            show(value, indent + "  ")
        else:
            text = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else value
            print(f"{indent}{key:32} {text}")


if __name__ == "__main__":
    main()
