"""Small folders of labelled videos, and datasets that look as if they came from one."""

from __future__ import annotations

import csv

import numpy as np
from lsds_research.clips.signals import CLIP_SIGNALS, clip_signals
from lsds_research.datasets import from_rows
from lsds_research.incipient.index import joined
from lsds_research.incipient.look import LOOKS
from tactile.render import pad_positions, render
from video_files import write_video

from lsds.models.signals import SIGNALS

HEADER = ("video", "recording", "object", "camera", "slip", "label_conflict")


def write_index(folder, rows, header=HEADER):
    """rows: dicts; what a row lacks is left empty."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "index.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, header, restval="", extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def row(number, camera="cam0", slip=0, object_name=None, conflict=0):
    name = f"{object_name or f'thing{number}'}__e{number}"
    return {
        "video": f"videos/{name}__{camera}.avi",
        "recording": name,
        "object": object_name or f"thing{number}",
        "camera": camera,
        "slip": slip,
        "label_conflict": conflict,
    }


def film(path, frames=16, seed=0, step_px=0.4):
    """A gel whose dots are carried to the right, `step_px` a frame for five frames."""
    path.parent.mkdir(parents=True, exist_ok=True)
    xy = pad_positions(seed=seed)
    at = step_px * np.clip(np.arange(frames) - 3, 0, 5)
    return write_video(path, [render(xy + np.array([x, 0.0]), seed=seed + k) for k, x in enumerate(at)])


def columns(name, object_name, slip, seed, frames=90):
    """A video's columns: where it slips the dots go apart from each other, else all together."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(7.0)), axis=-1).reshape(-1, 2)
    speed = np.cumsum(0.004 * rng.standard_normal((frames, 1, 2)), axis=0) * np.ones((1, 63, 1))
    own = np.cumsum(0.004 * rng.standard_normal((frames, 63, 2)), axis=0) * slip
    moved = speed + own + 0.001 * rng.standard_normal((frames, 63, 2))
    signals = np.full((frames, len(SIGNALS)), 1e-4, np.float32)
    signals *= np.exp(0.3 * rng.standard_normal(signals.shape)).astype(np.float32)
    signals[:, SIGNALS.index("dt")] = 0.04
    signals[:, SIGNALS.index("mean_speed")] *= 3 if slip else 2
    signals[:, SIGNALS.index("markers")] = 63
    t = 0.04 * np.arange(frames)
    made = from_rows(name, object_name, "real", t, signals, {"slip": np.full(frames, slip)})
    found = clip_signals(moved, grid)
    made |= dict.fromkeys(LOOKS, np.zeros(frames, np.float32))
    return made | {signal: found[:, k] for k, signal in enumerate(CLIP_SIGNALS)}


def dataset(objects=6, recordings=2, frames=(90, 60)):
    """Recordings with slip are of the same objects as those without, and shorter."""
    parts, videos = [], {}
    for thing in range(objects):
        for number in range(recordings):
            slip = number % 2
            for camera in ("cam0", "cam2"):
                name = f"thing{thing}__e{number}__{camera}"
                seed = 100 * thing + 10 * number + int(camera[-1])
                parts.append(columns(name, f"thing{thing}", slip, seed, frames[slip]))
                videos[name] = {"recording": name[:-6], "camera": camera, "conflict": False}
    return joined(parts, {"videos": videos, "failures": {}})
