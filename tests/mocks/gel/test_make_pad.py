"""Finite elements of a pad, against known answers and another library; and the command that runs them."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_mocks.gel.field.correction import pad_correction, read
from lsds_mocks.gel.field.grid import HatGrid, hat_grid
from lsds_mocks.gel.field.operator import layer_symbol, operator
from lsds_mocks.gel.material import GelMaterial
from lsds_research.pad import make_pad

pytest.importorskip("scipy", reason="SciPy is not installed; it comes with the extra 'pad'")

from lsds_research.pad.fem import assemble, solver
from lsds_research.pad.fem.axis import hat, products
from lsds_research.pad.fem.layer_hats import layer_matrix
from lsds_research.pad.fem.mesh import COARSE, FINE, half_pad
from lsds_research.pad.fem.pad_hats import pad_classes
from lsds_research.pad.fem.solid import Line, stiffness

TINY = GelMaterial(width_m=4.8e-3, height_m=4e-3)


def run(tmp_path, *arguments):
    size = ["--width-mm", "4.8", "--height-mm", "4", "--coarse"]
    return make_pad.main([*size, "--out", str(tmp_path / "pad.npz"), *arguments])


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """A tiny pad's file for two ratios, as the command makes it."""
    folder = tmp_path_factory.mktemp("made")
    assert run(folder, "--poisson", "0.48", "--poisson", "0.4") == 0
    return folder / "pad.npz"


# -- elements --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("poisson", [0.3, 0.499])
def test_stiffness_is_that_of_another_library(poisson):
    skfem = pytest.importorskip("skfem", reason="scikit-fem is not installed; it comes with the extra 'test'")
    from skfem.helpers import ddot, div, sym_grad

    edges = (np.array([0.0, 0.3, 0.5]), np.array([0.0, 0.4]), np.array([0.0, 0.7, 1.0]))
    own = stiffness(tuple(Line(products(e)) for e in edges), poisson)
    mesh = skfem.MeshHex.init_tensor(*edges)
    basis, reduced = (skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=order) for order in (5, 3))
    shear, bulk = 0.5 / (1 + poisson), poisson / ((1 + poisson) * (1 - 2 * poisson))
    other = skfem.BilinearForm(lambda u, v, w: 2 * shear * ddot(sym_grad(u), sym_grad(v))).assemble(basis)
    other += skfem.BilinearForm(lambda u, v, w: bulk * div(u) * div(v)).assemble(reduced)
    nodes = [np.unique(np.concatenate([e, 0.5 * (e[1:] + e[:-1])])) for e in edges]
    z, y, x = np.meshgrid(*nodes[::-1], indexing="ij")
    random = np.random.default_rng(0)
    for _ in range(5):
        power = random.integers(0, 3, size=(3, 3, 3))

        def field(x, power=power):
            return np.stack([sum(x[0] ** a * x[1] ** b * x[2] ** c for a, b, c in terms) for terms in power])

        here = field(np.stack([x, y, z])).reshape(-1)
        there = basis.project(field)
        assert here @ own @ here == pytest.approx(there @ other @ there, rel=1e-9)


def test_a_hat_loads_every_element_by_what_lies_on_it():
    edges = half_pad(FINE, 5, 0.24)
    assert edges[-1] == pytest.approx(0.6)
    assert hat(edges, 0.36, 0.24).sum() == pytest.approx(0.24)
    assert hat(edges, 0.6, 0.24).sum() == pytest.approx(0.12)
    assert hat(edges, 0.12, 0.24).sum() == pytest.approx(0.24 - 0.03)


def transforms(hats, q, count, pitch):
    """Return (count + 1, waves): Fourier transforms of the hats along an axis, those at the walls cut off."""
    with np.errstate(divide="ignore", invalid="ignore"):
        x = q * pitch
        half = np.where(q == 0, 0.5, (1 - 1j * x - np.exp(-1j * x)) / x**2) * pitch  # falls from 0 to the pitch
    rows = [half, *([half + half.conj()] * (count - 1)), half.conj()]
    return np.array([row * np.exp(-1j * q * i * pitch) for i, row in enumerate(rows)])


