"""The displacement as a part of a mixed Function, or as one of several Functions."""

from __future__ import annotations

from contextlib import contextmanager

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import problems
import pytest
import ufl
from dolfinx import fem
from host_solutions import METHODS, PUSHES, alone, differences, elastic, solve, solved
from hosts import MU, WAYS
from problems import COMM, SOLVERS, worst

import raymortar
from raymortar import AugmentedLagrangian, Coulomb
from raymortar.core import compat


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
    part, scene = (
        found.contact.unknowns.displacements[0].given.function_space,
        found.scene,
    )
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
    marker, values = found.contact.unknowns.prescribed(found.problem.bcs)
    present = found.contact.unknowns.values()
    assert worst((present - values)[marker == 1]) < 1e-14
    count = COMM.allreduce(int(marker.sum()))
    of_u = found.contact.unknowns.prescribed_u(found.problem.bcs)[0]
    assert count > COMM.allreduce(int(of_u.sum())) > 0


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
    host, layout = found.contact.unknowns, found.contact.layout
    rows = np.concatenate([field.rows for field in host.fields()])
    np.testing.assert_array_equal(np.sort(rows), np.arange(layout.n))
    owned = host.owned_part(layout.rows)
    np.testing.assert_array_equal(owned, layout.begin + np.arange(layout.n))
    assert gathered.everywhere(len(np.unique(layout.rows)) == len(layout.rows))
