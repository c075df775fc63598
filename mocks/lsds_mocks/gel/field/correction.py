"""Correction for the walls of a finite pad and for the layer's periodicity: a dense matrix on hats, from a file.

The periodic layer has no walls. The correction is the compliance between hats of a 3-D finite-element model of the
pad less that of the periodic layer. It is smooth, so bilinear hats represent it; `lsds_research.pad.make_pad` computes
it. It is positive semi-definite, because cutting a pad out of a layer can only make it softer.

The file uses units of thickness and Young's modulus, so it serves every pad of the same proportions. The pad's two
mirror planes split the matrix into four parity classes, each of a quarter of the pad. A class is stored as the upper
triangle of a symmetric matrix in half precision (0.05 % of each entry), low and high bytes separate, compressed.

A cell interpolates the correction from the four hats around it, a surface point such as a marker from sixteen.
"""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TYPE_CHECKING, Any, TypeVar
from zipfile import BadZipFile

import numpy as np
from numba import njit

from lsds.errors import DataError
from lsds_mocks.byte_cache import kept
from lsds_mocks.gel.field.grid import HatGrid, hat_grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import HatGrid
    from lsds_mocks.gel.material import GelMaterial


_Real = TypeVar("_Real", np.float32, np.float64)

FORMAT = "lsds pad correction 1"
PARITIES = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Parities of the classes: of motion along y and depth under a reflection of x, and of motion along x and depth under
a reflection of y."""
_SHIPPED = "pad_24.96x20.16x4.00.npz"
_SAME = 1e-3
"""Relative difference up to which the proportions of two pads count as equal; chosen."""


@dataclass(frozen=True, eq=False)
class CorrectionFile:
    """Corrections for several Poisson ratios, `classes` (ratios, 4, m (m + 1) / 2), with their provenance."""

    hats: HatGrid
    poisson: NDArray[np.float64]
    classes: NDArray[np.float32]
    provenance: dict[str, Any]


def signs(hats: HatGrid, parity: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return, for each degree of freedom (3 nodes,) of the pad, its number in the quarter and its share there.

    The share is zero where a motion that is odd under a reflection meets the mirror.
    """
    columns, rows = hats.columns + 1, hats.rows + 1
    i, j = np.arange(float(columns)) - hats.columns / 2, np.arange(float(rows)) - hats.rows / 2
    quarter_x, quarter_y = np.floor(np.abs(i)).astype(int), np.floor(np.abs(j)).astype(int)
    wide, high = hats.columns // 2 + 1, hats.rows // 2 + 1
    number, share = [], []
    for d in range(3):
        across = _share(i, parity[0] * (-1 if d == 0 else 1))
        along = _share(j, parity[1] * (-1 if d == 1 else 1))
        share.append((along[:, None] * across[None, :]).ravel())
        number.append((d * high * wide + quarter_y[:, None] * wide + quarter_x[None, :]).ravel())
    return np.concatenate(number), np.concatenate(share)


def _share(place: NDArray[np.float64], parity: int) -> NDArray[np.float64]:
    return np.where(place > 0, 0.5, np.where(place < 0, 0.5 * parity, 0.5 * (1 + parity)))


def pack(hats: HatGrid, matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the classes (4, m (m + 1) / 2) of a matrix (3 nodes, 3 nodes) that has the pad's symmetry."""
    packed = []
    for parity in PARITIES:
        number, share = signs(hats, parity)
        size = int(number.max()) + 1
        fold = np.zeros((size, len(number)))
        fold[number, np.arange(len(number))] = share
        weight = (fold * fold).sum(axis=1)
        fold *= np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 0)[:, None]
        packed.append((0.25 * fold @ matrix @ fold.T)[np.triu_indices(size)])
    return np.array(packed)


