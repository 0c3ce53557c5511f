"""The displacement as a part of a mixed Function, or as one of several Functions."""

from __future__ import annotations

from contextlib import contextmanager
from functools import lru_cache

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import problems
import pytest
import ufl
from dolfinx import fem
from hosts import MU, WAYS
from problems import COMM, SOLVERS, worst

import raymortar
from raymortar import (
    AugmentedLagrangian,
    ContactError,
    Coulomb,
    LoadSteps,
    Penalty,
    compat,
)

PUSHES = ((0.0, -0.03), (0.03, -0.06))
METHODS = {
    "vector": {"friction": Coulomb(0.3)},
    "normal": {},
    "penalty": {"method": Penalty(), "friction": Coulomb(0.3)},
}


def solve(found, solver=SOLVERS[0], pushes=PUSHES):
    """Solve along a path; the iterations of its steps."""
    one, iterations = solver(found.problem), []
    for push in pushes:
        found.push(*push)
        iterations.append(one.solve()[0])
        found.contact.advance()
    return iterations


def differences(a, b):
    """Largest differences of the parts of two solutions, over their sizes."""
    return [worst(x - y) / worst(x) for x, y in zip(a, b)]


# I2: one problem, written in several ways


@lru_cache(maxsize=None)
def solved(way, method, solver=SOLVERS[0]):
    found = hosts.taylor_hood(way, **METHODS[method])
    # Springs that slip want a line search
    solver = SOLVERS[-1] if method == "penalty" else solver
    return found, solve(found, solver)


