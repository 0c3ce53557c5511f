"""Multigrid on levels of the bodies: contact takes the iterations of its bodies."""

import logging

from mpi4py import MPI
from petsc4py import PETSc

import dolfinx.fem.petsc
import numpy as np
import pytest
from dolfinx import fem
from hosts import taylor_hood
from interacting import Stack
from pressed_blocks import FRICTIONS, METHODS, blocks, solved, unknowns
from problems import COMM, SOLVERS, build, fix, stack, worst
from rigid_scenes import press, shapes

from raymortar import (
    AugmentedLagrangian,
    ContactWarning,
    Coulomb,
    Penalty,
    SNESSolver,
    solvers,
)
from raymortar.core.solvers.petsc_objects import PetscOptions
from raymortar.solvers import automatic
from raymortar.solvers.automatic import linear_options
from raymortar.solvers.levels import BodiesLevels, set_levels

# Blocks of each tangent, whose iterations are those of the preconditioner as it is
ANEW = solvers.iterative("bodies", bodies_most=-1)


def alone(problem, rtol=1e-8):
    """Krylov iterations of the bodies without contact, by the same levels."""
    coupled = problem.problem
    K = fem.petsc.assemble_matrix(coupled.a, bcs=coupled.bcs)
    K.assemble()
    names = {k: v for k, v in solvers.iterative("bodies").items() if "isplacement" in k}
    ksp = PETSc.KSP().create(COMM)
    with PetscOptions("alone_", names):
        ksp.setOptionsPrefix("alone_displacement_")
        ksp.setOperators(K)
        ksp.setType("gmres")
        ksp.setTolerances(rtol=rtol)
        levels = BodiesLevels(coupled, "alone_displacement_levels_")
        set_levels(ksp, levels, K)
        ksp.setFromOptions()
        x, b = K.createVecs()
        b.array[:] = np.where(coupled.constrained, 0.0, 1.0)
        ksp.solve(b, x)
    assert ksp.getConvergedReason() > 0
    return ksp.getIterationNumber()


# Answers and iterations


@pytest.mark.mpi
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "cell, degree", [("tetrahedron", 2), ("hexahedron", 2), ("hexahedron", 1)]
)
def test_contact_takes_the_iterations_of_its_bodies(cell, degree, method, friction):
    options = {"method": METHODS[method](), "friction": FRICTIONS[friction]}
    # Enough unknowns for levels
    problem = blocks(cell, degree, 3 - degree, **options)
    start = problem.contact.state()
    solved(problem, solvers.direct())
    direct = unknowns(problem)
    problem.contact.restore(start)
    _, counts = solved(problem, solvers.iterative("bodies"))
    assert worst(unknowns(problem) - direct) <= 1e-8 * worst(direct)
    # One more: both counts are whole numbers, and small
    assert 2 < max(counts) <= 1.3 * alone(problem) + 1


def test_refinement_adds_no_iterations():
    counts = [max(solved(blocks(n=n, friction=Coulomb(0.3)), ANEW)[1]) for n in (1, 2)]
    assert counts[1] <= counts[0] + 2


@pytest.mark.mpi
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("degree", [1, 2])
def test_ranks_take_the_iterations_of_one(degree, method, friction):
    """Also on strips of cells, where relaxation rank by rank needs many more."""
    options = {"method": METHODS[method](), "friction": FRICTIONS[friction]}
    problems = [
        blocks(degree=degree, n=3 - degree, comm=comm, **options)
        for comm in (MPI.COMM_SELF, COMM)
    ]
    counts = [max(solved(one, solvers.iterative("bodies"))[1]) for one in problems]
    # One more: both counts are whole numbers, and small
    assert counts[1] <= 1.1 * counts[0] + 1


@pytest.mark.mpi
@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_gamma_does_not_count(factor):
    gamma = blocks().contact.gamma
    counts = [
        max(solved(blocks(method=AugmentedLagrangian(g)), ANEW)[1])
        for g in (gamma, factor * gamma)
    ]
    assert counts[1] <= counts[0] + 2


@pytest.mark.mpi
@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_stiff_and_soft_penalties(factor):
    counts = [
        max(solved(blocks(method=Penalty(k)), ANEW)[1]) for k in (200.0, factor * 200.0)
    ]
    assert counts[1] <= counts[0] + 3