def unpack(hats: HatGrid, classes: NDArray[_Real]) -> NDArray[_Real]:
    """Return the matrix (3, nodes, 3, nodes) of its classes (4, m (m + 1) / 2)."""
    size = 3 * hats.nodes
    matrix = np.zeros((size, size), classes.dtype)
    for parity, triangle in zip(PARITIES, classes, strict=True):
        number, share = signs(hats, parity)
        quarter = int(number.max()) + 1
        square = np.zeros((quarter, quarter), classes.dtype)
        square[np.triu_indices(quarter)] = triangle
        square += np.triu(square, 1).T
        scaled = (2 * share).astype(classes.dtype)
        part = square[number][:, number]
        part *= scaled[:, None]
        part *= scaled
        matrix += part
    return matrix.reshape(3, hats.nodes, 3, hats.nodes)


def write(path: Path, content: CorrectionFile) -> None:
    """Write a file atomically. Raises OSError on failure."""
    scale = np.abs(content.classes).max(axis=2)
    half = (content.classes / scale[..., None]).astype(np.float16).view(np.uint16)
    head = {"format": FORMAT, "hats": [*_key(content.hats)], "provenance": content.provenance}
    with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
        beside = Path(file.name)
        try:
            np.savez_compressed(
                file,
                head=np.frombuffer(json.dumps(head, sort_keys=True).encode(), np.uint8),
                poisson=content.poisson,
                scale=scale,
                low=(half & 255).astype(np.uint8),
                high=(half >> 8).astype(np.uint8),
            )
            file.close()
            beside.chmod(0o644)
            beside.replace(path)
        except BaseException:
            beside.unlink()
            raise


@kept
def read(path: str | None) -> CorrectionFile:
    """Return the content of a file, or of the shipped one. Raises DataError if it is missing or invalid."""
    if path is None:
        name = resources.files("lsds_mocks.gel") / "data" / _SHIPPED
        with resources.as_file(name) as shipped:
            return _read(shipped)
    if not Path(path).is_file():
        raise DataError(
            f"{path}: no such pad correction (cell.simulated.pad_correction; relative to {Path.cwd()}); "
            "make one with python -m lsds_research.pad.make_pad"
        )
    return _read(Path(path))


