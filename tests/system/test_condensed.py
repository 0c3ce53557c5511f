"""Dual multipliers condensed: a problem in the user's unknowns, the same steps."""

from __future__ import annotations

from functools import partial

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import pytest
from condensing import (
    DUAL,
    cantilever,
    indented,
    iterates,
    newton,
    pressed,
    taylor_order,
)
from interacting import LOWER, UPPER, difference, three
from problems import COMM, fix

from raymortar import (
    AugmentedLagrangian,
    CondensedProblem,
    Contact,
    ContactError,
    Coulomb,
    NewtonSolver,
    SNESSolver,
    rigid,
)
from raymortar.core import compat
from raymortar.core.errors import SetUpError

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


def require_the_same_path(one, other):
    """The coupled problem of one and the condensed one of the other take the same steps,
    the last of them with order two."""
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


@pytest.mark.mpi(where=lambda cell, **_: cell in ("quadrilateral", "tetrahedron"))
@pytest.mark.parametrize("cell, degree, mu, overhang", CASES)
def test_condensed_is_uncondensed(cell, degree, mu, overhang):
    one, other = (pressed(cell, degree, mu, overhang=overhang) for _ in range(2))
    require_the_same_path(one, other)


@pytest.mark.mpi
def test_several_contacts_condensed():
    """Two contacts of a stack are one system, of which each has its multiplier."""
    found = []
    for is_condensed in (False, True):
        stack = three()
        contacts = [
            stack.contact(pair, method=DUAL, friction=Coulomb(mu))
            for pair, mu in ((LOWER, 0.3), (UPPER, 0.1))
        ]
        if is_condensed:
            problem = CondensedProblem(stack.F, stack.u, contacts, stack.bcs)
        else:
            solver = SNESSolver(stack.problem(contacts), {"snes_rtol": 1e-13})
        for t in (0.5, 1.0):
            stack.move(t)
            if is_condensed:
                newton(problem)
            else:
                solver.solve()
            for contact in contacts:
                contact.advance()
        found.append((stack.u, *(one.multiplier for one in contacts)))
    for one, known in zip(*reversed(found)):
        assert difference(one, known) <= 1e-9


@pytest.mark.parametrize("cell, degree", [("triangle", 1), ("tetrahedron", 1)])
def test_elastic_slip_condensed(cell, degree):
    """The same steps and order two where friction gives a part of the slip back."""
    law = Coulomb(0.3, elastic_slip=0.01)
    one, other = (pressed(cell, degree, law=law, overhang=0.3) for _ in range(2))
    require_the_same_path(one, other)


def bent():
    """The cantilever, loaded so that its first iterate is far below the plane."""
    beam = cantilever()
    beam.load.value[-1] = -2.0
    return beam


def dragged(cell, degree, mu, overhang):
    """Blocks that one large step presses and drags."""
    blocks = pressed(cell, degree, mu, overhang=overhang)
    blocks.load.value[-1], blocks.load.value[0] = -0.06, 0.05
    return blocks


SCENES = [bent, *(partial(dragged, *case) for case in CASES)]


@pytest.mark.mpi(where=lambda scene, **_: scene in (SCENES[0], SCENES[1], SCENES[4]))
@pytest.mark.parametrize("share", [1.0, 0.6])
@pytest.mark.parametrize("scene", SCENES)
def test_iterates_are_those_of_the_coupled_system(scene, share):
    """Far from balance, with rims within facets, of whole and of damped steps."""
    one, other = scene(), scene()
    expected = iterates(one.coupled(), share)
    found = iterates(other.condensed(), share)
    size = COMM.allreduce(max(np.abs(e).max(initial=0.0) for e in expected), MPI.MAX)
    for f, e in zip(found, expected):
        np.testing.assert_allclose(f, e, atol=1e-9 * size)
    assert size > 0.05


@pytest.mark.parametrize("kind", [NewtonSolver, SNESSolver])
def test_solvers_of_raymortar_say_where_condensed_equations_go(kind):
    problem = pressed("triangle", 1, None).condensed()
    with pytest.raises(ContactError, match=r"not CondensedProblem: problem\.attach"):
        kind(problem)


