"""Print what the tests assert: `cd tests && python -m tactile.measure`."""

from __future__ import annotations

import numpy as np
from tactile.cell_frames import CellBench
from tactile.following import FOLLOWERS, Bench, bump, jumps, rms

from lsds.tactile.depth import DepthEstimator
from lsds.tactile.reference import average_frames


def sub_pitch(name, shape="uniform", **look):
    """RMS (px) and lost tracks over a wandering path of less than half a pitch."""
    bench = Bench(name)
    weight = {"uniform": 1.0, "bump": bump(bench.rest, 60)}[shape]
    path = [weight * np.array([11 * np.sin(i / 3), 11 * np.cos(i / 4) - 11]) for i in range(30)]
    steps = [bench.move(displacement, **look) for displacement in path]
    return rms(steps), sum(int((~s.valid).sum()) for s in steps)


def areas(seeds=range(1, 6)):
    """Return estimated less true contact area by seed, for increasingly firm grips, at the default resolution."""
    table = {}
    for seed in seeds:
        bench = CellBench(seed, jitter_ms=0.0)
        estimator = DepthEstimator(average_frames(bench.frames(5, 400)), bench.sensor.spec.metres_per_px)
        for i, aperture in enumerate(np.linspace(0.0245, 0.0224, 8)):
            bench.grip(aperture)
            bench.until(1500 + 800 * i)
            true, indentation = bench.true_area()
            error = estimator.measure(bench.sensor.read()).area_fraction - true
            table.setdefault(round(1e3 * indentation, 3), []).append(error)
    return table


def main():
    for name in FOLLOWERS:
        for shape in ("uniform", "bump"):
            for look in ({}, {"gain": 0.8}, {"gain": 1.2}):
                error, lost = sub_pitch(name, shape, **look)
                print(f"{name} {shape} {look or ''}: rms {error:.4f} px, {lost} flagged")
        total = np.zeros(3, int)
        for travel, (tracks, wrong, unflagged) in jumps(name).items():
            print(f"{name} jump {travel} px: {wrong} of {tracks} not followed, {unflagged} wrong and unflagged")
            total += (tracks, wrong, unflagged)
        tracks, wrong, unflagged = total
        print(
            f"{name} jumps together: wrong and unflagged {unflagged / tracks:.2%} of tracks, "
            f"flagged {1 - unflagged / max(wrong, 1):.2%} of those not followed"
        )
    for indentation, errors in areas().items():
        print(
            f"pressed in by {indentation} mm: area error mean {np.mean(errors):+.4f}, worst {np.abs(errors).max():.4f}"
        )


if __name__ == "__main__":
    main()
