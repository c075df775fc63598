"""Errors of the gel `winkler` on the reference scenes: `python tests/mocks/reference_scenes.py DIR [--fit]`.

DIR holds the finite-pad reference solution (`sphere.npz`, `pipe.npz`, `block.npz`, `torsion.npz`).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from lsds_mocks.gel.kernel import basis
from lsds_mocks.gel.markers import BRISTLE_REACH_M, QUORUM
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Box, Cylinder, Sphere
from lsds_mocks.gel.winkler import WinklerGel

FRICTION = 0.6
SCENES = {
    "sphere": (Sphere(12e-3), 0.4e-3, (0.05e-3, 0.0, 0.0)),
    "pipe": (Cylinder(12.5e-3, 20.16e-3 / np.cos(0.35), 0.35), 0.3e-3, (0.04e-3, 0.06e-3, 0.0)),
    "block": (Box(10e-3, 10e-3), 0.15e-3, (0.04e-3, 0.0, 0.0)),
    "torsion": (Sphere(12e-3), 0.4e-3, (0.0, 0.0, 0.03)),
}


def run(name, frames=14):
    """Return the gel and its states, frame 0 after pressing."""
    shape, depth, motion = SCENES[name]
    gel = WinklerGel(shape, GelMaterial(), design_m=depth)
    gel.press(depth)
    gel.set_friction(np.full(gel.points_m.shape[1], FRICTION))
    states, reactions = [gel.state()], []
    for _ in range(frames):
        for _ in range(5):
            reaction = gel.trial(*(m / 5 for m in motion))
            gel.commit()
        states.append(gel.state())
        reactions.append(reaction)
    return gel, states, reactions


def load(directory, name):
    return np.load(Path(directory) / f"{name}.npz")


def tip_weights(xy_m, points_m, share):
    """How much each bristle's tip speaks for each dot (M, N), in double precision; `share` is that of a contact."""
    square = (xy_m[:, 0, None] - points_m[0]) ** 2 + (xy_m[:, 1, None] - points_m[1]) ** 2
    near = np.exp(-square / (2 * BRISTLE_REACH_M**2))
    weights = near * share
    return weights / (weights.sum(axis=1, keepdims=True) + QUORUM * near.sum(axis=1).max(initial=1e-12))


def rows(directory, name):
    """Return the kernel's parts applied to the bristles' forces, (frames * 2 M, 12), and the reference, flattened."""
    gel, states, _ = run(name)
    reference = load(directory, name)
    xy = reference["marker_xy_mm"] * 1e-3
    weights = tip_weights(xy, gel.points_m, gel.middle(states[0]))
    at_tips = basis(gel.points_m.T, gel.points_m)
    both = np.kron(np.eye(2), weights)
    parts = basis(xy, gel.points_m) - both @ at_tips
    left, right = [], []
    for state, u in zip(states, reference["marker_u_mm"], strict=True):
        force = np.concatenate([state.shear_n.ravel(), state.pressure_n])
        left.append((parts @ force).T)
        right.append(u.ravel() * 1e-3 - both @ state.deflection_m.ravel())
    return np.concatenate(left), np.concatenate(right)


def fit(directory):
    """Least squares over all scenes, each weighted alike."""
    pairs = [rows(directory, name) for name in SCENES]
    left = np.concatenate([a / np.sqrt(np.mean(b**2)) for a, b in pairs])
    right = np.concatenate([b / np.sqrt(np.mean(b**2)) for a, b in pairs])
    ridge = 1e-3 * np.sqrt((left**2).sum(0).mean()) * np.eye(left.shape[1])
    return np.linalg.lstsq(np.concatenate([left, ridge]), np.concatenate([right, np.zeros(12)]), rcond=None)[0]


def errors(directory, name):
    """Return marker RMS per component (m) over all frames, and relative errors of forces."""
    gel, states, reactions = run(name)
    reference = load(directory, name)
    xy = reference["marker_xy_mm"] * 1e-3
    ours = np.array([gel.marker_displacement(state, xy).T for state in states])
    rms = float(np.sqrt(np.mean((ours - reference["marker_u_mm"] * 1e-3) ** 2)))
    signal = float(np.sqrt(np.mean((reference["marker_u_mm"] * 1e-3) ** 2)))
    normal = states[0].normal_force_n / float(reference["normal_N"][0]) - 1
    first = np.hypot(reactions[0].force_x_n, reactions[0].force_y_n) / np.linalg.norm(reference["tangential_N"][1])
    last = np.hypot(reactions[-1].force_x_n, reactions[-1].force_y_n) / np.linalg.norm(reference["tangential_N"][-1])
    torque = reactions[0].torque_nm * 1e3 / float(reference["torque_Nmm"][1]) if name == "torsion" else np.nan
    return {
        "rms_um": rms * 1e6,
        "signal_um": signal * 1e6,
        "normal": normal,
        "shear_first": first - 1,
        "shear_last": last - 1,
        "torque_first": torque - 1,
    }


if __name__ == "__main__":
    where = sys.argv[1]
    if "--fit" in sys.argv:
        print(", ".join(f"{c:.4g}" for c in fit(where)))
    for scene in SCENES:
        print(scene, {k: round(v, 3) for k, v in errors(where, scene).items()})