@pytest.mark.mpi
@pytest.mark.parametrize("method, cycle", [("augmented", "v"), ("penalty", "w")])
def test_coarse_levels_are_visited_twice_with_penalties(method, cycle, folder):
    """What that saves from 80,000 unknowns on: docs/measured/linear_solvers.md."""
    solver, _ = solved(blocks(method=METHODS[method]()), solvers.iterative("bodies"))
    inner = solver.krylov_solver.getPC().getPythonContext().solver
    file = str(folder / "view")
    viewer = PETSc.Viewer().createASCII(file, comm=COMM)
    inner.getPC().view(viewer)
    viewer.destroy()
    with open(file) as text:
        assert f"cycles={cycle}" in text.read()


@pytest.mark.mpi
@pytest.mark.parametrize("upper", [1e-2, 1e4])
def test_unequal_stiffness(upper):
    problem = blocks(E={"lower": 10.0, "upper": upper})
    _, counts = solved(problem, solvers.iterative("bodies"))
    assert max(counts) <= 16


@pytest.mark.mpi
def test_nearly_incompressible_bodies_take_more_and_end():
    _, counts = solved(blocks(nu=0.499), solvers.iterative("bodies"))
    assert 20 < max(counts) < 150


@pytest.mark.mpi
def test_several_interactions():
    scene = stack("hexahedron", (3, 4, 2), widths=(1.4, 1.0, 1.2))
    bodies = Stack(scene, ["bottom_0"], ["top_2"])
    contacts = [
        bodies.contact(("bottom_1", "top_0"), friction=Coulomb(0.3)),
        bodies.contact(("bottom_2", "top_1")),
    ]
    problem = bodies.problem(contacts)
    start, found = problem.contact.state(), []
    bodies.move(1.0)
    for options in (solvers.direct(), solvers.iterative("bodies", ksp_rtol=1e-10)):
        problem.contact.restore(start)
        solver, steps = SNESSolver(problem, options), []
        solver.krylov_solver.setMonitor(lambda ksp, i, norm: steps.append(i))
        solver.solve()
        found.append(problem.start().array.copy())
    assert worst(found[1] - found[0]) <= 1e-8 * worst(found[0])
    assert 2 < max(steps) < 25


@pytest.mark.mpi
@pytest.mark.parametrize("shape", ["plane", "sphere"])
def test_a_rigid_tool(shape):
    pressed = press("hexahedron", shapes(3)[shape], degree=2, friction=Coulomb(0.3))
    start, found, steps = pressed.contact.state(), [], []
    for options in (solvers.direct(), solvers.iterative("bodies", ksp_rtol=1e-10)):
        pressed.contact.restore(start)
        solver = SNESSolver(pressed.problem, options)
        solver.krylov_solver.setMonitor(lambda ksp, i, norm: steps.append(i))
        solver.solve()
        found.append(pressed.problem.start().array.copy())
    assert worst(found[1] - found[0]) <= 1e-8 * worst(found[0])
    assert 2 < max(steps) < 30


def resting(V, scene):
    """The lower body held, the upper one by contact alone but for its sides."""
    return [fix(V, scene, "bottom"), fix(V, scene, "top", 0), fix(V, scene, "top", 1)]


@pytest.mark.mpi
def test_a_body_held_by_contact_alone():
    """The volume's tangent is singular."""
    found, counts = [], []
    for options in (solvers.direct(), solvers.iterative("bodies")):
        problem = blocks(held=resting, loaded=["top"], load=-0.1)
        _, steps = solved(problem, options)
        found.append(problem.contact.resultant().force[-1])
        counts.append(max(steps))
    assert found[1] == pytest.approx(found[0], rel=1e-8)
    assert 2 < counts[1] < 30


@pytest.mark.mpi
def test_levels_are_kept_while_they_are_good():
    problem = blocks(friction=Coulomb(0.3))
    start = problem.contact.state()
    solver, _ = solved(problem, solvers.iterative("bodies"))
    context = solver.krylov_solver.getPC().getPythonContext()
    levels = context.levels
    problem.contact.restore(start)
    solver.solve()
    assert context.levels is levels
    # Other dofs are prescribed
    problem.problem.bcs.pop()
    problem.problem.bcs.append(fix(problem.u.function_space, problem.scene, "top", 2))
    problem.contact.restore(start)
    solver.solve()
    assert context.levels is not levels