@pytest.mark.parametrize("poisson", [0.3, 0.49])
def test_the_layers_hats_are_those_of_its_symbol(poisson):
    hats, most = HatGrid(3, 4, 8, 10, 0.24, 0.25), 6
    found = layer_matrix(hats, poisson, FINE)
    qx, qy = (
        2 * np.pi * np.arange(-most * period, most * period + 1) / (period * pitch)
        for period, pitch in ((hats.period_x, hats.pitch_x), (hats.period_y, hats.pitch_y))
    )
    symbol = np.zeros((3, 3, len(qy), len(qx)), complex)
    for j, wave_y in enumerate(qy):
        for i, wave_x in enumerate(qx):
            xx, xy, yy, zz, xz, yz = layer_symbol(wave_x, wave_y, poisson)
            symbol[:, :, j, i] = [[xx, xy, 1j * xz], [xy, yy, 1j * yz], [-1j * xz, -1j * yz, zz]]
    across, down = transforms(hats, qx, hats.columns, hats.pitch_x), transforms(hats, qy, hats.rows, hats.pitch_y)
    area = hats.period_x * hats.pitch_x * hats.period_y * hats.pitch_y
    wanted = np.einsum("jy,ix,abyx,ky,lx->ajibkl", down.conj(), across.conj(), symbol, down, across, optimize=True)
    wanted = wanted.real.reshape(found.shape) * 2 * (1 + poisson) / area
    assert np.abs(found - found.T).max() < 1e-12
    # Half hats at walls end in a step, for which elements of this size are 1 % too stiff.
    row, column = np.divmod(np.arange(hats.nodes), hats.columns + 1)
    inside = (row > 0) & (row < hats.rows) & (column > 0) & (column < hats.columns)
    off = np.abs(found - wanted).reshape(3, hats.nodes, 3, hats.nodes)
    assert off.max() < 6e-3 * wanted.max()
    assert off[:, inside][:, :, :, inside].max() < 3e-3 * wanted.max()


def test_cutting_a_pad_out_of_the_layer_only_makes_it_softer():
    hats = hat_grid(TINY)
    pad = pad_classes(hats, 0.48, COARSE, lambda part: None)
    for square in pad:
        assert np.allclose(square, square.T)
    classes = assemble.correction(hats, pad, layer_matrix(hats, 0.48, COARSE))
    size = len(pad[0])
    for triangle in classes:
        square = np.zeros((size, size))
        square[np.triu_indices(size)] = triangle
        values = np.linalg.eigvalsh(square + np.triu(square, 1).T)
        assert values[0] > -1e-9 * values[-1]


def test_a_field_is_found_from_its_work_on_the_hats():
    hats = HatGrid(4, 5, 8, 8, 0.24, 0.25)
    field = np.random.default_rng(0).normal(size=2 * (3 * hats.nodes,))
    one = [assemble._mass(count, pitch) for count, pitch in ((hats.rows, hats.pitch_y), (hats.columns, hats.pitch_x))]
    mass = np.kron(np.eye(3), np.kron(*one))
    assert np.allclose(assemble.project(hats, mass @ field @ mass), field)


def test_without_pardiso_the_answer_is_the_same(monkeypatch):
    if solver._pardiso() is None:
        pytest.skip("PARDISO is not installed; it comes with the extra 'pad' on Linux")
    hats = HatGrid(4, 4, 8, 8, 0.25, 0.25)
    quick = pad_classes(hats, 0.49, COARSE, lambda part: None)
    monkeypatch.setattr(solver, "_pardiso", lambda: None)
    assert solver.require().startswith("SuperLU")
    for one, other in zip(quick, pad_classes(hats, 0.49, COARSE, lambda part: None), strict=True):
        assert np.allclose(other, one, rtol=1e-9, atol=1e-12)


# -- the command -----------------------------------------------------------------------------------------


