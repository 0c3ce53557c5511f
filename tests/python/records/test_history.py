"""Histories of forces and energies: closed forms, balances, files, restarts."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import ufl
from load_paths import blocks, top_moves
from materials import MATERIALS, lame, neo_hookean_energy
from problems import COMM, DIMENSION
from sheared_blocks import METHODS, WIDTH, Blocks, clamped, limit_of, pressure
from squeezing import homogeneous, squeeze

from raymortar import ContactError, Coulomb, History

STEPS = 4


def energy_of(problem):
    """Stored energy of the neo-Hookean bodies, UFL."""
    F = ufl.Identity(problem.dim) + ufl.grad(problem.u)
    return neo_hookean_energy(F, *problem.moduli) * ufl.dx(
        metadata={"quadrature_degree": 3}
    )


def with_history(file=None, cell="quadrilateral", **options):
    """The compression A3 in load steps, with a history of top and bottom."""
    problem, steps = top_moves(cell, steps=STEPS, **options)
    *_, bottom, top = problem.problem.bcs
    supports = {"bottom": bottom, "top": [top]}
    steps.history = History(problem.problem, file, supports, energy_of(problem))
    return problem, steps


# Closed forms and balances


@pytest.mark.mpi
@pytest.mark.quick
def test_uniform_compression_has_the_closed_form_at_every_step(cell):
    """Forces are the nominal stress on an area of 1, energy its density times 2."""
    problem, steps = with_history(cell=cell)
    path, dim = steps.run(), DIMENSION[cell]
    history, axis = steps.history, "xyz"[DIMENSION[cell] - 1]
    assert np.array_equal(history["time"], [step.factor for step in path])
    assert np.array_equal(history["iterations"], [step.iterations for step in path])
    for row in history.rows:
        F = homogeneous(dim, share=0.2 * row.time)
        P = MATERIALS["neo-hookean"][1](F - np.eye(dim), *lame(2000.0, 0.3))[-1, -1]
        assert getattr(row, f"force_0_{axis}") == pytest.approx(-P, rel=1e-8)
        assert getattr(row, f"reaction_top_{axis}") == pytest.approx(P, rel=1e-8)
        assert getattr(row, f"reaction_bottom_{axis}") == pytest.approx(-P, rel=1e-8)
        assert row.max_pressure == pytest.approx(-P, rel=1e-6)
        mu, lmbda = lame(2000.0, 0.3)
        J = np.linalg.det(F)
        density = mu / 2 * (np.sum(F**2) - dim - 2 * np.log(J))
        density += lmbda / 2 * np.log(J) ** 2
        assert row.energy == pytest.approx(2.0 * density, rel=1e-8)
    assert "friction_work" not in history.columns


@pytest.mark.mpi
def test_reactions_of_all_supports_are_in_balance(cell_2d):
    """Supports share nodes with the slave surface: contact has its part in them."""
    problem, F, P = squeeze(blocks(cell_2d))
    problem.solve()
    assert len(problem.problem.bcs) == 4  # each side of each block, bottom, top
    found = problem.problem.reactions(
        {str(k): bc for k, bc in enumerate(problem.problem.bcs)}
    )
    total = np.sum(list(found.values()), axis=0)
    assert np.abs(total).max() <= 1e-9 * abs(P[-1, -1])
    sides = found["0"][0] + found["1"][0]
    assert abs(sides) <= 1e-9 * abs(P[-1, -1])


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
@pytest.mark.parametrize("method", METHODS)
def test_work_of_friction_is_the_bound_times_the_slide(cell, method):
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.3))
    history = History(blocks.problem.problem)
    blocks.press()
    k, slides = limit_of(Coulomb(0.3), blocks.dim), (0.05, 0.15, 0.3)
    # Springs are bent first, which takes work too
    spring = blocks.spring(k)
    for slide in slides:
        blocks.step(k, spring + slide)
        history.record(slide)
        blocks.contact.advance()
    bound = 0.3 * -pressure(blocks.dim) * WIDTH ** (blocks.dim - 1)
    work = np.diff(history["friction_work"])
    np.testing.assert_allclose(work, bound * np.diff(slides), rtol=1e-7)
    assert np.all(history["tangential_0_x"] < 0.0)
    whole = history.vectors("normal_0") + history.vectors("tangential_0")
    np.testing.assert_allclose(history.vectors("force_0"), whole, atol=1e-12 * bound)


@pytest.mark.mpi
def test_work_of_the_load_is_stored_or_goes_into_friction():
    """Clamped blocks, pressed and then dragged to and fro: the first law to 2 %.

    The work is that of the support by the trapezoidal rule. Contact conditions hold in
    the mean over four facets and a step, so that a little is gained or lost.
    """
    problem, move = clamped("quadrilateral", METHODS["augmented"](), Coulomb(0.1))
    top = problem.problem.bcs[1]
    history = History(problem.problem, None, {"top": top}, energy_of(problem))
    share = np.linspace(0.0, 1.0, 17)[1:]
    along = 0.15 * np.concatenate([0.0 * share, share, 1.0 - share])
    down = -0.06 * np.concatenate([share, 0.0 * share + 1.0, 0.0 * share + 1.0])
    for time, shift in enumerate(zip(along, down)):
        move(shift)
        problem.solve()
        history.record(time)
        problem.contact.advance()
    moved = np.diff(np.column_stack([along, down]), axis=0, prepend=0.0)
    force = np.vstack([np.zeros(2), history.vectors("reaction_top")])
    work = np.sum(0.5 * (force[1:] + force[:-1]) * moved)
    friction = history["friction_work"]
    assert work == pytest.approx(history["energy"][-1] + friction[-1], rel=0.02)
    assert friction[-1] > 0.4 * work
    # Where the drag turns, points that stick give a little of it back: on facets with
    # points of both kinds the multiplier is no point's own traction
    assert np.all(np.diff(friction) >= -1e-3 * work)


# Files


@pytest.mark.mpi
@pytest.mark.quick
def test_file_has_every_record_to_the_last_digit(folder):
    file = folder / "history.csv"
    steps = with_history(file)[1]
    for done, _ in enumerate(steps, 1):  # each at once
        assert COMM.bcast(len(file.read_text().splitlines()), root=0) == done + 1
    with open(file, newline="", encoding="utf-8") as lines:
        head, *rows = csv.reader(lines)
    assert tuple(head) == steps.history.columns
    assert np.array_equal(np.array(rows, dtype=float), np.array(steps.history.rows))
    table = np.genfromtxt(file, delimiter=",", names=True)
    assert table.dtype.names == steps.history.columns
    assert np.array_equal(table["force_0_y"], steps.history["force_0_y"])


@pytest.mark.mpi
def test_a_run_that_goes_on_leaves_the_file_of_one_that_was_not_cut(folder):
    """The second run starts from the state after two steps; the file has three, and
    the beginning of a fourth."""
    file, whole = folder / "cut.csv", folder / "whole.csv"
    with_history(whole)[1].run()
    problem, steps = with_history(file)
    for k, _ in enumerate(steps, 1):
        if k == 2:
            state = problem.contact.state()
        if k == 3:
            break
    COMM.barrier()
    if COMM.rank == 0:
        file.write_text(file.read_text() + "1.0,4,0,12")
    again, steps = with_history(file)
    again.contact.restore(state)
    steps.history.resume(until=0.5)
    assert len(steps.history) == 2
    steps.path, steps.steps = (0.5, 1.0), STEPS // 2
    steps.run()
    cut, uncut = (np.genfromtxt(f, delimiter=",", names=True) for f in (file, whole))
    for name in set(uncut.dtype.names) - {"iterations"}:
        np.testing.assert_allclose(cut[name], uncut[name], rtol=1e-9, atol=1e-9)


@pytest.mark.mpi
def test_resumed_friction_work_goes_on():
    blocks = Blocks("quadrilateral", METHODS["augmented"](), Coulomb(0.3))
    first, second = (History(blocks.problem.problem) for _ in range(2))
    blocks.press()
    blocks.step(limit_of(Coulomb(0.3), 2), 0.1)
    first.record(0.0)
    second.resume(first.rows)
    second.record(1.0)
    assert second["friction_work"][1] == 2.0 * first["friction_work"][0] > 0.0


@pytest.mark.mpi
def test_files_that_will_not_do_are_refused_on_all_ranks(folder):
    nowhere = folder / "nowhere" / "h.csv"
    with pytest.raises(ContactError, match="nowhere/h.csv cannot be written: there is"):
        with_history(nowhere)
    with pytest.raises(ContactError, match="missing.csv cannot be read"):
        with_history(folder / "missing.csv")[1].history.resume()
    with pytest.raises(ContactError, match="a history without a file"):
        with_history()[1].history.resume()
    other = folder / "other.csv"
    if COMM.rank == 0:
        other.write_text("time,force\n1.0,2.0\n")
    COMM.barrier()
    with pytest.raises(ContactError, match="other.csv has other columns"):
        with_history(other)[1].history.resume()


@pytest.mark.mpi
def test_numbers_of_ones_own_have_their_columns():
    problem, steps = with_history()
    seen = []

    def largest():
        seen.append(COMM.allreduce(np.abs(problem.u.x.array).max(initial=0.0)))
        return seen[-1]

    steps.history = History(problem.problem, more={"largest": largest})
    steps.run()
    assert np.array_equal(steps.history["largest"], seen)
    assert steps.history.columns[-1] == "largest"
