"""Print what the simulated cell costs and how its markers move: `python tests/mocks/bench.py`."""

from __future__ import annotations

import cv2
import numpy as np
from mock_rig import STRONG_M, WEAK_M, make_rig

from lsds.clock import perf_ns

FRAME_MS = 40


def gripped(aperture_m, speed_m_s, seed=1):
    """Return a rig that gripped at 0.1 s and lifts from 1.2 s."""
    rig = make_rig(seed)
    rig.until(100)
    rig.grip(aperture_m)
    rig.until(1200)
    rig.lift(speed_m_s)
    return rig


def net_speeds(aperture_m, speed_m_s, from_s, to_s, seed=1):
    """Return norm of the mean marker velocity (px/s) and mean displacement norm (px) per frame, from the truth."""
    rig = gripped(aperture_m, speed_m_s, seed)
    net, travel, last = [], [], None
    for t_ms in range(1200, round(to_s * 1e3), FRAME_MS):
        rig.until(t_ms)
        truth = rig.truth_now()
        if last is not None and t_ms > from_s * 1e3:
            net.append(np.linalg.norm((truth.xy_px - last.xy_px).mean(0)) / 0.04)
            travel.append(np.linalg.norm(truth.xy_px - truth.rest_px, axis=1).mean())
        last = truth
    return np.array(net), np.array(travel)


def frame_costs(aperture_m, speed_m_s, frames=100):
    """Return microseconds of physics and of rendering per 40 ms frame while lifting."""
    rig = gripped(aperture_m, speed_m_s)
    rig.until(1400)
    physics, render = [], []
    for _ in range(frames):
        rig.clock.sleep_until(rig.clock.now() + FRAME_MS * 1_000_000)
        t0 = perf_ns()
        rig.cell.advance(rig.clock.now())
        t1 = perf_ns()
        rig.sensor.read()
        physics.append(t1 - t0)
        render.append(perf_ns() - t1)
    return np.array(physics) / 1e3, np.array(render) / 1e3


def main():
    cv2.setNumThreads(1)
    for label, aperture in (("slipping", WEAK_M), ("held", STRONG_M)):
        physics, render = frame_costs(aperture, 0.01 if label == "slipping" else 0.038)
        print(
            f"{label}: physics {np.median(physics):.0f} us, render {np.median(render):.0f} us, together "
            f"{np.median(physics + render):.0f} us median, {np.percentile(physics + render, 95):.0f} us p95"
        )
    net, travel = net_speeds(STRONG_M, 0.038, 1.6, 3.0)
    quantiles = np.percentile(net, [50, 95, 100]).round(2)
    print(f"held, lifting: v_net p50/p95/max {quantiles} px/s, travel {travel.mean():.2f} px")
    for speed in (0.008, 0.023, 0.038, 0.045, 0.067):
        net, travel = net_speeds(WEAK_M, speed, 1.6, 1.6 + min(3.0, 0.05 / speed))
        print(
            f"slip at {speed * 100:.1f} cm/s: v_net p50/p95/max {np.percentile(net, [50, 95, 100]).round(2)} px/s, "
            f"travel {travel.mean():.2f} px"
        )


if __name__ == "__main__":
    main()