@pytest.mark.mpi
@pytest.mark.parametrize("method", METHODS)
def test_mixed_and_blocked_give_one_answer(method):
    (mixed, first), (blocked, second) = (solved(way, method) for way in WAYS)
    assert first == second and max(first) <= 12
    assert max(differences(mixed.parts(), blocked.parts())) < 1e-9
    forces = [one.contact.resultant(0).force for one in (mixed, blocked)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("solver", SOLVERS[1:])
def test_both_solvers_give_one_answer(way, solver):
    found, first = solved(way, "vector")
    other, second = solved(way, "vector", solver)
    assert first == second
    assert max(differences(found.parts(), other.parts())) < 1e-9


@contextmanager
def one_rank(monkeypatch):
    """Scenes on this rank alone."""
    with monkeypatch.context() as patch:
        patch.setattr(problems, "COMM", MPI.COMM_SELF)
        patch.setattr(hosts, "COMM", MPI.COMM_SELF)
        yield


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_ranks_give_the_answer_of_one(way, monkeypatch):
    found, iterations = solved(way, "vector")
    parts = found.parts()
    with one_rank(monkeypatch):
        alone = hosts.taylor_hood(way, **METHODS["vector"])
        assert solve(alone) == iterations
        assert max(differences(alone.parts(), parts)) < 1e-12


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron", "hexahedron"])
def test_other_cells(cell):
    answers = []
    for way in WAYS:
        divisions = (3, 2) if cell == "quadrilateral" else (2, 1)
        scene = hosts.blocks(cell, divisions)
        found = hosts.taylor_hood(way, scene=scene, friction=Coulomb(0.3))
        push = [0.0] * scene.mesh.geometry.dim
        push[-1] = -0.03
        assert solve(found, pushes=[push])[0] <= 8
        assert found.contact.resultant(0).force[-1] > 0.1
        answers.append(found.parts())
    assert max(differences(*answers)) < 1e-9


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_the_displacement_has_no_volume_change(way):
    """What the pressure is for: J = 1 + p / kappa in the mean of every body."""
    found, _ = solved(way, "vector")
    u, p = found.collapsed()
    J = ufl.det(ufl.Identity(2) + ufl.grad(u))
    loss = compat.form((J - 1.0 - p / (2000.0 * MU)) * ufl.dx)
    assert abs(COMM.allreduce(fem.assemble_scalar(loss))) < 1e-11


# A problem of the displacement alone, through a host of two


def alone(**options):
    """Elastic blocks without a further unknown."""
    return elastic(None, **options)


def elastic(way, **options):
    """Elastic blocks, and a field that has nothing to do with them."""
    scene = hosts.blocks()
    mesh = scene.mesh
    parts = {"u": ("Lagrange", 1, (2,)), "c": ("Lagrange", 1, ())}
    dx = ufl.dx(metadata={"quadrature_degree": 2})
    top = hosts.moving_top(scene)

    def of_u(u, v):
        F = ufl.Identity(2) + ufl.grad(u)
        J, inverse = ufl.det(F), ufl.inv(F).T
        stress = MU * (F - inverse) + 2.0 * MU * ufl.ln(J) * inverse
        return ufl.inner(stress, ufl.grad(v)) * dx(mesh)

    def residual(unknowns, tests):
        (u, c), (v, q) = unknowns, tests
        of_c = (ufl.inner(ufl.grad(c), ufl.grad(q)) + (c + c**3 - 2.0) * q) * dx(mesh)
        return [of_u(u, v), of_c][: len(parts)]

    if way is None:
        u = fem.Function(compat.space(mesh, *parts["u"]))
        pairs = [(scene.tags["slave"], scene.tags["master"])]
        contact = raymortar.Contact(u, scene.facet_tags, pairs, **options)
        F = of_u(u, ufl.TestFunction(u.function_space))
        bcs = hosts.conditions(u.function_space, scene, top)
        problem = raymortar.NonlinearProblem(F, contact, bcs)
        return hosts.Hosted(scene, contact, problem, [u], top)
    found = hosts.hosted(
        way,
        scene,
        parts,
        residual,
        lambda spaces: hosts.conditions(spaces[0], scene, top),
        **options,
    )
    found.move = top
    return found


@pytest.mark.mpi
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("way", WAYS)
def test_a_field_without_coupling_changes_nothing(way, method):
    plain, other = alone(**METHODS[method]), elastic(way, **METHODS[method])
    gamma = plain.contact.gamma
    assert other.contact.gamma == pytest.approx(gamma, rel=1e-12)
    first, second = solve(plain), solve(other)
    # The field takes its own iterations in the first step
    assert second[1:] == first[1:]
    u, c = other.parts()
    assert worst(u - plain.parts()[0]) < 1e-10 * worst(u)
    assert worst(c - 1.0) < 1e-10
    force = plain.contact.resultant(0).force
    assert other.contact.resultant(0).force == pytest.approx(force, rel=1e-10)


@pytest.mark.mpi
def test_conditions_by_a_function_on_a_part():
    """As DOLFINx has them: dofs of the part, and of the part's own space."""
    first, _ = solved("mixed", "normal")
    found = hosts.taylor_hood("mixed")
    part, scene = found.contact.host.displacements[0].given.function_space, found.scene
    own, _ = part.collapse()
    g = fem.Function(own)
    facets = scene.facet_tags.find(scene.tags["top"])
    dofs = fem.locate_dofs_topological((part, own), 1, facets)
    bcs = [*found.problem.bcs[:2], fem.dirichletbc(g, dofs, part)]
    problem = raymortar.NonlinearProblem(found.problem.forms[0], found.contact, bcs)
    solver = SOLVERS[0](problem)
    for push in PUSHES:
        g.x.array[:] = np.tile(push, len(g.x.array) // 2)
        solver.solve()
        found.contact.advance()
    assert max(differences(first.parts(), found.parts())) < 1e-9


# I3: all couplings in the tangent


@pytest.mark.mpi
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("way", WAYS)
def test_the_whole_tangent_is_the_derivative(way, method):
    found = hosts.swelling(way, **METHODS[method])
    # Within the step: at its start points that have slid are on the edge of sticking
    found.push(*PUSHES[0])
    SOLVERS[-1](found.problem).solve()
    assert hosts.tangent_error(found, 0.05) < 1e-5


@pytest.mark.mpi
def test_swelling_bodies_are_one_answer_and_converge_quadratically():
    answers = []
    for way in WAYS:
        found = hosts.swelling(way, friction=Coulomb(0.3))
        assert max(solve(found)) <= 7
        last = found.problem.history[-4:]
        assert last[3] < 1e-5 * last[2] < 1e-7 * last[0]
        answers.append(found.parts())
        assert found.contact.resultant(0).force[1] > 0.1
    assert max(differences(*answers)) < 1e-9


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_prescribed_values_of_every_field_are_met(way):
    found = hosts.swelling(way)
    solve(found, pushes=PUSHES[:1])
    marker, values = found.contact.host.prescribed(found.problem.bcs)
    present = found.contact.host.values()
    assert worst((present - values)[marker == 1]) < 1e-14
    count = COMM.allreduce(int(marker.sum()))
    of_u = found.contact.host.prescribed_u(found.problem.bcs)[0]
    assert count > COMM.allreduce(int(of_u.sum())) > 0


# When a solve ends


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_unit_of_a_further_field_counts_for_nothing(unit, solver):
    plain, iterations = solved("mixed", "vector", solver)
    found = hosts.taylor_hood("mixed", unit=unit, **METHODS["vector"])
    assert solve(found, solver) == iterations
    u, p = found.parts()
    expected = plain.parts()
    assert worst(u - expected[0]) < 1e-9 * worst(u)
    assert worst(unit * p - expected[1]) < 1e-9 * worst(expected[1])


@pytest.mark.mpi
def test_a_field_that_is_not_solved_is_no_solution():
    """The forces are in balance at once; the field takes its iterations."""
    found = elastic("blocked")
    iterations = solve(found, pushes=[(0.0, 0.2)])
    assert iterations[0] >= 4
    assert worst(found.parts()[1] - 1.0) < 1e-10


def test_what_is_out_of_balance_is_named():
    found = elastic("blocked")
    solver = SOLVERS[0](found.problem)
    if hasattr(solver, "snes"):
        solver.snes.setTolerances(max_it=1)
    else:
        solver.max_it = 1
    with pytest.raises(raymortar.ConvergenceError, match="the unknown c by"):
        solver.solve()


# Paths, states, reactions


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_all_unknowns_go_back_to_a_state(way):
    found = hosts.taylor_hood(way, **METHODS["vector"])
    solve(found, pushes=PUSHES[:1])
    state, before = found.contact.state(), found.parts()
    first = solve(found, pushes=PUSHES[1:])
    after = found.parts()
    found.contact.restore(state)
    for a, b in zip(before, found.parts()):
        assert worst(a - b) == 0.0
    assert solve(found, pushes=PUSHES[1:]) == first
    assert max(differences(after, found.parts())) < 1e-9


def test_a_state_of_other_unknowns_is_refused():
    found, plain = elastic("mixed"), alone()
    with pytest.raises(ContactError, match="all unknowns of shape"):
        found.contact.restore(plain.contact.state())


@pytest.mark.mpi
@pytest.mark.parametrize("extrapolate", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_load_steps_with_a_history(way, extrapolate):
    found = hosts.taylor_hood(way)
    history = raymortar.History(found.problem)
    steps = LoadSteps(
        SOLVERS[0](found.problem),
        lambda t: found.push(0.0, -0.06 * t),
        steps=3,
        history=history,
        extrapolate=extrapolate,
        progress=False,
    ).run()
    assert [step.factor for step in steps] == pytest.approx([1 / 3, 2 / 3, 1.0])
    force = history.vectors("force_0")[:, 1]
    assert (np.diff(force) > 0.0).all()
    other = hosts.taylor_hood(way)
    solve(other, pushes=[(0.0, -0.06)])
    assert max(differences(other.parts(), found.parts())) < 1e-8


@pytest.mark.mpi
def test_a_step_that_fails_starts_again_from_all_unknowns():
    """Too large a step fails; halved ones end where small ones do."""
    found = hosts.taylor_hood("mixed")
    solver = SOLVERS[0](found.problem)
    path = LoadSteps(
        solver,
        lambda t: found.push(0.0, -0.2 * t),
        steps=1,
        strategy="halve",
        progress=False,
    )
    path.run()
    assert path.halvings > 0
    other = hosts.taylor_hood("mixed")
    LoadSteps(
        SOLVERS[0](other.problem),
        lambda t: other.push(0.0, -0.2 * t),
        steps=10,
        progress=False,
    ).run()
    assert max(differences(other.parts(), found.parts())) < 1e-7


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_reactions_balance_contact(way):
    found, _ = solved(way, "vector")
    bcs = found.problem.bcs
    reactions = found.problem.reactions({"below": bcs[:2], "above": bcs[2:]})
    force = found.contact.resultant(0).force
    assert reactions["above"] == pytest.approx(-force, rel=1e-8)
    assert reactions["below"] == pytest.approx(force, rel=1e-8)


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_viscous_forces_hold_a_loose_body(way):
    """The upper block stands on the lower one, held sideways only."""
    found = hosts.taylor_hood(way)
    conditions = [bc for i, bc in enumerate(found.problem.bcs) if i != 3]
    found.problem.bcs[:] = conditions
    steps = LoadSteps(
        SOLVERS[0](found.problem),
        lambda t: None,
        steps=1,
        stabilize=True,
        progress=False,
    ).run()
    assert len(steps) == 1
    assert worst(found.parts()[0]) < 1e-9


@pytest.mark.mpi
def test_a_given_jacobian_is_taken():
    found = elastic("blocked")
    J = [list(row) for row in found.problem.forms[1]]
    assert J[0][1] is None and J[1][0] is None
    contact, functions = found.contact, found.functions
    problem = raymortar.NonlinearProblem(
        found.problem.forms[0], contact, found.problem.bcs, J=J, u=functions
    )
    found.push(0.0, -0.05)
    assert SOLVERS[0](problem).solve()[1]


@pytest.mark.mpi
def test_rows_of_the_parts_are_apart():
    """Every owned unknown is of one field, and has a row of its own."""
    found = hosts.taylor_hood("mixed", method=AugmentedLagrangian())
    host, layout = found.contact.host, found.contact.layout
    rows = np.concatenate([field.rows for field in host.fields()])
    np.testing.assert_array_equal(np.sort(rows), np.arange(layout.n))
    owned = host.owned_part(layout.rows)
    np.testing.assert_array_equal(owned, layout.begin + np.arange(layout.n))
    assert gathered.everywhere(len(np.unique(layout.rows)) == len(layout.rows))