def test_a_tiny_pad_is_made_and_used(made):
    content = read(str(made))
    assert list(content.poisson) == [0.4, 0.48]
    assert content.provenance["layers, surface to base"] == list(COARSE.layers)
    pad = GelMaterial(width_m=4.8e-3, height_m=4e-3, poisson=0.45, correction=str(made))
    # Pressed everywhere, it is softer than a piece of a layer, and stiffer than a bar whose base may spread.
    down, across = (np.array([0.5, *[1.0] * (count - 1), 0.5]) / count for count in (4, 5))
    weight = np.outer(down, across).ravel()
    softer = weight @ pad_correction(pad)[2, :, 2] @ weight * pad.width_m * pad.height_m
    layer = operator(pad, 1, "layer").cells[2, 2].sum()
    bar = pad.thickness_m / pad.modulus_pa
    assert 2 * layer < layer + softer < 0.9 * bar


def test_a_file_is_replaced_only_by_force(made, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(assemble, "make", lambda *arguments: read(str(made)))
    (tmp_path / "pad.npz").write_bytes(b"old")
    assert run(tmp_path, "--poisson", "0.4") == 2
    assert "--force" in capsys.readouterr().err
    assert (tmp_path / "pad.npz").read_bytes() == b"old"
    assert run(tmp_path, "--poisson", "0.4", "--poisson", "0.48", "--force") == 0
    assert "wrote" in capsys.readouterr().err
    assert list(read(str(tmp_path / "pad.npz")).poisson) == [0.4, 0.48]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--width-mm", "100"], "--width-mm 100: a pad of 4 mm is 4 to 40 mm"),
        (["--height-mm", "-5"], "--height-mm -5"),
        (["--thickness-mm", "0"], "--thickness-mm 0"),
        (["--thickness-mm", "nan"], "--thickness-mm nan"),
        (["--poisson", "0.5"], "--poisson 0.5: a ratio is between 0.05 and 0.4999"),
        (["--poisson", "-0.2"], "--poisson -0.2"),
        (["--poisson", "0.4", "--poisson", "0.4"], "--poisson 0.4 and 0.4"),
        (["--poisson", "half"], "'half' is not a valid float"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(tmp_path, capsys, arguments, message):
    assert run(tmp_path, *arguments) == 2
    output = capsys.readouterr().err
    assert message in output
    assert output.count("Error") == 1
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_noticed_before_the_work(tmp_path, capsys):
    assert run(tmp_path / "nowhere", "--poisson", "0.4") == 5
    assert "the folder does not exist" in capsys.readouterr().err


def test_an_interrupt_leaves_nothing_behind(tmp_path, capsys, monkeypatch):
    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(assemble, "layer_matrix", stop)
    assert run(tmp_path, "--poisson", "0.4") == 130
    assert "interrupted" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_without_scipy_the_extra_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "scipy", None)
    assert run(tmp_path, "--poisson", "0.4") == 1
    assert "pip install 'lsds-tactile[pad]'" in capsys.readouterr().err


def test_help_shows_examples_and_what_is_shipped(capsys):
    assert make_pad.main(["--help"]) == 0
    output = capsys.readouterr().out
    assert "Examples:" in output
    assert "24.96" in output
    assert "0.499" in output


def test_a_cell_takes_a_pad_of_other_proportions_with_its_file_and_names_what_is_missing(made):
    from lsds_mocks.cell.build import build_cell
    from lsds_mocks.cell.options import CellOptions

    from lsds.clock import VirtualClock
    from lsds.contracts import BuildContext
    from lsds.errors import DataError

    own = {"fidelity": "pad", "grid": 1, "pad_width_mm": 4.8, "pad_height_mm": 4.0}
    with pytest.raises(DataError, match="pad_correction"):
        build_cell(CellOptions(**own), BuildContext(VirtualClock(), 0))
    cell = build_cell(CellOptions(**own, pad_correction=str(made)), BuildContext(VirtualClock(), 0))
    assert cell.plant.gel.press(0.1e-3) > 0.05
