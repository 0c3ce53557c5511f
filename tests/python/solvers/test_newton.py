"""Newton's method, its settings, load steps, and what failures say."""

import gc

from petsc4py import PETSc

import numpy as np
import pytest
from load_paths import blocks, divisions, exact, top_moves
from problems import CELLS_2D, DIMENSION, SOLVERS, build, fix, tolerate, worst
from squeezing import homogeneous, squeeze

from raymortar import (
    AugmentedLagrangian,
    ContactError,
    ConvergenceError,
    LoadSteps,
    SNESSolver,
)
from raymortar.diagnose.trouble import cycle_length

MAX_ITERATIONS = 8


def pressed(V, scene, share=0.2):
    """Bottom and top held fast, the top pushed down by a share of the height."""
    dim = scene.mesh.geometry.dim
    down = fix(V, scene, "top", value=lambda x: -share * x[:, -1:] * np.eye(dim)[-1])
    return [fix(V, scene, "bottom"), down]


def punch(cell, degree=1, method=None, share=0.1, **options):
    """A stiff narrow block pressed into a soft one: nothing is homogeneous."""
    return build(
        blocks(cell, upper_size=(0.6,) * DIMENSION[cell]),
        degree,
        "neo-hookean",
        method,
        E={"lower": 2000.0, "upper": 8000.0},
        bcs=lambda V, scene: pressed(V, scene, share),
        **options,
    )


def show(history):
    print(", ".join(f"{r:.2e}" for r in history))


# Convergence


@pytest.mark.mpi(
    where=lambda cell, degree, **_: degree == 1 and cell in ("triangle", "hexahedron")
)
@pytest.mark.quick
@pytest.mark.parametrize("measure", ["reference", "current"])
@pytest.mark.parametrize("degree", [1, 2])
def test_residual_drops_quadratically(cell, degree, measure):
    problem, _, _ = squeeze(blocks(cell), degree, measure=measure)
    iterations = problem.solve()
    show(problem.history)
    assert iterations <= MAX_ITERATIONS
    r = np.array(problem.history) / problem.history[0]
    rounding = 100 * problem.problem.residual_floor() / problem.history[0]
    quadratic = 0
    for before, after in zip(r, r[1:]):
        if before < 0.1 and after > rounding:
            assert after <= 10 * before**2
            quadratic += 1
    assert quadratic >= 2


@pytest.mark.mpi(
    where=lambda cell, degree: degree == 1 and cell in ("triangle", "tetrahedron")
)
@pytest.mark.parametrize("degree", [1, 2])
def test_large_step_converges_in_one_solve(cell, degree):
    # The slave's modulus over its cells. The automatic coefficient, a fifth of it, takes
    # one iteration more on triangles, where convergence is linear: see docs/theory, 3
    gamma = 8000.0 / 0.6 * divisions(cell)[1]
    problem = punch(cell, degree, AugmentedLagrangian(gamma), share=0.2)
    iterations = problem.solve()
    show(problem.history)
    assert iterations <= MAX_ITERATIONS


@pytest.mark.mpi(where=lambda cell, options: cell in CELLS_2D)
@pytest.mark.parametrize("options", [{}, {"snes_linesearch_type": "bt"}])
def test_solvers_agree(cell, options):
    newton, snes = punch(cell), punch(cell)
    counts = newton.solve(), snes.solve(SNESSolver, options)
    show(newton.history)
    show(snes.history)
    assert max(counts) <= MAX_ITERATIONS
    difference = worst(newton.u.x.array - snes.u.x.array)
    assert difference <= 1e-8 * worst(newton.u.x.array)
    lam = [p.slave_multiplier() for p in (newton, snes)]
    assert worst(lam[0] - lam[1]) <= 1e-8 * worst(lam[0])


