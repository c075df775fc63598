"""Time shear steps with both solvers of friction contact.

OMP_NUM_THREADS=1 python tests/mocks/gel/bench_spectral.py [--large]

One line a scene: cells looked after, cells of the rectangle around them, medians over steps of 0.05 mm, there and half
the way back, of blocks and of descent taken in turn, how many times as long blocks take, the same of the longest step,
and the first press, in which blocks are gathered. Times are the thread's own, in ms: others' work counts only as far as
it takes the caches. Compare figures of one run with each other only.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.shapes import Box, Cylinder, Flat, Sphere

STEP_M = 0.05e-3
PIPE = Cylinder(12.5e-3, 20.16e-3, 0.35)
SCENES = [
    ("sphere", Sphere(12e-3), 0.4e-3, 2),
    ("pipe", PIPE, 0.1e-3, 2),
    ("sphere", Sphere(12e-3), 0.3e-3, 4),
    ("block", Box(10e-3, 10e-3), 0.15e-3, 2),
    ("pipe", PIPE, 0.2e-3, 2),
    ("pipe", PIPE, 0.3e-3, 2),
    ("sphere", Sphere(12e-3), 0.4e-3, 4),
    ("pipe", PIPE, 0.4e-3, 2),
    ("block", Box(13e-3, 13e-3), 0.15e-3, 2),
    ("block", Box(15e-3, 15e-3), 0.15e-3, 2),
    ("sphere", Sphere(16e-3), 0.4e-3, 4),
    ("block", Box(8e-3, 8e-3), 0.15e-3, 4),
    ("pipe", PIPE, 0.1e-3, 4),
    ("block", Box(18e-3, 18e-3), 0.15e-3, 2),
    ("pipe", PIPE, 0.2e-3, 4),
    ("pipe", PIPE, 0.3e-3, 4),
    ("plank", Flat(), 0.1e-3, 2),
]
LARGE = [("plank", Flat(), 0.1e-3, 4)]


def pressed(shape, depth_m, fine, solver):
    gel = FieldGel(shape, fine=fine, solver=solver)
    begin = time.thread_time()
    for part in (0.25, 0.5, 0.75, 1.0):
        gel.press(part * depth_m)
        gel.set_friction(np.full(gel.points_m.shape[1], 0.6))
        gel.trial(0.0, 0.0)
        gel.commit()
    return gel, time.thread_time() - begin


def times(shape, depth_m, fine, solvers):
    """Return per solver the gel, the time (s) of pressing and those of the steps."""
    for solver in solvers:
        pressed(shape, depth_m, fine, solver)  # what is compiled or kept once is not timed
    gels = {solver: pressed(shape, depth_m, fine, solver) for solver in solvers}
    taken = {solver: [] for solver in solvers}
    for way in [1] * 12 + [-1] * 6:
        for solver, (gel, _) in gels.items():
            begin = time.thread_time()
            gel.trial(way * STEP_M, 0.0)
            gel.commit()
            taken[solver].append(time.thread_time() - begin)
    return {solver: (gel, press, np.array(taken[solver])) for solver, (gel, press) in gels.items()}


def main():
    print("scene   fine  cells  rectangle  blocks ms  descent ms  ratio  worst ratio  press ms  descent")
    for name, shape, depth_m, fine in SCENES + (LARGE if "--large" in sys.argv else []):
        both = fine < 4 or name != "plank"
        found = times(shape, depth_m, fine, ("blocks", "fft") if both else ("fft",))
        gel, press, fft = found["fft"]
        box = gel._patch._patch._box
        start = f"{name:7s} {fine:4d} {gel.points_m.shape[1]:6d} {box.rows * box.columns:10d}"
        if both:
            _, blocks_press, blocks = found["blocks"]
            print(
                f"{start} {np.median(blocks) * 1e3:10.2f} {np.median(fft) * 1e3:11.2f}"
                f" {np.median(blocks) / np.median(fft):6.2f} {blocks.max() / fft.max():12.2f}"
                f" {blocks_press * 1e3:9.1f} {press * 1e3:8.1f}",
                flush=True,
            )
        else:
            print(f"{start} {'-':>10s} {np.median(fft) * 1e3:11.2f} {'':29s} {press * 1e3:8.1f}", flush=True)


if __name__ == "__main__":
    main()
