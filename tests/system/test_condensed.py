"""Dual multipliers condensed: a problem in the user's unknowns, the same steps."""

from __future__ import annotations

from functools import partial

from petsc4py import PETSc

import numpy as np
import pytest
from condensing import DUAL, indented, newton, pressed, taylor_order
from problems import COMM, fix

from raymortar import (
    AugmentedLagrangian,
    CondensedProblem,
    Contact,
    ContactError,
    SetUpError,
    SNESSolver,
    compat,
    rigid,
)

# Down and aside, shares of the height
PATH = ((0.03, 0.0), (0.06, 0.0), (0.06, 0.02), (0.06, 0.05))
CASES = [
    ("triangle", 1, 0.3, 0.3),
    ("quadrilateral", 1, None, 0.0),
    ("quadrilateral", 2, 0.3, 0.3),
    ("tetrahedron", 1, 0.2, 0.0),
    ("hexahedron", 1, None, 0.3),
    ("tetrahedron", 2, 0.2, 0.0),
]


def path(problem, solve):
    """Follow the path; displacement and multiplier of each step."""
    found = []
    for down, aside in PATH:
        problem.load.value[-1], problem.load.value[0] = -down, aside
        solve()
        problem.contact.advance()
        u, lam = problem.u, problem.contact.multiplier
        found.append((u.x.array.copy(), lam.x.array.copy()))
    return found


@pytest.mark.mpi(where=lambda cell, **_: cell in ("quadrilateral", "tetrahedron"))
@pytest.mark.parametrize("cell, degree, mu, overhang", CASES)
def test_condensed_is_uncondensed(cell, degree, mu, overhang):
    one, other = (pressed(cell, degree, mu, overhang=overhang) for _ in range(2))
    solver = SNESSolver(one.coupled())
    solver.snes.setTolerances(rtol=1e-13)
    expected = path(one, solver.solve)
    condensed, norms = other.condensed(), []
    found = path(other, lambda: norms.append(newton(condensed)))
    for (u, lam), (u_known, lam_known) in zip(found, expected):
        np.testing.assert_allclose(u, u_known, atol=1e-11)
        size = np.abs(lam_known).max()
        np.testing.assert_allclose(lam, lam_known, atol=1e-9 * size)
    # Quadratic: once the set of closed nodes stays, the order is two
    last = np.array(norms[-1])
    assert last[-1] <= 1e-9 * last[0] and len(last) <= 9, last


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell, degree, mu, overhang", CASES)
def test_tangent_is_the_derivative(cell, degree, mu, overhang):
    """At a state that is not converged, with facets beyond the rim."""
    blocks = pressed(cell, degree, mu, overhang=overhang)
    problem = blocks.condensed()
    blocks.load.value[-1] = -0.03
    newton(problem)
    blocks.contact.advance()
    # Not in balance, and all gaps open or closed by more than steps
    order, rest = taylor_order(problem, aside=2e-4)
    assert abs(order - 2.0) < 0.1, rest


@pytest.mark.skipif(compat.newton_solver_class() is None, reason="it is gone")
@pytest.mark.mpi
@pytest.mark.parametrize("cell, mu", [("quadrilateral", 0.3), ("tetrahedron", None)])
def test_dolfinx_newton_solver_solves_it(cell, mu):
    from dolfinx.nls.petsc import NewtonSolver

    blocks = pressed(cell, 1, mu)
    problem = blocks.condensed()
    solver = NewtonSolver(COMM, problem)
    solver.convergence_criterion, solver.rtol, solver.atol = "residual", 1e-11, 1e-13
    solver.krylov_solver.setType("preonly")
    solver.krylov_solver.getPC().setType("lu")
    solver.krylov_solver.getPC().setFactorSolverType("mumps")
    for down, aside in PATH:
        blocks.load.value[-1], blocks.load.value[0] = -down, aside
        iterations, converged = solver.solve(blocks.u)
        assert converged and iterations <= 9
        blocks.contact.advance()
    force = blocks.contact.resultant().force
    support = problem.reactions({"bottom": blocks.bcs[0]})["bottom"]
    np.testing.assert_allclose(force, support, atol=1e-9)
    assert force[-1] > 0.01


@pytest.mark.skipif(compat.newton_solver_class() is None, reason="it is gone")
@pytest.mark.mpi
def test_dolfinx_newton_solver_slides_small_blocks_with_an_atol_of_their_size():
    """Blocks of 1 um in steps of 1 pm, by the settings of the page: DOLFINx's own
    atol of 1e-10 is above all of these, and none never ends where nothing changes."""
    from dolfinx.nls.petsc import NewtonSolver

    size, d = 1e-6, 1e-12
    found = []
    for is_condensed in (True, False):
        blocks = pressed("quadrilateral", 1, 0.3, lower=1.3 * size, upper=size)
        if is_condensed:
            solver = NewtonSolver(COMM, blocks.condensed())
            solver.convergence_criterion, solver.rtol = "incremental", 1e-9
            solver.atol = 1e-12 * size
            solve = partial(solver.solve, blocks.u)
        else:
            solve = SNESSolver(blocks.coupled()).solve
        for aside, down in ((0.0, d), (4.0 * d, d), (-4.0 * d, 1.2 * d)):
            blocks.load.value[:] = aside, -down
            solve()
            blocks.contact.advance()
        solve()  # ends at once
        found.append(blocks.contact.resultant().force)
    np.testing.assert_allclose(*found, rtol=1e-6)
    assert abs(found[0][0] / found[0][1]) == pytest.approx(0.3, rel=1e-4)