@pytest.mark.mpi(
    where=lambda cell, multiplier: (cell, multiplier) == ("triangle", "vector")
)
@pytest.mark.parametrize("multiplier", ["normal", "vector"])
def test_units_do_not_matter(cell, multiplier):
    force, length = 1e6, 1e-3
    found = []
    for stiffness, size in [(1.0, 1.0), (force, 1.0), (1.0, length), (force, length)]:
        dim = DIMENSION[cell]
        sizes = {"lower_size": (size,) * dim, "upper_size": (0.6 * size,) * dim}
        problem = build(
            blocks(cell, **sizes),
            material="neo-hookean",
            method=AugmentedLagrangian(multiplier=multiplier),
            E=2000.0 * stiffness,
            bcs=pressed,
        )
        iterations = problem.solve()
        show(problem.history)
        found.append(
            (
                iterations,
                problem.gradient(),
                problem.slave_multiplier() / stiffness,
            )
        )
    first = found[0]
    for other in found[1:]:
        assert other[0] == first[0]
        assert worst(other[1] - first[1]) <= 1e-8
        assert worst(other[2] - first[2]) <= 1e-8 * worst(first[2])


# Load steps


@pytest.mark.mpi(where=lambda cell, **_: cell == "hexahedron")
@pytest.mark.parametrize("solver", SOLVERS)
def test_load_steps_reach_the_end(cell, solver):
    problem, steps = top_moves(cell, solver)
    path = steps.run()
    assert [step.factor for step in path] == [0.25, 0.5, 0.75, 1.0]
    assert all(0 < step.iterations <= MAX_ITERATIONS for step in path)
    assert steps.halvings == 0
    assert exact(problem)


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_faults_of_a_tangent_are_not_taken_for_divergence(solver, monkeypatch):
    problem = squeeze(blocks("quadrilateral"), 1)[0].problem

    def refuse(*_):
        raise ContactError("the tangent has a fault")

    monkeypatch.setattr(problem, "J", refuse)
    with pytest.raises(ContactError, match="^the tangent has a fault$"):
        solver(problem).solve()


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_load_steps_halve_where_newton_fails(cell_2d, solver):
    problem, steps = top_moves(cell_2d, solver, steps=1)
    tolerate(problem.solver, max_it=3)
    path = steps.run()
    print(path)
    factors = np.array([0.0] + [step.factor for step in path])
    assert factors[-1] == 1.0 and np.all(np.diff(factors) > 0.0)
    assert steps.halvings > 0 and len(path) > 1
    assert all(step.iterations <= 3 for step in path)
    assert exact(problem)


@pytest.mark.mpi(where=lambda cell, **_: cell in CELLS_2D)
@pytest.mark.parametrize("solver", SOLVERS)
def test_load_steps_survive_inverted_cells(cell, solver):
    # The first trial turns the upper block inside out: ln J is not a number
    problem, steps = top_moves(cell, solver, steps=1, share=1.5, max_halvings=0)
    tolerate(problem.solver, max_it=5)
    before = problem.u.x.array.copy()
    with pytest.raises(ConvergenceError, match="load factor 1 failed.*pairs, .*nan"):
        steps.run()
    assert np.array_equal(problem.u.x.array, before)
    # The solver is as good as new
    problem, steps = problem, LoadSteps(problem.solver, steps.apply, 15)
    tolerate(problem.solver, max_it=25)
    assert next(iter(steps)).factor == 1 / 15


@pytest.mark.mpi
def test_load_steps_give_up_and_restore(cell_2d):
    problem, steps = top_moves(cell_2d, steps=2, max_halvings=2)
    path = iter(steps)
    assert next(path).factor == 0.5
    kept = problem.u.x.array.copy(), problem.contact.multiplier.x.array.copy()
    tolerate(problem.solver, max_it=1)
    with pytest.raises(ConvergenceError, match=r"load factor 0\.625 .* 2 halvings"):
        next(path)
    assert np.array_equal(problem.u.x.array, kept[0])
    assert np.array_equal(problem.contact.multiplier.x.array, kept[1])


