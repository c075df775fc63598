"""Synthetic references, fields and observations for the tests: positions and displacements that are known exactly."""

from __future__ import annotations

import numpy as np
from tactile.render import HEIGHT, WIDTH, pad_positions

from lsds.contracts import (
    ContactPatch,
    DeformationField,
    FeatureVector,
    Frame,
    MarkerReference,
    MarkerTracks,
    Observation,
)
from lsds.tactile.features import FeatureExtractor
from lsds.tactile.field import FieldBuilder

SCALE = 0.0625e-3
MS = 1_000_000
PADS = {(7, 9): (33.0, 32.0), (8, 10): (29.0, 28.0), (5, 7): (42.0, 42.0)}
CENTRE = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])


def make_reference(pad=(7, 9), angle=0.0, pincushion=0.04, jitter=0.15, seed=0, kept=None, shift=(0.0, 0.0)):
    """A reference as printed: cells row by row, `kept` (N,) bool leaves dots out."""
    rows, columns = pad
    xy = pad_positions(rows, columns, PADS[pad], pincushion, angle, jitter, seed) + np.asarray(shift)
    row, column = np.divmod(np.arange(rows * columns), columns)
    cell = np.stack([row, column], axis=1)
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    if kept is not None:
        xy, cell = xy[kept], cell[kept]
    return MarkerReference(xy, cell, pad, PADS[pad], axes, (WIDTH, HEIGHT))


def positions_m(reference):
    return (reference.xy_px - CENTRE) * SCALE


def tracks_of(reference, displacement_m, t_ns=0, lost=None, seq=0):
    xy = reference.xy_px + displacement_m / SCALE
    valid = np.ones(reference.count, bool) if lost is None else ~np.asarray(lost)
    xy = np.where(valid[:, None], xy, np.nan)
    return MarkerTracks(t_ns, seq, xy, valid, np.where(valid, 0, 1).astype(np.uint8))


def features_of(reference, *displacements_m, lost=None, dt_ms=40):
    """Features of the last of several fields, `dt_ms` apart; `lost` in the last one only."""
    builder, extractor = FieldBuilder(reference, SCALE), FeatureExtractor()
    for i, displacement in enumerate(displacements_m):
        last = i == len(displacements_m) - 1
        tracks = tracks_of(reference, displacement, i * dt_ms * MS, lost if last else None, i)
        features = extractor.extract(builder.build(tracks), None)
    return features


def observation(
    velocity_m_s, *, pad=(7, 9), displacement_m=None, lost=None, dt_s=0.04, depth_m=None, v_net=None, reference=None
):
    """An observation with exactly these velocities (N, 2) and displacements (N, 2), all in contact by default."""
    reference = make_reference(pad) if reference is None else reference
    shape = (reference.count, 2)
    displacement = np.broadcast_to(0.0 if displacement_m is None else displacement_m, shape).astype(float)
    velocity = np.broadcast_to(np.nan if velocity_m_s is None else velocity_m_s, shape).astype(float)
    valid = np.ones(reference.count, bool) if lost is None else ~np.asarray(lost)
    displacement[~valid] = np.nan
    velocity[~valid] = np.nan
    field = DeformationField(0, 0, dt_s, reference, positions_m(reference), displacement, velocity, valid)
    contact = None if depth_m is None else ContactPatch(depth_m, 50e-6, float((depth_m > 50e-6).mean()))
    speed = np.nan if velocity_m_s is None or not valid.any() else float(np.linalg.norm(velocity[valid].mean(axis=0)))
    features = FeatureVector(("v_net",), np.array([speed if v_net is None else v_net]))
    return Observation(0, 0, dt_s, field, contact, features)


def affine(position_m, gradient, shift=(0.0, 0.0)):
    """Vectors (N, 2) of the affine field shift + gradient x."""
    return np.asarray(shift) + position_m @ np.asarray(gradient).T


def frame(image, i, every_ms=40):
    return Frame(image, i * every_ms * MS, i)