# The choice


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_large_problems_get_the_iterative_solver(solver, monkeypatch, caplog):
    # The demos, where they have been imported, switch such lines off
    monkeypatch.setattr(logging.root.manager, "disable", logging.NOTSET)
    caplog.set_level("INFO", "raymortar")
    problem = blocks()
    start = problem.contact.state()
    one, counts = solved(problem, None, solver)
    assert one.krylov_solver.getType() == "preonly" and max(counts) == 1
    direct = unknowns(problem)
    monkeypatch.setattr(automatic, "MOST_DIRECT", {2: 1000})
    problem.contact.restore(start)
    one, _ = solved(problem, None, solver)
    assert one.krylov_solver.getType() == "python"
    assert 2 < one.krylov_solver.getIterationNumber() < 20
    assert worst(unknowns(problem) - direct) <= 1e-8 * worst(direct)
    if COMM.rank == 0:
        said = [record.getMessage() for record in caplog.records]
        assert ["a direct one" in text for text in said] == [True, False]
        assert "multigrid" in said[1]


@pytest.mark.mpi
def test_inexact_newton_keeps_its_iterations(monkeypatch):
    monkeypatch.setattr(automatic, "MOST_DIRECT", {2: 1000})
    found = []
    for options in (None, solvers.with_fallback()):
        problem = blocks(friction=Coulomb(0.3))
        one = SNESSolver(problem.problem, options)
        newton, _ = one.solve()
        found.append((newton, one.snes.getLinearSolveIterations()))
    (newton, inexact), (all_newton, exact) = found
    assert newton == all_newton
    assert inexact < 0.7 * exact


@pytest.mark.parametrize("given", [{"pc_type": "lu"}, {"ksp_type": "gmres"}])
def test_what_the_user_says_of_the_solver_counts(given, monkeypatch):
    monkeypatch.setattr(automatic, "MOST_DIRECT", {2: 0})
    problem = blocks().problem
    assert linear_options(problem, given, "none_") == solvers.direct()
    assert "ksp_python_type" in linear_options(problem, {"snes_max_it": 7}, "none_")
    table = PETSc.Options("some_")
    table["pc_type"] = "lu"
    assert linear_options(problem, None, "some_") == solvers.direct()
    table.delValue("pc_type")


@pytest.mark.mpi
def test_large_plane_problems_get_the_iterative_solver(monkeypatch):
    scene = stack("triangle", (8, 6), gaps=(0.0, -0.01))
    problem = build(scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top_1")])
    start = problem.contact.state()
    one, _ = solved(problem, None)
    assert one.krylov_solver.getType() == "preonly"
    direct = unknowns(problem)
    monkeypatch.setattr(automatic, "MOST_DIRECT_2D", 0)
    problem.contact.restore(start)
    one, _ = solved(problem, None)
    assert one.krylov_solver.getType() == "python"
    assert 2 < one.krylov_solver.getIterationNumber() < 20
    assert worst(unknowns(problem) - direct) <= 1e-8 * worst(direct)


def test_two_dimensions_and_further_unknowns_stay_direct(monkeypatch):
    monkeypatch.setattr(automatic, "MOST_DIRECT", {1: 0, 2: 0})
    flat = build(stack("triangle", (2, 2)), bcs=lambda V, s: [fix(V, s, "bottom")])
    mixed = taylor_hood("blocked").problem
    for problem in (flat.problem, mixed):
        assert linear_options(problem, None, "none_") == solvers.direct()


@pytest.mark.mpi
def test_a_stalled_solver_gives_way_to_the_direct_one():
    problem = blocks()
    start = problem.contact.state()
    solved(problem, solvers.direct())
    direct = unknowns(problem)
    problem.contact.restore(start)
    with pytest.warns(ContactWarning, match="the direct one takes over") as told:
        one, _ = solved(problem, solvers.with_fallback(ksp_max_it=2))
    assert len(told) == automatic.MOST_STALLS
    assert one.krylov_solver.getPythonContext().stalls == automatic.MOST_STALLS
    assert worst(unknowns(problem) - direct) <= 1e-12 * worst(direct)
