"""Which dot is which: integer (row, column) cells of a printed grid, rotated or with dots missing.

Neighbours are walked from dot to dot, so pincushion distortion and a stretched gel do not add up to a wrong cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: A neighbour must lie this close to where the grid expects it, in pitches.
GATE = 0.35
#: Steps along the grid: right, left, down, up as (column, row).
STEPS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A grid found among M points.

    `index` (N,) the points that belong to it; `cell` (N, 2) their (row, column), from zero; `shape` (rows, columns);
    `pitch_px` (x, y) along the grid's own axes; `axes` (2, 2) their unit vectors, row 0 along columns (image right).
    """

    index: NDArray[np.intp]
    cell: NDArray[np.intp]
    shape: tuple[int, int]
    pitch_px: tuple[float, float]
    axes: NDArray[np.float64]


def identify_grid(xy_px: NDArray[np.float64]) -> Grid | None:
    """Return the largest grid among points (M, 2), or None if no four points form a block."""
    count = len(xy_px)
    if count < 4:
        return None
    axes, pitch = _orientation(xy_px)
    if not all(np.isfinite(pitch)):
        return None
    neighbour = _neighbours(xy_px, axes, pitch)
    best: dict[int, tuple[int, int]] = {}
    left = set(range(count))
    while len(left) > len(best):
        component = _walk(next(iter(left)), neighbour)
        left -= component.keys()
        if len(component) > len(best):
            best = component
    if len(best) < 4:
        return None
    index = np.array(sorted(best), np.intp)
    cell = np.array([best[i] for i in index.tolist()], np.intp)
    cell -= cell.min(axis=0)
    rows, columns = (int(n) + 1 for n in cell.max(axis=0))
    if rows < 2 or columns < 2:
        return None
    # Two dots claiming one cell means that the walk met itself shifted: keep neither, the rest is still sound.
    flat = cell[:, 0] * columns + cell[:, 1]
    unique = np.bincount(flat, minlength=rows * columns)[flat] == 1
    return Grid(index[unique], cell[unique], (rows, columns), pitch, axes)


def _orientation(xy: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """Grid axes and pitches from the vectors between near points: their angles repeat every quarter turn."""
    difference = xy[None, :, :] - xy[:, None, :]
    distance = np.hypot(difference[..., 0], difference[..., 1])
    np.fill_diagonal(distance, np.inf)
    nearest = np.median(distance.min(axis=1))
    near = difference[(distance > 0.6 * nearest) & (distance < 1.3 * nearest)]
    if not len(near):
        return np.eye(2), (np.nan, np.nan)
    angle = np.angle(np.mean(np.exp(4j * np.arctan2(near[:, 1], near[:, 0])))) / 4
    x_axis = np.array([np.cos(angle), np.sin(angle)])
    axes = np.stack([x_axis, [-x_axis[1], x_axis[0]]])
    along = np.abs(near @ axes.T)
    is_x = along[:, 0] > along[:, 1]
    pitch_x = float(np.median(along[is_x, 0])) if is_x.any() else np.nan
    pitch_y = float(np.median(along[~is_x, 1])) if (~is_x).any() else np.nan
    return axes, (pitch_x, pitch_y)


def _neighbours(
    xy: NDArray[np.float64], axes: NDArray[np.float64], pitch: tuple[float, float]
) -> dict[tuple[int, int], list[tuple[int, int, int]]]:
    """For every point and step, the point found there: {(point, step length): [(neighbour, d_row, d_column)]}."""
    reach = np.array(pitch)
    found: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    for length in (1, 2):
        for step in STEPS * length:
            expected = xy + (step * reach) @ axes
            offset = np.abs((xy[None, :, :] - expected[:, None, :]) @ axes.T) / reach
            distance = offset.max(axis=-1)
            closest = distance.argmin(axis=1)
            for i, j in enumerate(closest.tolist()):
                if distance[i, j] < GATE and i != j:
                    found.setdefault((i, length), []).append((j, int(step[1]), int(step[0])))
    return found


def _walk(start: int, neighbour: dict[tuple[int, int], list[tuple[int, int, int]]]) -> dict[int, tuple[int, int]]:
    """Walk from one point over its neighbours; jump over a missing dot only if no single step is possible."""
    cell = {start: (0, 0)}
    for length in (1, 2):
        queue = list(cell)
        while queue:
            i = queue.pop(0)
            row, column = cell[i]
            for step in (1,) if length == 1 else (1, 2):
                for j, d_row, d_column in neighbour.get((i, step), ()):
                    if j not in cell:
                        cell[j] = (row + d_row, column + d_column)
                        queue.append(j)
    return cell
