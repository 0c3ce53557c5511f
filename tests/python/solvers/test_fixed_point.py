"""Fixed point on the pairing against Newton's method on everything."""

import numpy as np
import pytest
from problems import COMM, SOLVERS, build, fix, stack, worst
from squeezing import squeezed

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, ConvergenceError, Coulomb, FixedPointSolver


def curved_blocks():
    """Blocks whose interface is an arc, with unrelated nodes."""
    return two_blocks(
        COMM,
        lower_divisions=(9, 3),
        upper_divisions=(7, 3),
        upper_size=(0.6, 0.5),
        interface=lambda x: 1.0 + 0.3 * (x[:, 0] - 0.5) ** 2,
    )


def pushed(V, scene):
    """The upper block is pushed down and along the arc."""
    return [
        fix(V, scene, "bottom"),
        fix(V, scene, "top", 0, 0.03),
        fix(V, scene, "top", 1, -0.02),
    ]


def solved(solver, friction=None):
    case = build(curved_blocks(), material="neo-hookean", bcs=pushed, friction=friction)
    solve = solver(case.problem)
    return case, solve, solve.solve()[0]


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("inner", SOLVERS)
@pytest.mark.parametrize("friction", [None, Coulomb(0.2)])
def test_ends_where_newton_ends(inner, friction):
    newton, *_ = solved(inner, friction)
    held, solver, iterations = solved(lambda p: FixedPointSolver(inner(p)), friction)
    scale = worst(newton.u.x.array)
    assert worst(held.u.x.array - newton.u.x.array) < 1e-8 * scale
    pressure = newton.slave_multiplier()
    assert worst(held.slave_multiplier() - pressure) < 1e-6 * worst(pressure)
    # The pairing of the start was not the one of the end
    assert 3 <= len(solver.residuals) <= solver.max_outer + 1
    assert iterations >= len(solver.residuals) - 1
    assert solver.residuals[-1] <= 1e-10 * solver.residuals[0]


@pytest.mark.mpi
def test_one_pairing_where_no_facet_moves_along_another():
    case = build(stack("triangle", (3, 4)), bcs=squeezed)
    solver = FixedPointSolver(SOLVERS[-1](case.problem))
    solver.solve()
    assert len(solver.residuals) == 2


@pytest.mark.mpi
def test_inner_iterations_keep_the_points():
    case = build(curved_blocks(), material="neo-hookean", bcs=pushed)
    solver = FixedPointSolver(SOLVERS[-1](case.problem))
    seen, take = [], case.contact.take

    def watch(x, anew, rays_only):
        is_new = take(x, anew, rays_only)
        if is_new:
            seen.append((rays_only, case.contact.points()["xi"]))
        return is_new

    case.contact.take = watch
    solver.solve()
    kept = [rays_only for rays_only, _ in seen]
    assert kept.count(False) == len(solver.residuals) and True in kept
    for (_, before), (rays_only, after) in zip(seen, seen[1:]):
        assert not rays_only or np.array_equal(before, after)


@pytest.mark.mpi
def test_a_pairing_that_does_not_settle_is_an_error():
    case = build(curved_blocks(), material="neo-hookean", bcs=pushed)
    inner = SOLVERS[-1](case.problem)
    tolerances = inner.tolerances
    with pytest.raises(ConvergenceError, match="not settled after 1 pairings"):
        FixedPointSolver(inner, max_outer=1).solve()
    assert not case.problem.rays_only
    assert inner.tolerances == tolerances


@pytest.mark.mpi
def test_drives_load_steps():
    case = build(stack("triangle", (3, 4)), bcs=None, method=AugmentedLagrangian(1e3))
    case.problem.bcs.extend(squeezed(case.u.function_space, case.scene))
    solver = FixedPointSolver(SOLVERS[-1](case.problem))
    steps = raymortar.LoadSteps(solver, lambda t: None, steps=2).run()
    assert [step.factor for step in steps] == [0.5, 1.0]


@pytest.mark.mpi
def test_arguments_are_checked():
    case = build(stack("triangle", (1, 2)))
    with pytest.raises(raymortar.ContactError, match="solver must be"):
        FixedPointSolver(case.problem)
    with pytest.raises(raymortar.ContactError, match="max_outer"):
        FixedPointSolver(SOLVERS[-1](case.problem), max_outer=0)
