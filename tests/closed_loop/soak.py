"""Long operation of one process: a job that grasps, lifts, lowers and releases repeatedly, and its cost."""

from __future__ import annotations

import ctypes
import gc
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import lsds
from lsds.contracts import Grip, Twist, Wanted
from lsds.session.run import run

OVERRIDES = ("cell.simulated.fidelity=winkler",)
ROUND_S = 6.0


class AgainJob:
    """Grasp, lift, lower and release, for `rounds` rounds; `each` is called at the end of each round."""

    def __init__(self, rounds, each):
        self.rounds, self.each = rounds, each

    def begin(self, setting):
        self.began = None
        self.ended = 0

    def step(self, now):
        if not now.referenced:
            return Wanted("look")
        self.began = now.t_ns if self.began is None else self.began
        ended, t = divmod((now.t_ns - self.began) / 1e9, ROUND_S)
        if ended > self.ended:
            self.ended = int(ended)
            self.each(self.ended)
        if t < 1.5:
            return Wanted("close", grip=Grip(0.0222, 0.05, 60.0), twist=Twist(), done=ended >= self.rounds)
        if t < 3.0:
            return Wanted("up", corrects=True, twist=Twist((0.0, 0.0, 0.03)))
        if t < 4.5:
            return Wanted("down", corrects=True, twist=Twist((0.0, 0.0, -0.03)))
        if t < 5.0:
            return Wanted("rest", twist=Twist())
        return Wanted("open", grip=Grip(0.035, 0.05, 60.0), twist=Twist())


class Look(NamedTuple):
    """The process after so many rounds or starts."""

    ended: int
    blocks: int
    resident_kb: int
    threads: int
    descriptors: int


def look(ended):
    gc.collect()
    return Look(ended, sys.getallocatedblocks(), memory_kb(), threading.active_count(), descriptors())


def children():
    """The processes that this one has started."""
    return {pid for listed in Path("/proc/self/task").glob("*/children") for pid in listed.read_text().split()}


def memory_kb():
    """The memory of this process that is resident now, kB."""
    fields = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(fields["VmRSS"].split()[0])


def descriptors():
    return len(list(Path("/proc/self/fd").iterdir()))


def operate(rounds, *overrides):
    """Run that many rounds in one run; return a look after each."""
    seen = []
    job = AgainJob(rounds, lambda ended: seen.append(look(ended)))
    with lsds.bring_up(overrides=[*OVERRIDES, *overrides], job=job) as engine:
        engine.run()
    return seen


def start_and_stop(times):
    """Bring up, run for a moment, close, that many times; return a look after each."""
    seen = []
    for ended in range(1, times + 1):
        with lsds.bring_up(overrides=[*OVERRIDES, "job.backend=watch"]) as engine:
            for at, _ in enumerate(engine):
                if at == 2:
                    break
        del engine
        seen.append(look(ended))
    return seen


class Visit(NamedTuple):
    """The process after a time of simulated operation, when every object was lifted once more."""

    after_s: float
    look: Look


def change_objects(names, least_s):
    """Lift the objects of the catalogue in turn, each on a new gel, for a simulated time; return a visit a round.

    The allocator returns its free pages before each look, so that the memory is what is in use.
    """
    seen = []
    after_s, gel = 0.0, 0
    while after_s < least_s:
        for name in names:
            gel += 1
            overrides = (f"cell.simulated.object={name}", f"sensor.mock-gelsight-mini.gel={gel}", f"seed={gel}")
            truths = run(None, overrides).truths
            after_s += (truths[-1].t_ns - truths[0].t_ns) / 1e9
            del truths
        gc.collect()
        ctypes.CDLL("libc.so.6").malloc_trim(0)
        seen.append(Visit(after_s, look(len(seen) + 1)))
    return seen
