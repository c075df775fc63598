"""The finite-pad correction: its file, how it is read, and how well the pad moves the dots."""

from __future__ import annotations

import json
import math
from importlib import resources

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from lsds_mocks.gel.field import correction
from lsds_mocks.gel.field.correction import (
    CorrectionFile,
    interpolation,
    pack,
    pad_correction,
    read,
    reading,
    unpack,
    write,
)
from lsds_mocks.gel.field.dense import Patch
from lsds_mocks.gel.field.grid import HatGrid, hat_grid
from lsds_mocks.gel.field.operator import operator
from lsds_mocks.gel.material import GelMaterial
from mocks.gel.pad_loads import LOADS, errors, product_um

from lsds.errors import DataError

STORED = resources.files("mocks.gel") / "pad_reference.json"
TOLERANCE = 0.005
"""Of the greatest motion of a dot."""


def symmetric(hats, seed):
    """Return a random symmetric matrix (3 nodes, 3 nodes) that two mirrors leave as it is."""
    random = np.random.default_rng(seed)
    shape = (3, hats.rows + 1, hats.columns + 1)
    half = random.normal(size=(3 * hats.nodes, 3 * hats.nodes))
    matrix = (half + half.T).reshape(2 * shape)
    for axis, component in ((1, 1), (2, 0)):
        sign = np.where(np.arange(3) == component, -1.0, 1.0)
        mirrored = np.flip(matrix, (axis, axis + 3)) * sign[:, None, None, None, None, None]
        matrix = 0.5 * (matrix + mirrored * sign[:, None, None])
    return matrix.reshape(3 * hats.nodes, 3 * hats.nodes)


def small_file(columns=5, rows=4, ratios=(0.4, 0.48), seed=0):
    hats = HatGrid(columns, rows, 8, 8, 0.24, 0.25)
    matrices = [symmetric(hats, seed + i) for i in range(len(ratios))]
    classes = np.array([pack(hats, m) for m in matrices], np.float32)
    return CorrectionFile(hats, np.array(ratios), classes, {"made by": "a test"})


# -- classes and files -----------------------------------------------------------------------------------


@settings(max_examples=15)
@given(columns=st.integers(2, 4), rows=st.integers(2, 4), seed=st.integers(0, 2**31))
def test_a_symmetric_matrix_survives_packing(columns, rows, seed):
    hats = HatGrid(columns, rows, 8, 8, 0.24, 0.25)
    matrix = symmetric(hats, seed)
    assert unpack(hats, pack(hats, matrix)).reshape(matrix.shape) == pytest.approx(matrix, abs=1e-12)


@settings(max_examples=15)
@given(columns=st.integers(2, 4), rows=st.integers(2, 4), seed=st.integers(0, 2**31))
def test_what_the_mirrors_forbid_is_dropped_by_packing(columns, rows, seed):
    hats = HatGrid(columns, rows, 8, 8, 0.24, 0.25)
    size = 3 * hats.nodes
    matrix = np.random.default_rng(seed).normal(size=(size, size))
    classes = pack(hats, matrix + matrix.T)
    again = pack(hats, unpack(hats, classes).reshape(size, size))
    assert again == pytest.approx(classes, abs=1e-12)


def test_a_file_is_read_as_it_was_written(tmp_path):
    content = small_file()
    write(tmp_path / "pad.npz", content)
    found = read(str(tmp_path / "pad.npz"))
    assert found.hats == content.hats
    assert found.poisson == pytest.approx(content.poisson)
    assert found.provenance == content.provenance
    assert np.abs(found.classes - content.classes).max() < 1e-3 * np.abs(content.classes).max()


def test_the_same_content_gives_the_same_bytes(tmp_path):
    for name in ("one.npz", "two.npz"):
        write(tmp_path / name, small_file())
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError])
def test_writing_that_is_interrupted_leaves_the_old_file(tmp_path, monkeypatch, error):
    def stop(file, **arrays):
        file.write(b"half")
        raise error

    (tmp_path / "pad.npz").write_bytes(b"old")
    monkeypatch.setattr(correction.np, "savez_compressed", stop)
    with pytest.raises(error):
        write(tmp_path / "pad.npz", small_file())
    assert [path.name for path in tmp_path.iterdir()] == ["pad.npz"]
    assert (tmp_path / "pad.npz").read_bytes() == b"old"


def damaged(tmp_path, how):
    path = tmp_path / f"{how}.npz"
    content = small_file()
    if how == "text":
        path.write_text("not a pad")
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "another archive":
        np.savez(path, x=np.zeros(3))
    elif how == "cut off":
        write(path, content)
        path.write_bytes(path.read_bytes()[:-200])
    elif how == "other arrays":
        write(path, CorrectionFile(content.hats, content.poisson, content.classes[..., :-1], {}))
    return path


@pytest.mark.parametrize("how", ["missing", "text", "empty", "another archive", "cut off", "other arrays"])
def test_what_is_no_correction_is_refused_by_name(tmp_path, how):
    path = damaged(tmp_path, how)
    with pytest.raises(DataError, match="make one with") as caught:
        read(str(path))
    assert str(path) in str(caught.value)


def test_a_file_of_another_format_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(correction, "FORMAT", "lsds pad correction 0")
    write(tmp_path / "pad.npz", small_file())
    monkeypatch.undo()
    with pytest.raises(DataError, match=r"correction 0.*make it again"):
        read(str(tmp_path / "pad.npz"))


def test_a_pad_of_other_proportions_is_refused():
    with pytest.raises(DataError, match=r"6\.240 x 5\.040 thicknesses, this one has 7\.000 x 5\.040"):
        pad_correction(GelMaterial(width_m=28e-3))