def _read(path: Path) -> CorrectionFile:
    try:
        # NumPy does not close a file that it fails to parse.
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            head = json.loads(bytes(file["head"]))
            if head["format"] != FORMAT:
                raise DataError(f"{path}: its format is '{head['format']}', not '{FORMAT}'; make it again")
            columns, rows, px, py, dx, dy = head["hats"]
            hats = HatGrid(int(columns), int(rows), int(px), int(py), float(dx), float(dy))
            half = (file["low"].astype(np.uint16) | (file["high"].astype(np.uint16) << 8)).view(np.float16)
            classes = half.astype(np.float32) * file["scale"].astype(np.float32)[..., None]
            poisson = file["poisson"].astype(float)
            quarter = 3 * (hats.columns // 2 + 1) * (hats.rows // 2 + 1)
            if classes.shape != (len(poisson), len(PARITIES), quarter * (quarter + 1) // 2):
                raise ValueError(f"its arrays are not those of {hats.columns} x {hats.rows} hat intervals")
            if not (np.isfinite(classes).all() and np.all(np.diff(poisson) > 0) and np.all(file["scale"] > 0)):
                raise ValueError("its values are not compliances")
            return CorrectionFile(hats, poisson, classes, head["provenance"])
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, BadZipFile, zlib.error) as error:
        raise DataError(
            f"{path}: not a pad correction: {error}; make one with python -m lsds_research.pad.make_pad"
        ) from error


def _key(hats: HatGrid) -> tuple[float, ...]:
    return (hats.columns, hats.rows, hats.period_x, hats.period_y, hats.pitch_x, hats.pitch_y)


@kept
def pad_correction(material: GelMaterial) -> NDArray[np.float32]:
    """Return the correction (3, nodes, 3, nodes) in metres per newton.

    Raises DataError where the file is for a pad of other proportions, or has no ratios around the material's.
    """
    file = read(material.correction)
    hats = hat_grid(material)
    if not np.allclose(_key(hats), _key(file.hats), rtol=_SAME):
        name = material.correction or "the shipped pad correction"
        raise DataError(
            f"{name} is for a pad of {_size(file.hats)} thicknesses, this one has {_size(hats)}; "
            "make one with python -m lsds_research.pad.make_pad, and name it with pad_correction"
        )
    low, high = float(file.poisson.min()), float(file.poisson.max())
    if not low <= material.poisson <= high:
        raise DataError(
            f"the pad correction covers Poisson ratios of {low:g} to {high:g}, not {material.poisson:g}; "
            "make one with python -m lsds_research.pad.make_pad --poisson"
        )
    weights = interpolation(file.poisson, material.poisson).astype(np.float32)
    classes = np.tensordot(weights, file.classes, axes=1)
    return unpack(hats, classes) / np.float32(material.modulus_pa * material.thickness_m)


def _size(hats: HatGrid) -> str:
    return f"{hats.columns * hats.pitch_x:.3f} x {hats.rows * hats.pitch_y:.3f}"


def interpolation(nodes: NDArray[np.float64], poisson: float) -> NDArray[np.float64]:
    """Return the Lagrange weights of the known ratios, polynomials in (1 - 2 v) / (1 - v).

    Compliances in units of Young's modulus are smooth in that variable, also at v = 1/2 (incompressible).
    """
    s, at = (1 - 2 * nodes) / (1 - nodes), (1 - 2 * poisson) / (1 - poisson)
    others = [np.delete(s, i) for i in range(len(s))]
    return np.array([np.prod((at - o) / (own - o)) for own, o in zip(s, others, strict=True)])


@njit(cache=True)  # type: ignore[untyped-decorator]
def hats_of(
    row: float, column: float, rows: int, columns: int, node: NDArray[np.int64], weight: NDArray[np.float64]
) -> None:
    """Write the four hats around a point, given in hat intervals from the pad's corner, and their values there."""
    r, c = min(max(int(row), 0), rows - 1), min(max(int(column), 0), columns - 1)
    y, x = min(max(row - r, 0.0), 1.0), min(max(column - c, 0.0), 1.0)
    first = r * (columns + 1) + c
    node[0], weight[0] = first, (1 - y) * (1 - x)
    node[1], weight[1] = first + 1, (1 - y) * x
    node[2], weight[2] = first + columns + 1, y * (1 - x)
    node[3], weight[3] = first + columns + 2, y * x


_HATS_PER_AXIS = 4
"""Hats per axis from which a point is interpolated."""


def reading(
    hats: HatGrid, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return numbers and weights (M, 16) of the hats that interpolate points (M,), in hat intervals from the corner."""
    column, across = _along(x, hats.columns)
    row, down = _along(y, hats.rows)
    node = row[:, :, None] * (hats.columns + 1) + column[:, None, :]
    weight = down[:, :, None] * across[:, None, :]
    return node.reshape(len(x), -1), weight.reshape(len(x), -1).astype(np.float32)


def _along(place: NDArray[np.float64], intervals: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return numbers and weights (M, 4) that recover a cubic from its best fit by hats, c = f - f'' / 12 at each hat.

    With Lagrange's cubics L_k on four neighbouring hats, f = sum (L_k + L_k'' / 12) c_k. The fit itself is accurate as
    a mean over a cell, but up to 2 % off at a point for loads at a wall.
    """
    first = np.clip(np.floor(place).astype(np.int64) - 1, 0, intervals + 1 - _HATS_PER_AXIS)
    at = np.clip(place, 0, intervals) - first
    weight = np.empty((len(place), _HATS_PER_AXIS))
    for own in range(_HATS_PER_AXIS):
        polynomial = np.poly(np.delete(np.arange(_HATS_PER_AXIS), own))
        scale = np.polyval(polynomial, own)
        bend = np.polyder(polynomial, 2)
        weight[:, own] = (np.polyval(polynomial, at) + np.polyval(bend, at) / 12) / scale
    return first[:, None] + np.arange(_HATS_PER_AXIS), weight
