"""Measure recordings: `python -m tests.recording.bench [--kills N] [--full N] [--hours H] [--pairs N] [--json FILE]`,
from the repository's root.

`--kills`: a process records two fingers at 25 Hz in real time, behind the queue of a run, and is killed (SIGKILL) at a
random moment; `--full`: its disk is full at a random moment (a limit of the file's size). The events that it published
and those of the file are compared one by one. `--hours`: the same events as fast as they can be written, on the
writer's own clock, and the memory of the process at moments of recorded time. `--pairs`: the pipe is lifted in real
time without and with a recording in turns, by two fingers in one process and by the wire rig; the time from image to
command, and the time that the loop spends on events.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from lsds.contracts import Cycle
from lsds.contracts.events import FramesRead
from lsds.errors import DataError
from lsds.runtime.engine import EVENTS
from lsds.runtime.observers import Observers
from lsds.session.recording import writer as writing
from lsds.session.recording.reader import Recording
from lsds.session.recording.writer import RecordingWriter
from lsds.session.run import run
from tests.recording.conftest import TWO_FINGERS
from tests.recording.doctor import examined
from tests.recording.feeding import keep_lap, laps, load_lap, time_of
from tests.wire.test_wire_rig import RIG, flags, lsds

ROOT = Path(__file__).resolve().parents[2]
LONGEST_S = 3.0
"""Longest time from the first event to the end of a process, s."""
LARGEST_BYTES = 12_000_000
"""Largest room on a full disk, bytes: what two fingers fill in two seconds."""
AT_ONCE = 2
"""Processes that record at the same time."""
MOMENTS_MIN = (1, 2, 5, 15, 30, 45, 60)
"""Moments at which the memory is read, minutes of recorded time."""


def feed(lap, path, log, room):
    """Record a lap again and again in real time; each event goes to the log when it has been published."""
    if room:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
    header, events = load_lap(lap)
    writer = RecordingWriter(path, header)
    observers = Observers(threaded=True, queue=EVENTS)
    observers.add("recording", writer.observe, writer.close)
    begin_ns, began_ns = time_of(events[0]), time.monotonic_ns()
    for event in laps(events):
        time.sleep(max(0, (time_of(event) - begin_ns - (time.monotonic_ns() - began_ns)) * 1e-9))
        observers.publish(event)
        if not isinstance(event, Cycle):
            # A pipe has no limit of size, and what was written to it outlives the process.
            os.write(log, f"{time_of(event)} {time.monotonic_ns()}\n".encode())
        if observers.statistics()[0].failure:
            return


def ended(folder, lap, images, number, full):
    """Return the loss in s of one process that ended at a random moment, and what is wrong with its file."""
    draw = random.Random(f"{'full' if full else 'kill'} {number}")
    path = folder / f"{'full' if full else 'kill'}-{number}.mcap"
    room = draw.randint(10_000, LARGEST_BYTES) if full else 0
    wait_s = draw.uniform(0, LONGEST_S)
    command = [sys.executable, "-m", "tests.recording.bench", "--feed", lap, path, "--room", room]
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, cwd=ROOT) as process:
        first = process.stdout.readline()
        if not full:
            time.sleep(wait_s)
            process.kill()
        ended_ns = time.monotonic_ns()
        lines = [first, *process.stdout]
    published = [tuple(map(int, line.split())) for line in lines if line.endswith(b"\n")]
    if full:
        ended_ns = published[-1][1]
    else:
        published = [each for each in published if each[1] <= ended_ns]
    try:
        stored = list(Recording(path).events())
        sick = examined(path).problems
    except DataError as error:
        # Killed before the first chunk: the header alone is in the file.
        return (ended_ns - published[0][1]) * 1e-9, str(error)
    finally:
        path.unlink()
    wrong = "" if all(map(matches, stored, published)) else "an event differs"
    wrong = wrong or same_images(stored, images) or "; ".join(sick)
    kept = len(stored)
    return max(0.0, (ended_ns - published[kept][1]) * 1e-9 if kept < len(published) else 0.0), wrong


def matches(event, published):
    return event.now_ns == published[0]


def same_images(stored, images):
    """Return which image differs from that of the lap, empty if none does."""
    for event in stored:
        for finger, frame in event.frames if isinstance(event, FramesRead) else ():
            if not np.array_equal(frame.image, images[finger, frame.seq % images["frames"]]):
                return f"frame {frame.seq} of {finger} differs"
    return ""


def campaign(folder, lap, events, count, full):
    """Return the figures of many ends."""
    frames = [each for event in events if isinstance(event, FramesRead) for each in event.frames]
    images = {(name, frame.seq): frame.image for name, frame in frames}
    images["frames"] = 1 + max(frame.seq for _, frame in frames)
    earlier = folder / "earlier.mcap"
    if not earlier.exists():
        RecordingWriter(earlier, load_lap(lap)[0]).close()
    before = hashlib.sha256(earlier.read_bytes()).hexdigest()
    with ThreadPoolExecutor(AT_ONCE) as pool:
        results = list(pool.map(partial(ended, folder, lap, images, full=full), range(count)))
    losses = [loss for loss, _ in results]
    return {
        "ends": count,
        "loss_max_s": max(losses),
        "loss_median_s": statistics.median(losses),
        "over_a_second": sum(loss > 1 for loss in losses),
        "damaged": [wrong for _, wrong in results if wrong],
        "earlier_untouched": hashlib.sha256(earlier.read_bytes()).hexdigest() == before,
    }


def long_run(folder, lap, hours, images):
    """Return the memory of this process (MB) by minutes of recorded time, and the size of the file."""
    header, events = load_lap(lap)
    begin_ns, rss = time_of(events[0]), {}
    now_ns = begin_ns
    # The writer writes a chunk each quarter of a second; its clock is that of the events, or there would be too few.
    writing.perf_ns = lambda: now_ns
    path = folder / "long.mcap"
    writer = RecordingWriter(path, header, images)
    moments = [minutes for minutes in MOMENTS_MIN if minutes < 60 * hours] + [round(60 * hours)]
    due = list(moments)
    for event in laps(events):
        now_ns = time_of(event)
        writer.observe(event)
        if now_ns - begin_ns >= due[0] * 60_000_000_000:
            rss[due.pop(0)] = rss_mb()
            if not due:
                break
    writer.close()
    return {"rss_mb": rss, "rss_after_close_mb": rss_mb(), "file_mb": path.stat().st_size * 1e-6, "images": images}


def pairs(folder, count):
    """Return the times from image to command without and with a recording in turns, and those of publishing."""
    found = {}
    for rig, lifted in (("two fingers in one process", cell_run), ("wire rig, seven processes", wire_run)):
        times = {"without": [], "with": []}
        extra = []
        for number in range(count):
            # Each is first in every second pair: of two equal runs with one seed, the first has shorter times.
            for kind, own in list(times.items())[:: (-1) ** number]:
                path = folder / f"{rig[:4]}-{kind}-{number}"
                path.mkdir()
                summary, more = lifted(path, number, path / "run.mcap" if kind == "with" else None)
                own.append(summary["frame_to_command_us"])
                if kind == "with":
                    extra.append({**more, "lost": summary["recording"]["lost"]})
        found[rig] = {
            f"{kind}_{name}_ms": [round(each[name] * 1e-3, 2) for each in own]
            for kind, own in times.items()
            for name in ("p50", "p99")
        } | {"recorder": extra}
    return found


def cell_run(folder, number, path):
    """Lift in the simulated cell in real time; return the summary, and the time that the loop spends on events."""
    spent = []
    publish = Observers.publish

    def timed(self, item, **flags):
        begin_ns = time.perf_counter_ns()
        publish(self, item, **flags)
        spent.append(time.perf_counter_ns() - begin_ns)

    with patch.object(Observers, "publish", timed):
        summary = run(None, [*TWO_FINGERS, "clock=wall", "task.hold_s=1", f"seed={number}"], record=path).summary
    return summary, {"loop_us_per_cycle": round(sum(spent) * 1e-3 / summary["cycles"], 1)}


def wire_run(folder, number, path):
    """Lift with real drivers on wire mocks, each in a separate process; return the summary."""
    extra = [] if path is None else ["--record", path]
    lift = lsds("run", RIG, *flags(folder), "--no-plot", "--json", folder / "run.json", "--seed", number, *extra)
    _, err = lift.communicate(timeout=120)
    assert lift.returncode in (0, 8), err
    summary = json.loads((folder / "run.json").read_text())
    return summary, {}


def rss_mb():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() * 1e-6


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--full", type=int, default=0)
    parser.add_argument("--hours", type=float, default=0)
    parser.add_argument("--pairs", type=int, default=0)
    parser.add_argument("--images", choices=["lossless", "jpeg"], default="jpeg", help="of --hours")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--feed", nargs=2, type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--room", type=int, default=0, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.feed:
        feed(*asked.feed, sys.stdout.fileno(), asked.room)
        return
    found = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lap = folder / "lap.pickle"
        keep_lap(lap)
        events = load_lap(lap)[1]
        for key, count in (("kills", asked.kills), ("full", asked.full)):
            if count:
                found[key] = campaign(folder, lap, events, count, key == "full")
        if asked.pairs:
            found["pairs"] = pairs(folder, asked.pairs)
        if asked.hours:
            del events
            found["hours"] = long_run(folder, lap, asked.hours, asked.images)
    text = json.dumps(found, indent=1)
    if asked.json:
        asked.json.write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
