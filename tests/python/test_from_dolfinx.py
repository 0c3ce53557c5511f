"""Programs written for DOLFINx: its Newton solver, and the program of the page."""

from __future__ import annotations

import re

import numpy as np
import pytest
from dolfinx import fem
from interacting import difference
from pressed import GAMMA, Pressed, beside_another_unknown
from problems import COMM, SOLVERS
from programs import blocks_of, run

from raymortar import ContactError, NewtonSolver, Penalty, SNESSolver
from raymortar.solvers.fixed_point import FixedPointSolver

pytestmark = pytest.mark.mpi


# Programs for DOLFINx's Newton solver


@pytest.mark.quick
@pytest.mark.parametrize("kind", [*SOLVERS, FixedPointSolver])
def test_solve_takes_the_function_that_a_problem_solves_for(kind):
    one, other = Pressed(), Pressed()

    def solver(problem):
        fixed = kind is FixedPointSolver
        return kind(SNESSolver(problem)) if fixed else kind(problem)

    found = solver(one.problem).solve(one.u)
    iterations, converged = found
    assert found == solver(other.problem).solve() and converged and iterations > 1
    assert difference(one.u, other.u) <= 1e-12


def test_solve_takes_the_unknowns_that_a_problem_solves_for():
    _, problem = beside_another_unknown()
    solver = SNESSolver(problem)
    assert solver.solve(problem.u)[1] and solver.solve(tuple(problem.u))[1]
    with pytest.raises(ContactError, match="what the problem solves for, f.*, w, or"):
        solver.solve(problem.u[0])


@pytest.mark.parametrize("kind", SOLVERS)
def test_solve_refuses_other_functions_by_name(kind):
    pressed = Pressed()
    pressed.u.name = "u"
    solver, other = kind(pressed.problem), fem.Function(pressed.u.function_space)
    other.name = "other"
    for given, named in ((other, "other"), ([other], "other"), (3, "3")):
        said = "solve takes what the problem solves for, u, or nothing, and was given "
        with pytest.raises(ContactError, match=f"{said}another: {named}"):
            solver.solve(given)
    with pytest.raises(ContactError, match="given another: other"):
        solver.solve(other if COMM.rank == COMM.size - 1 else None)
    other.name = pressed.u.name = "f"
    with pytest.raises(ContactError, match="f, a Function of the same name that Con"):
        solver.solve(other)


@pytest.mark.skipif(NewtonSolver not in SOLVERS, reason="DOLFINx has none")
def test_the_newton_solver_of_dolfinx_names_ours():
    """With a penalty on one mesh it works: the unknowns are those of DOLFINx."""
    from dolfinx.nls.petsc import NewtonSolver as NewtonSolverOfDOLFINx

    pressed = Pressed(Penalty(GAMMA))
    solver = NewtonSolverOfDOLFINx(COMM, pressed.problem)
    solver.atol, solver.rtol = 1e-10, 1e-10
    assert solver.solve(pressed.u)[1]
    assert pressed.contact.resultant().force[1] > 1.0
    multiplied = Pressed()
    with pytest.raises(ContactError, match=r"take raymortar.NewtonSolver\(problem\)"):
        NewtonSolverOfDOLFINx(COMM, multiplied.problem).solve(multiplied.u)
    # DOLFINx before 0.10 makes no matrix of several forms
    several, errors = beside_another_unknown(), (
        TypeError,
        AttributeError,
        ContactError,
    )
    with pytest.raises(errors, match="raymortar.NewtonSolver"):
        NewtonSolverOfDOLFINx(COMM, several[1]).solve(several[0].u)
    with pytest.raises(ContactError, match=r"not Intracomm: NewtonSolver\(problem\)"):
        NewtonSolver(COMM, multiplied.problem)


# Nothing is intercepted


@pytest.mark.skipif(NewtonSolver not in SOLVERS, reason="DOLFINx has none")
def test_settings_of_newton_are_its_own():
    pressed = Pressed()
    solver = NewtonSolver(pressed.problem)
    assert not {"__getattr__", "__setattr__"} & set(vars(NewtonSolver))
    solver.max_it, solver.relaxation_parameter = 30, 0.9
    assert (solver.newton.max_it, solver.newton.relaxation_parameter) == (30, 0.9)
    solver.rtol, solver.atol = 1e-7, 1e-9
    seen, F = [], pressed.problem.F

    def watched(x, b):
        seen.append((solver.tolerances, solver.newton.rtol, solver.newton.atol))
        F(x, b)

    pressed.problem.F = watched
    iterations, converged = solver.solve()
    assert converged and len(seen) == iterations + 1
    assert set(seen) == {((1e-7, 1e-9), 0.0, 0.0)}
    assert solver.tolerances == (1e-7, 1e-9)


# The page


def patched(text, diff):
    """A text with a unified diff applied; all of its context must be there."""
    lines, found, at = text.splitlines(), [], 0
    for head, hunk in re.findall(
        r"^@@ -(\d+).*?@@\n(.*?)(?=^@@|\Z)", diff, re.MULTILINE | re.DOTALL
    ):
        begin = int(head) - 1
        found += lines[at:begin]
        at = begin
        for line in hunk.splitlines():
            kind, line = line[:1] or " ", line[1:]
            if kind != "+":
                assert lines[at] == line
                at += 1
            if kind != "-":
                found.append(line)
    return "\n".join([*found, *lines[at:]]) + "\n"


PAGE = "docs/from_dolfinx.md"
# DOLFINx 0.5 has other names for it
SPACE = """
from dolfinx import fem
if not hasattr(fem, "functionspace"):
    fem.functionspace = lambda mesh, element: fem.VectorFunctionSpace(mesh, element[:2])
"""
SHOW = """
force, bottom = contact.resultant().force, problem.reactions({"held": bcs})["held"]
print("forces", *force, *bottom)
"""


def programs():
    """The page's program, and the same with its diff."""
    before = blocks_of(PAGE, "python")[1]
    return before, patched(before, blocks_of(PAGE, "diff")[0])


@pytest.mark.skipif(COMM.size > 1, reason="a program of its own")
def test_program_of_the_page_with_its_diff_prints_what_the_page_says(tmp_path):
    _, after = programs()
    *printed, forces = run(SPACE + after + SHOW, tmp_path).splitlines()
    said = blocks_of(PAGE, "text")[0].strip().splitlines()
    assert len(printed) == len(said) == 9
    for ours, theirs in zip(printed, said):
        a, b = ([float(x) for x in re.findall(r"-?[\d.]+", t)] for t in (ours, theirs))
        assert a[0] == b[0] and a[2] == b[2] and abs(a[1] - b[1]) <= 5
    force, held = np.array(forces.split()[1:], dtype=float).reshape(2, 3)
    # The block carries the tip; supports take the load and nothing else
    assert force[2] > 13.5
    np.testing.assert_allclose(held, [0.0, 0.0, 13.5], atol=1e-6)


@pytest.mark.skipif(COMM.size > 1, reason="a program of its own")
def test_program_of_the_page_runs_without_contact(tmp_path):
    """Where DOLFINx has the class that the page begins with."""
    from dolfinx.fem import petsc

    if not hasattr(petsc.NonlinearProblem, "solve"):
        pytest.skip("DOLFINx has this class from 0.10 on")
    before, after = programs()
    assert "raymortar" not in before and "raymortar" in after
    assert len(run(before, tmp_path).splitlines()) == 9