@pytest.mark.mpi(where=lambda options, **_: options.get("largest") == 3)
@pytest.mark.quick
@pytest.mark.parametrize(
    "options, sizes",
    [
        ({"largest": 4, "easy": MAX_ITERATIONS}, [1, 1, 2, 4, 2]),
        ({"largest": 3, "easy": MAX_ITERATIONS}, [1, 1, 2, 2, 2, 2]),
        ({"largest": 4, "easy": 0}, [1] * 10),
        ({}, [1] * 10),
    ],
)
def test_load_steps_grow_after_easy_ones(options, sizes):
    problem, steps = top_moves("quadrilateral", steps=10, **options)
    factors = [step.factor for step in steps]
    np.testing.assert_allclose(factors, np.cumsum(sizes) / 10, rtol=1e-14)
    assert factors[-1] == 1.0 and steps.halvings == 0
    assert exact(problem)


@pytest.mark.mpi
def test_grown_steps_that_fail_are_halved():
    options = {"steps": 16, "share": 0.3, "largest": 16, "extrapolate": False}
    problem, steps = top_moves("quadrilateral", **options)
    tolerate(problem.solver, max_it=3)
    factors = [step.factor for step in steps]
    assert factors == [1 / 16, 1 / 8, 1 / 4, 1 / 2, 3 / 4, 1.0]
    assert steps.halvings == 1
    F = homogeneous(2, share=0.3)
    assert worst(problem.gradient() + np.eye(2) - F) <= 1e-8


@pytest.mark.mpi
@pytest.mark.parametrize(
    "options", [{"steps": 0}, {"max_halvings": -1}, {"largest": 0.5}]
)
def test_load_steps_refuse_nonsense(options):
    with pytest.raises(ContactError, match="must be (positive|at least 1)"):
        top_moves("triangle", **options)


# Failures


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_failure_says_what_contact_looked_like(cell_2d, solver):
    problem = punch(cell_2d)
    problem.solver = solver(problem.problem)
    tolerate(problem.solver, max_it=2)
    with pytest.raises(ConvergenceError) as failure:
        problem.solve()
    message = str(failure.value)
    print(message)
    assert "did not converge after 2 iterations" in message
    statistics = problem.contact.statistics
    for text in (
        f"{statistics.pairs} pairs",
        f"{statistics.active_points} active",
        f"gap {statistics.min_gap:.3e} to {statistics.max_gap:.3e}",
        "residual history: " + ", ".join(f"{r:.3e}" for r in problem.history),
    ):
        assert text in message
    assert len(problem.history) == 3


CYCLE = [1.9, 0.25, 0.6]


@pytest.mark.parametrize(
    "history, length",
    [
        ([5.0, 0.1] + 3 * CYCLE[:2], 2),
        ([5.0, 0.1] + 3 * CYCLE, 3),
        (3 * [1.0, 1.004 * 0.25, 1.0, 0.25], 2),
        (3 * [1.0, 1.1 * 0.25, 1.0, 0.25], 4),
        ([5.0, 0.1] + 2 * CYCLE, 0),  # too few to tell
        (12 * [0.3], 0),  # a line search that finds no descent
        ([0.5**k for k in range(12)], 0),  # linear convergence
        ([1.0, 0.1, 2.0, np.nan, 2.0, np.nan, 2.0, np.nan], 0),
    ],
)
def test_cycles_are_told_from_other_histories(history, length):
    assert cycle_length(history) == length


@pytest.mark.mpi
def test_solvers_leave_no_options_behind(cell_2d):
    # PETSc holds 512 options and refuses the next one
    def count():
        gc.collect()
        return len(PETSc.Options().getAll())

    before, seen = count(), []
    for solver in SOLVERS:
        problem = punch(cell_2d)
        residual, problem.problem.F = problem.problem.F, lambda *a: (
            seen.append(count()),
            residual(*a),
        )
        problem.solve(solver)
        # There while it solves, as MUMPS reads its own then
        assert seen.pop() > before == count()
        del problem, residual
        assert count() == before
