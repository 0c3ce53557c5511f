"""Programs written for DOLFINx: its Newton solver, and the program of the page."""

from __future__ import annotations

import re

import numpy as np
import pytest
from dolfinx import fem
from interacting import difference
from pressed import GAMMA, Pressed, beside_another_unknown
from problems import COMM, SOLVERS
from programs import ROOT, blocks_of, run

from raymortar import ContactError, NewtonSolver, Penalty, SNESSolver

pytestmark = pytest.mark.mpi


# Programs for DOLFINx's Newton solver


@pytest.mark.quick
@pytest.mark.parametrize("kind", SOLVERS)
def test_solve_takes_the_function_that_a_problem_solves_for(kind):
    one, other = Pressed(), Pressed()
    found = kind(one.problem).solve(one.u)
    iterations, converged = found
    assert found == kind(other.problem).solve() and converged and iterations > 1
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
    """A text with a unified diff applied; all of its context must be there, in order."""
    lines, found, at = text.splitlines(), [], 0
    for hunk in re.findall(
        r"^@@.*?@@\n(.*?)(?=^@@|\Z)", diff, re.MULTILINE | re.DOTALL
    ):
        parts = [(line[:1] or " ", line[1:]) for line in hunk.splitlines()]
        old = [line for kind, line in parts if kind != "+"]
        places = range(at, len(lines) - len(old) + 1)
        (begin,) = (k for k in places if lines[k : k + len(old)] == old)
        found += lines[at:begin] + [line for kind, line in parts if kind != "-"]
        at = begin + len(old)
    return "\n".join([*found, *lines[at:]]) + "\n"


PAGE = "docs/from_dolfinx.md"
PROGRAMS = ROOT / "examples" / "from_dolfinx"
GENERATIONS = {"newton": 0, "snes": 1}  # by the diff on the page
MASTERS = ["floor", "block"]  # the last diff has the block
SHOW = """
force, bottom = contact.resultant().force, problem.reactions({"held": bcs})["held"]
print("forces", *force, *bottom)
"""


def of_this_version(program):
    """The space as DOLFINx 0.5 has it, in a program that is for later versions."""
    new = 'V = fem.functionspace(domain, ("Lagrange", 1, (3,)))'
    old = 'V = fem.VectorFunctionSpace(domain, ("Lagrange", 1))'
    assert new in program
    knows = hasattr(fem, "functionspace") or old in program
    return program if knows else program.replace(new, old)


def programs(generation, master="floor"):
    """A program written for DOLFINx, and the same with the diffs of the page."""
    before = (PROGRAMS / f"beam_{generation}.py").read_text(encoding="utf-8")
    diffs = blocks_of(PAGE, "diff")
    after = patched(before, diffs[GENERATIONS[generation]])
    if master == "block":
        after = patched(after, diffs[-1])
    return of_this_version(before), of_this_version(after)


def is_of_this_version(generation):
    """Whether DOLFINx has the classes that a program is written for."""
    from dolfinx.fem import petsc

    solves = hasattr(petsc.NonlinearProblem, "solve")
    return solves == (generation == "snes")


def check_forces(line, load, share):
    """What contact carries of the load, and supports: of a block all of the load."""
    force, held = np.array(line.split()[1:], dtype=float).reshape(2, 3)
    carried = abs(force[2])  # by the floor, or by the block, which supports hold
    assert share * load < carried < load
    by_supports = load - (carried if share < 0.9 else 0.0)
    np.testing.assert_allclose(held, [0.0, 0.0, by_supports], atol=1e-6)


# Any warning of contact fails the program
LOUD = """import warnings, raymortar
warnings.simplefilter("error", raymortar.ContactWarning)
"""


@pytest.mark.skipif(COMM.size > 1, reason="a program of its own")
@pytest.mark.parametrize("master", MASTERS)
@pytest.mark.parametrize("generation", GENERATIONS)
def test_program_with_the_diff_of_its_generation_arrives(generation, master, tmp_path):
    """Where DOLFINx has no Newton solver, raymortar has none."""
    if generation == "newton" and NewtonSolver not in SOLVERS:
        pytest.skip("DOLFINx has no Newton solver")
    _, after = programs(generation, master)
    *printed, forces = run(LOUD + after + SHOW, tmp_path).splitlines()
    said = blocks_of(PAGE, "text")[0].strip().splitlines()
    assert len(printed) == len(said) == 9
    for ours, theirs in zip(printed, said):
        a, b = ([float(x) for x in re.findall(r"-?[\d.]+", t)] for t in (ours, theirs))
        assert a[0] == b[0] and a[2] == b[2]
        assert abs(a[1] - b[1]) <= 5 or master == "block"
    check_forces(forces, 13.5, 0.75 if master == "floor" else 0.95)


@pytest.mark.skipif(COMM.size > 1, reason="a program of its own")
@pytest.mark.parametrize("generation", GENERATIONS)
def test_program_runs_without_contact(generation, tmp_path):
    if not is_of_this_version(generation):
        pytest.skip("DOLFINx has other classes")
    before, after = programs(generation)
    assert "raymortar" not in before and "raymortar" in after
    assert len(run(before, tmp_path).splitlines()) == 9


@pytest.mark.skipif(COMM.size > 1, reason="a program of its own")
def test_a_beam_of_degree_2_arrives_by_load_steps(tmp_path):
    """With finer cells than the page, as in the tutorial, and the page's last block."""
    _, after = programs("snes", "block")
    program = after[: after.index("for n in range")]
    for old, new in (
        ('("Lagrange", 1', '("Lagrange", 2'),
        ("[20, 2, 5]", "[20, 3, 10]"),
    ):
        assert old in program
        program = program.replace(old, new)
    (steps,) = blocks_of(PAGE, "python")
    steps = steps.replace("(solver,", "(problem.snes_solver,")
    *printed, forces = run(program + steps + SHOW, tmp_path).splitlines()
    assert len(printed) >= 9 and float(printed[-1].split()[-1]) == -1.35
    check_forces(forces, 13.5, 0.95)