@pytest.mark.skipif(compat.newton_solver_class() is None, reason="it is gone")
@pytest.mark.mpi
def test_dolfinx_newton_solver_bends_a_cantilever_as_the_coupled_solver_does():
    from dolfinx.nls.petsc import NewtonSolver as OfDolfinx

    known, beam = cantilever(), cantilever()
    coupled, solver = NewtonSolver(known.coupled()), OfDolfinx(COMM, beam.condensed())
    solver.convergence_criterion, solver.rtol, solver.atol = "incremental", 1e-6, 1e-11
    for k, most in enumerate((15, 4, 4, 8, 5), 1):
        known.load.value[-1] = beam.load.value[-1] = -2.0 * k
        coupled.solve()
        iterations, _ = solver.solve(beam.u)
        assert iterations <= most
        np.testing.assert_allclose(beam.u.x.array, known.u.x.array, atol=1e-9)
        found, expected = (one.contact.resultant().force for one in (beam, known))
        np.testing.assert_allclose(found, expected, atol=1e-6 * abs(expected[-1]))
        for one in (known, beam):
            one.contact.advance()


@pytest.mark.parametrize("search", ["basic", "l2"])
def test_snes_bends_a_cantilever(search):
    """(With "bt" neither the coupled problem does: all steps are far too short.)"""
    beam = cantilever()
    problem, snes = beam.condensed(), PETSc.SNES().create(COMM)
    problem.attach(snes)
    snes.getKSP().setType("preonly")
    snes.getKSP().getPC().setType("lu")
    snes.getKSP().getPC().setFactorSolverType("mumps")
    snes.setOptionsPrefix(f"cantilever_{search}_")
    options = PETSc.Options(snes.getOptionsPrefix())
    options["snes_linesearch_type"] = search
    snes.setFromOptions()
    x = problem.create_vector()
    for k in range(1, 6):
        beam.load.value[-1] = -2.0 * k
        snes.solve(None, x)
        assert snes.getConvergedReason() > 0
        beam.contact.advance()
    assert beam.contact.resultant().force[-1] == pytest.approx(39.5132, abs=1e-4)


@pytest.mark.mpi
def test_results_are_in_balance_where_rows_vanish_without():
    """One cell on a plane: every row of a free node is the law's, and its multipliers
    alone know that the first step is not in balance."""
    blocks = pressed("quadrilateral", 1, None, divisions=(1, 1), lower=1.0)
    problem = blocks.condensed()
    blocks.load.value[-1] = -0.1
    newton(problem, rtol=1e-6)
    force = blocks.contact.resultant().force
    support = problem.reactions({"top": blocks.bcs[1]})["top"]
    np.testing.assert_allclose(force, -support, atol=1e-6 * np.abs(support).max())


@pytest.mark.mpi
def test_a_solve_after_one_that_failed_begins_at_the_restored_state():
    blocks = pressed("triangle", 1, 0.3)
    problem, contact = blocks.condensed(), blocks.contact
    begin = contact.state()
    blocks.load.value[-1] = -3.0  # cells turn inside out: the logarithm has no value
    with pytest.raises(ContactError, match="not finite"):
        newton(problem)
    contact.restore(begin)
    blocks.load.value[-1] = -0.03
    norms = newton(problem)
    assert len(norms) <= 9 and norms[-1] <= 1e-9 * norms[0]


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
@pytest.mark.quick  # patterns change, of which PETSc 3.22 has to be told
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
@pytest.mark.parametrize("search", ["basic", "bt", "l2"])
def test_snes_solves_it(search):
    blocks = pressed("triangle", 1, 0.3)
    problem = blocks.condensed()
    snes = PETSc.SNES().create(COMM)
    snes.setOptionsPrefix(f"dragged_{search}_")
    PETSc.Options(snes.getOptionsPrefix())["snes_linesearch_type"] = search
    snes.setFromOptions()
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
    for force in (pair.force[1] for pair in one.contact.results.resultants()):
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