@pytest.mark.mpi
def test_snes_solves_it():
    blocks = pressed("triangle", 1, 0.3)
    problem = blocks.condensed()
    snes = PETSc.SNES().create(COMM)
    snes.setTolerances(rtol=1e-11)
    problem.attach(snes)
    snes.getKSP().setType("preonly")
    snes.getKSP().getPC().setType("lu")
    snes.getKSP().getPC().setFactorSolverType("mumps")
    x = problem.create_vector()
    for down, aside in PATH:
        blocks.load.value[-1], blocks.load.value[0] = -down, aside
        snes.solve(None, x)
        assert snes.getConvergedReason() > 0 and snes.getIterationNumber() <= 9
        blocks.contact.advance()
    known = pressed("triangle", 1, 0.3)
    expected = path(known, SNESSolver(known.coupled()).solve)[-1][0]
    np.testing.assert_allclose(blocks.u.x.array, expected, atol=1e-9)


@pytest.mark.parametrize(
    "degree, mu, tools",
    [
        (1, 0.3, {}),
        (2, None, {}),
        (1, 0.3, {"centres": (0.25, 0.75), "radius": 0.4}),
    ],
    ids=["degree 1", "degree 2", "two masters"],
)
def test_rigid_tools(degree, mu, tools):
    """Circles leave some nodes uncovered, and slide on."""
    (one, first), (other, second) = (indented(degree, mu, **tools) for _ in range(2))
    solver, condensed = SNESSolver(one.coupled()), other.condensed()
    solver.snes.setTolerances(rtol=1e-13)
    for down, aside in ((0.03, 0.0), (0.06, 0.0), (0.06, 0.004)):
        for tip in (*first, *second):
            tip.move((aside, -down))
        solver.solve()
        assert len(newton(condensed)) <= 12
        np.testing.assert_allclose(other.u.x.array, one.u.x.array, atol=1e-11)
        for blocks in (one, other):
            blocks.contact.advance()
    for force in (pair.force[1] for pair in one.contact.resultants()):
        assert force < -0.03 / len(first)


def test_slave_nodes_that_are_held():
    """A pressure that is uniform stays so where conditions hold the slave's ends."""
    blocks = pressed("quadrilateral", 1, None, "linear", lower=1.0)
    V = blocks.u.function_space
    sides = ["lower_left", "lower_right", "upper_left", "upper_right"]
    rollers = [fix(V, blocks.scene, side, 0) for side in sides]
    problem = CondensedProblem(
        blocks.F, blocks.u, blocks.contact, [*blocks.bcs, *rollers]
    )
    blocks.load.value[-1] = -0.01
    newton(problem)
    lam = blocks.contact.multiplier.x.array.reshape(-1, 2)
    lam = lam[blocks.contact.zones[0].multiplier_nodes]
    assert lam[0, 1] > 0.01
    np.testing.assert_allclose(lam[:, 1], lam[0, 1], rtol=1e-10)


def test_contacts_that_it_refuses():
    blocks = pressed("triangle", 1, 0.3)
    tags = blocks.contact.pairs[0]
    pairs = [(tags.slave, tags.master)]
    for method in (None, AugmentedLagrangian(condition="nodes")):
        other = Contact(blocks.u, blocks.scene.facet_tags, pairs, method)
        with pytest.raises(ContactError, match="multiplier='dual'"):
            CondensedProblem(blocks.F, blocks.u, other, blocks.bcs)
    with pytest.raises(ContactError, match="what F solves for"):
        CondensedProblem(blocks.F, blocks.contact.multiplier, blocks.contact)
    ball = rigid.Body(rigid.Circle((0.5, -3.0), 1.0), free=("y",), force=(0.0, 0.0))
    free = Contact(blocks.u, blocks.scene.facet_tags, [(pairs[0][0], ball)], DUAL)
    with pytest.raises(ContactError, match="free"):
        CondensedProblem(blocks.F, blocks.u, free, blocks.bcs)
    with pytest.raises(ContactError, match="condition='nodes'"):
        Contact(
            blocks.u,
            blocks.scene.facet_tags,
            pairs,
            AugmentedLagrangian(multiplier="dual"),
        )


def test_an_offset_with_friction_is_refused():
    blocks = pressed("triangle", 1, 0.3, offset=0.01)
    problem = blocks.condensed()
    x, b = problem.create_vector(), problem.create_vector()
    with pytest.raises(SetUpError, match="offset with friction"):
        problem.F(x, b)