def test_a_ratio_beyond_the_files_is_refused():
    with pytest.raises(DataError, match=r"ratios of 0\.3 to 0\.499, not 0\.2;"):
        pad_correction(GelMaterial(poisson=0.2))


def test_pads_of_the_same_proportions_share_a_file():
    pad = GelMaterial()
    half = GelMaterial(modulus_pa=pad.modulus_pa, thickness_m=2e-3, width_m=12.48e-3, height_m=10.08e-3)
    assert np.array_equal(pad_correction(half), 2 * pad_correction(pad))


# -- between ratios --------------------------------------------------------------------------------------


@given(st.lists(st.floats(0.05, 0.4999), min_size=1, max_size=6))
def test_interpolation_returns_what_is_known(ratios):
    nodes = np.sort(ratios)
    assume(np.all(np.diff(nodes) > 1e-2))
    for i, node in enumerate(nodes):
        assert interpolation(nodes, float(node)) == pytest.approx(np.eye(len(nodes))[i], abs=1e-9)
    assert interpolation(nodes, 0.4567).sum() == pytest.approx(1)


# -- what is shipped -------------------------------------------------------------------------------------


def test_the_shipped_file_is_small_and_states_its_provenance():
    shipped = resources.files("lsds_mocks.gel") / "data" / "pad_24.96x20.16x4.00.npz"
    with resources.as_file(shipped) as path:
        assert path.stat().st_size <= 4e6
    content = read(None)
    assert content.hats == hat_grid(GelMaterial())
    assert content.poisson == pytest.approx([0.3, 0.4, 0.48, 0.499])
    assert {"made by", "elements", "integration", "loads", "layer", "projection", "solver"} <= set(content.provenance)


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.48, 0.499])
def test_the_shipped_correction_only_makes_the_pad_softer(poisson):
    matrix = pad_correction(GelMaterial(poisson=poisson)).astype(float)
    matrix = matrix.reshape(2 * (matrix.shape[0] * matrix.shape[1],))
    assert np.abs(matrix - matrix.T).max() < 1e-6 * np.abs(matrix).max()
    # Its eigenvalues are those of its four classes of parity, each a quarter of its size.
    triangles = pack(hat_grid(GelMaterial()), matrix)
    size = math.isqrt(2 * triangles.shape[1])
    values = []
    for triangle in triangles:
        upper = np.zeros((size, size))
        upper[np.triu_indices(size)] = triangle
        values.append(np.linalg.eigvalsh(upper, UPLO="U"))
    # Half precision leaves 0.05 % of an entry.
    assert np.min(values) > -1e-3 * np.max(values)


@settings(max_examples=25)
@given(
    cells=st.sets(st.tuples(st.integers(0, 41), st.integers(0, 51)), min_size=1, max_size=30),
    poisson=st.sampled_from([0.3, 0.45, 0.48, 0.499]),
)
def test_any_patch_is_symmetric_and_takes_work_to_press(cells, poisson):
    pad = operator(GelMaterial(poisson=poisson), 2, "pad")
    patch = Patch(pad)
    patch.add(np.array(sorted(row * pad.grid.columns + column for row, column in cells), np.int32))
    size = 3 * patch.size
    matrix, moved = np.zeros((size, size)), np.zeros((3, patch.size), np.float32)
    for column, traction in enumerate(np.eye(size, dtype=np.float32)):
        patch.respond(np.ascontiguousarray(traction.reshape(3, -1)), moved)
        matrix[:, column] = moved.ravel()
    assert np.abs(matrix - matrix.T).max() < 1e-5 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix).min() > 0


# -- dots ------------------------------------------------------------------------------------------------


@given(
    bend=st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    x=st.floats(0, 7),
    y=st.floats(0, 5),
)
def test_a_point_reads_a_parabola_from_its_best_fit_by_hats(bend, x, y):
    hats = HatGrid(7, 5, 16, 8, 0.24, 0.24)
    a, b, c = bend
    column, row = np.meshgrid(np.arange(8.0), np.arange(6.0))
    # The fit of s^2 by straight pieces is s^2 - 1/6 at the hats.
    fit = a * (column**2 - 1 / 6) + b * column * row + c * (row**2 - 1 / 6)
    node, weight = reading(hats, np.array([x]), np.array([y]))
    assert weight[0] @ fit.ravel()[node[0]] == pytest.approx(a * x * x + b * x * y + c * y * y, abs=1e-4)


@pytest.mark.parametrize("poisson", ["0.48", "0.495"])
@pytest.mark.parametrize("fine", [2, 4])
def test_dots_go_where_direct_finite_elements_say(poisson, fine):
    solved = np.array(json.loads(STORED.read_text(encoding="utf-8"))[poisson])
    off = dict(zip(LOADS, errors(product_um(float(poisson), fine), solved), strict=True))
    assert {load: error for load, error in off.items() if error > TOLERANCE} == {}


@pytest.mark.slow
@pytest.mark.parametrize("poisson", [0.48])
def test_dots_go_where_direct_finite_elements_say_now(poisson):
    pytest.importorskip("skfem", reason="scikit-fem is not installed; it comes with the extra 'test'")
    pytest.importorskip("pypardiso", reason="PARDISO is not installed; SuperLU would take hours")
    from mocks.gel.pad_reference import reference_um

    off = dict(zip(LOADS, errors(product_um(poisson), reference_um(poisson)), strict=True))
    assert {load: error for load, error in off.items() if error > TOLERANCE} == {}
