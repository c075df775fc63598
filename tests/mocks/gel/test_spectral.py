"""Descent on rectangles against dense blocks, and against the laws of contact where blocks are no judge."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.gel.field import choice
from lsds_mocks.gel.field.box import Box
from lsds_mocks.gel.field.choice import SWEEPS, AnyPatch
from lsds_mocks.gel.field.dense import Patch
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.field.operator import operator
from lsds_mocks.gel.field.spectral import SpectralPatch
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Box as Block
from lsds_mocks.gel.shapes import Cylinder, Flat, Sphere

MU = 0.6
SCENES = {
    "sphere": (Sphere(12e-3), 0.4e-3, 2),
    "pipe": (Cylinder(12.5e-3, 20.16e-3, 0.35), 0.3e-3, 2),
    "block": (Block(10e-3, 10e-3), 0.15e-3, 2),
    "plank": (Flat(), 0.1e-3, 1),
}
KERNELS = [("pad", 0.3), ("pad", 0.48), ("pad", 0.499), ("layer", 0.48), ("half-space", 0.48)]
"""A pad is a layer with its walls: what holds for it at a ratio holds for the layer in it."""
MOST = 300
"""Iterations in which any problem of the property test converges: steps of 0.1 mm from anywhere, friction up to 2.5."""


def answer(kernel="pad", poisson=0.48, fine=1):
    return operator(GelMaterial(poisson=poisson), fine, kernel)


def rectangle(grid, row, column, rows, columns):
    return ((row + np.arange(rows))[:, None] * grid.columns + column + np.arange(columns)).ravel().astype(np.int32)


def patches(op, cells):
    both = Patch(op), SpectralPatch(op)
    for patch in both:
        patch.add(cells)
    return both


def rest(count):
    return np.zeros((3, count), np.float32), np.zeros((3, count), np.float32), np.ones(count, bool)


def misfit(patch, traction, w, target, friction):
    """Return by how much the traction of any cell changes when that alone is set right, as in the sweeps."""
    own = np.array([patch._diagonal[:, 1], patch._diagonal[:, 1], patch._diagonal[:, 0]])[:, : patch.size]
    new = traction - (w - target) / own
    new[2] = np.maximum(new[2], 0)
    size, limit = np.hypot(*new[:2]), friction * new[2]
    new[:2] *= np.where(size > limit, limit / np.maximum(size, 1e-30), 1)
    return np.abs(new - traction).max()


# The elastic answer.


@pytest.mark.parametrize(("kernel", "poisson"), KERNELS)
@pytest.mark.parametrize(
    "place", [(0, 0, 21, 26), (3, 5, 8, 9), (0, 7, 21, 12), (9, 0, 6, 26), (4, 0, 17, 26), (20, 25, 1, 1)]
)
def test_a_rectangle_answers_like_dense_compliance(kernel, poisson, place):
    op = answer(kernel, poisson)
    dense = Patch(op)
    dense.add(rectangle(op.grid, *place))
    traction = np.random.default_rng(1).normal(size=(3, dense.size)).astype(np.float32)
    w = np.zeros_like(traction)
    dense.respond(traction, w)
    box, shape = Box(op, *place), (3, *place[2:])
    out = np.empty(shape, np.float32)
    box.respond(traction.reshape(shape), out)
    assert np.abs(out.reshape(3, -1) - w).max() < 1e-5 * np.abs(w).max()
    depth = np.empty((1, *place[2:]), np.float32)
    box.respond(traction.reshape(shape), depth, first=2)
    np.testing.assert_allclose(depth[0], out[2], rtol=0, atol=1e-6 * np.abs(w).max())


@pytest.mark.parametrize(("kernel", "poisson"), KERNELS)
def test_the_preconditioner_is_symmetric_and_positive_and_leaves_a_narrow_spectrum(kernel, poisson):
    op, (rows, columns) = answer(kernel, poisson), (7, 9)
    box, unit = Box(op, 6, 8, rows, columns), np.eye(3 * rows * columns, dtype=np.float32)
    forward, back = np.empty_like(unit), np.empty_like(unit)
    for i, load in enumerate(unit):
        box.respond(load.reshape(3, rows, columns), forward[i].reshape(3, rows, columns))
        box.precondition(load.reshape(3, rows, columns), back[i].reshape(3, rows, columns))
    np.testing.assert_allclose(back, back.T, rtol=0, atol=1e-5 * np.abs(back).max())
    half = np.linalg.cholesky(back.astype(float))
    spectrum = np.linalg.eigvalsh(half.T @ forward @ half)
    assert spectrum.min() > 0.5
    assert spectrum.max() < 7
    assert np.quantile(spectrum, 0.9) < 1.5


# Against blocks.


def sheared(scene, solver, tolerance):
    """Return forces (frames, 4) and the last tractions, through shear, a turn and reversal."""
    shape, depth, fine = SCENES[scene]
    gel = FieldGel(shape, fine=fine, solver=solver, tolerance=tolerance)
    forces = []
    pressing = [(0.0, 0.0, 0.0, (part + 1) / 4) for part in range(4)]
    there = [(50e-6, 0.0, 0.0, 1.0)] * 8 + [(0.0, 50e-6, 0.002, 1.0)] * 4
    for dx, dy, turn, part in pressing + there + [(-50e-6, 0.0, 0.0, 1.0)] * 8:
        gel.press(part * depth)
        gel.set_friction(np.full(gel.points_m.shape[1], MU))
        reaction = gel.trial(dx, dy, turn)
        gel.commit()
        forces.append((reaction.force_x_n, reaction.force_y_n, reaction.torque_nm * 100, reaction.normal_n))
    assert gel.effort.unconverged == 0
    state = gel.state()
    order = np.argsort(state.cells)
    return np.array(forces), np.vstack([state.shear_n, state.pressure_n])[:, order], state.slid[order]


@pytest.mark.parametrize("scene", sorted(SCENES))
def test_agrees_with_blocks_through_shear_and_reversal(scene):
    tolerance = 2e-3
    forces, traction, slid = sheared(scene, "fft", tolerance)
    true_forces, true_traction, truly_slid = sheared(scene, "blocks", tolerance / 20)
    assert np.abs(forces - true_forces).max() < tolerance * true_forces[:, 3].max()
    assert np.abs(traction - true_traction).max() < 3 * tolerance * true_traction[2].max()
    assert np.mean(slid != truly_slid) < 0.02


@pytest.mark.parametrize("scene", sorted(SCENES))
def test_a_frame_takes_few_iterations(scene):
    shape, depth, fine = SCENES[scene]
    gel = FieldGel(shape, fine=fine, solver="fft")
    gel.press(depth)
    gel.set_friction(np.full(gel.points_m.shape[1], MU))
    gel.trial(0.0, 0.0)
    gel.commit()
    assert gel.effort.sweeps <= 60
    taken = []
    for way in [1] * 12 + [-1] * 12:
        before = gel.effort.sweeps
        gel.trial(way * 50e-6, 0.0)
        gel.commit()
        taken.append(gel.effort.sweeps - before)
    assert np.median(taken) <= 12
    assert max(taken) <= 50
    assert gel.effort.unconverged == 0


# The laws of contact, at the end of any solution.

problems = st.fixed_dictionaries(
    {
        "kernel": st.sampled_from(KERNELS),
        "seed": st.integers(0, 2**32 - 1),
        "count": st.integers(1, 250),
        "together": st.booleans(),
        "friction": st.tuples(st.floats(0.3, 2.5), st.floats(0.3, 2.5)),
        "tolerance": st.sampled_from([0.02, 0.006, 0.002]),
        "depth": st.floats(-0.5e-4, 2e-4),
        "curved": st.booleans(),
    }
)


@settings(max_examples=120)
@given(problem=problems)
def test_no_cell_pulls_or_holds_more_than_friction_or_is_off_by_more_than_the_tolerance(problem):
    op, rng = answer(*problem["kernel"]), np.random.default_rng(problem["seed"])
    x, y = op.grid.centres_m(np.arange(op.grid.size))
    middle = rng.uniform(-8e-3, 8e-3, 2)
    away = np.hypot(x - middle[0], y - middle[1])
    cells = np.argsort(away)[: problem["count"]] if problem["together"] else rng.permutation(x.size)[: problem["count"]]
    cells = rng.permutation(cells).astype(np.int32)
    dense, patch = patches(op, cells)
    friction = rng.uniform(*sorted(problem["friction"]), patch.size).astype(np.float32)
    gap = away[cells] ** 2 / 20e-3 if problem["curved"] else rng.uniform(0, 1e-4, patch.size)
    traction, w, slid = rest(patch.size)
    target, largest = np.zeros_like(traction), 0.0
    for _ in range(3):
        target[2] = problem["depth"] - gap + rng.uniform(-0.3e-4, 0.3e-4)
        target[:2] += rng.uniform(-1e-4, 1e-4, (2, 1))
        done = patch.relax(traction, w, target, friction, slid, problem["tolerance"], MOST)
        assert 1 <= done <= MOST
        p, greatest = traction[2], traction[2].max()
        limit = friction * p
        assert (p >= 0).all()
        assert (np.hypot(*traction[:2]) <= limit * (1 + 1e-5)).all()
        afresh = np.zeros_like(w)
        dense.respond(traction, afresh)
        # Displacements are added up in single precision, from one solution to the next.
        largest = max(largest, np.abs(w).max(), np.abs(target).max())
        rounding = 2e-6 * largest / patch._kt
        assert np.abs(afresh - w).max() <= rounding * patch._kt + 0.05 * problem["tolerance"] * greatest * patch._kt
        assert misfit(dense, traction, afresh, target, friction) <= 1.1 * problem["tolerance"] * greatest + rounding
        assert slid[p == 0].all()
        assert np.abs((w - target)[:2, ~slid]).max(initial=0) <= 3 * problem["tolerance"] * greatest * patch._kt + 1e-9
        # Friction opposes slip if it exceeds the tolerance.
        behind, off = ((target - w)[:2] * traction[:2]).sum(axis=0), 2 * problem["tolerance"] * greatest
        assert (behind >= -off * patch._kt * limit)[slid & (limit > off)].all()


@pytest.mark.parametrize("scene", ["sphere", "pipe"])
def test_what_is_solved_stays_as_it_is(scene):
    shape, depth, fine = SCENES[scene]
    gel = FieldGel(shape, fine=fine, solver="fft")
    gel.press(depth)
    gel.set_friction(np.full(gel.points_m.shape[1], MU))
    first = gel.trial(100e-6, 20e-6)
    traction, sweeps = gel._traction.copy(), gel.effort.sweeps
    again = gel.trial(100e-6, 20e-6)
    assert gel.effort.sweeps - sweeps == 1
    assert np.abs(gel._traction - traction).max() <= 0.05 * gel.tolerance * traction[2].max()
    assert again.force_x_n == pytest.approx(first.force_x_n, rel=1e-3)


def test_an_object_that_is_lifted_leaves_nothing():
    op = answer()
    _, patch = patches(op, rectangle(op.grid, 5, 5, 10, 12))
    traction, w, slid = rest(patch.size)
    target = np.full_like(traction, 1e-4)
    friction = np.full(patch.size, MU, np.float32)
    assert patch.relax(traction, w, target, friction, slid, 0.02, SWEEPS) > 0
    assert (traction[2] > 0).all()
    target[2] = -1e-5
    assert patch.relax(traction, w, target, friction, slid, 0.02, SWEEPS) > 0
    assert not traction.any()
    assert slid.all()
    assert np.abs(w).max() < 1e-9


# Cells come and go.


def test_a_patch_without_cells_has_nothing_to_do():
    patch = SpectralPatch(answer())
    traction, w, slid = rest(0)
    patch.respond(traction, w)
    assert patch.relax(traction, w, traction.copy(), np.zeros(0, np.float32), slid, 0.02, SWEEPS) == 0
    assert patch.size == 0
    assert patch.work(3) == 0


def test_cells_come_and_go_in_their_order():
    op, rng = answer(), np.random.default_rng(2)
    dense, patch = patches(op, rectangle(op.grid, 5, 5, 4, 4))
    for cells in (rectangle(op.grid, 6, 9, 2, 3), rectangle(op.grid, 0, 0, 1, 2), rectangle(op.grid, 20, 25, 1, 1)):
        for each in (dense, patch):
            each.add(cells)
        compare(dense, patch, rng)
    which = rng.random(dense.size) < 0.5
    for each in (dense, patch):
        each.keep(which)
    compare(dense, patch, rng)
    for each in (dense, patch):
        each.keep(np.zeros(each.size, bool))
    assert patch.size == 0


def compare(dense, patch, rng):
    assert np.array_equal(dense.cells, patch.cells)
    traction = rng.normal(size=(3, dense.size)).astype(np.float32)
    true, w = np.zeros_like(traction), np.full_like(traction, 7.0)
    dense.respond(traction, true)
    patch.respond(traction, w, 3)
    assert (w[:, :3] == 7.0).all()
    assert np.abs(w - true)[:, 3:].max() < 1e-5 * np.abs(true).max()


def test_the_solver_follows_the_number_of_cells(monkeypatch):
    monkeypatch.setattr(choice, "MANY_CELLS", 40)
    monkeypatch.setattr(choice, "FEW_CELLS", 20)
    op = answer()
    patch = AnyPatch(op)
    patch.add(rectangle(op.grid, 5, 5, 4, 10))
    assert patch.solver == "blocks"
    patch.add(rectangle(op.grid, 9, 5, 1, 1))
    assert patch.solver == "fft"
    cells = patch.cells
    patch.keep(np.arange(patch.size) < 20)
    assert patch.solver == "fft"
    patch.keep(np.arange(patch.size) < 19)
    assert patch.solver == "blocks"
    assert np.array_equal(patch.cells, cells[:19])


@pytest.mark.parametrize("solver", ["blocks", "fft"])
def test_a_solver_that_is_asked_for_stays(solver, monkeypatch):
    monkeypatch.setattr(choice, "MANY_CELLS", 40)
    monkeypatch.setattr(choice, "FEW_CELLS", 20)
    patch = AnyPatch(answer(), solver)
    patch.add(np.arange(60, dtype=np.int32))
    assert patch.solver == solver
    patch.keep(np.arange(60) < 5)
    assert patch.solver == solver


def test_a_gel_that_changes_solver_on_the_way_feels_the_same(monkeypatch):
    monkeypatch.setattr(choice, "MANY_CELLS", 60)
    monkeypatch.setattr(choice, "FEW_CELLS", 40)
    found, used = {}, set()
    for solver in ("auto", "blocks"):
        gel = FieldGel(Sphere(12e-3), solver=solver, tolerance=2e-3)
        forces = []
        for depth in [*np.linspace(0.05e-3, 0.4e-3, 8), *np.linspace(0.35e-3, 0.05e-3, 7)]:
            gel.press(depth)
            gel.set_friction(np.full(gel.points_m.shape[1], MU))
            reaction = gel.trial(15e-6, 5e-6)
            gel.commit()
            forces.append((reaction.force_x_n, reaction.force_y_n, reaction.normal_n))
            used.add((solver, gel._patch.solver))
        found[solver] = np.array(forces)
    assert used == {("auto", "blocks"), ("auto", "fft"), ("blocks", "blocks")}
    assert np.abs(found["auto"] - found["blocks"]).max() < 4e-3 * found["blocks"].max()


def test_many_blocks_are_gathered_a_portion_at_a_time(monkeypatch):
    monkeypatch.setattr(choice, "ENTRIES_AT_ONCE", 400)
    op = answer()
    patch, whole = AnyPatch(op), Patch(op)
    cells = rectangle(op.grid, 5, 5, 6, 8)
    patch.add(cells)
    assert patch.solver == "fft"
    gathered = [patch.gathered]
    traction, w, slid = rest(48)
    kept = np.arange(48) % 7 > 0
    for step in range(20):
        if patch.solver == "blocks":
            break
        if step == 2:
            patch.keep(kept)
            traction, w, slid = rest(patch.size)
        target, friction = np.zeros_like(traction), np.full(patch.size, MU, np.float32)
        target[2] = 1e-4
        assert patch.relax(traction, w, target, friction, slid, 1e-3, SWEEPS) >= 0
        gathered.append(patch.gathered)
    assert patch.solver == "blocks"
    assert max(np.diff(gathered)) <= 400
    whole.add(cells[kept])
    compare(whole, patch, np.random.default_rng(0))


def test_a_patch_that_need_not_be_ready_gathers_nothing():
    patch = AnyPatch(answer())
    patch.grows = False
    patch.add(np.arange(300, dtype=np.int32))
    traction, w, slid = rest(300)
    target, friction = np.full((3, 300), 1e-4, np.float32), np.full(300, MU, np.float32)
    for _ in range(3):
        patch.relax(traction, w, target, friction, slid, 1e-2, SWEEPS)
    assert (patch.solver, patch.gathered) == ("fft", 0)


@pytest.mark.parametrize("name", SCENES)
def test_a_gel_solved_in_portions_gets_where_it_would_at_once(name):
    shape, depth, fine = SCENES[name]
    found = []
    for portions in (False, True):
        gel = FieldGel(shape, fine=fine, tolerance=2e-3)
        gel.solve_in_portions(portions)
        calls = 0
        for motion in ((0.0, 0.0), (40e-6, 10e-6), (-20e-6, 30e-6)):
            gel.stand(depth)
            gel.set_friction(np.full(gel.points_m.shape[1], MU))
            gel.trial(*motion)
            while not gel.solve_on():
                calls += 1
                assert calls < 500
            gel.commit()
        state = gel.state()
        found.append(np.concatenate([state.shear_n, state.pressure_n[None]]).sum(axis=1))
        assert calls == 0 or portions
    assert np.abs(found[1] - found[0]).max() < 1e-3 * found[0].max()
