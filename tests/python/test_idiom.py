"""`NonlinearProblem` as DOLFINx's own of 0.10 and later: solve, solver, A, b, x."""

from __future__ import annotations

import gc
import inspect
import re
import weakref

from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from dolfinx import fem
from interacting import LOWER, UPPER, difference, three
from problems import COMM, SOLVERS, fix, residual, worst
from programs import blocks_of, run

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    ContactError,
    ContactWarning,
    ConvergenceError,
    LoadSteps,
    NewtonSolver,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    compat,
)
from raymortar.solvers.fixed_point import FixedPointSolver

pytestmark = pytest.mark.mpi
GAMMA = 1000.0


class Pressed:
    """A block pressed on another one, by a problem with options of its own."""

    def __init__(self, method=None, **options):
        self.scene = two_blocks(COMM, 2, "quadrilateral", 3, 4)
        self.u = fem.Function(compat.vector_space(self.scene.mesh, 1))
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            [(3, 4)],
            AugmentedLagrangian(GAMMA) if method is None else method,
        )
        V, self.top = self.u.function_space, fem.Constant(self.scene.mesh, (0.0, 0.0))
        top = fix(V, self.scene, "top", None, self.top)
        self.bcs = [fix(V, self.scene, "bottom"), top]
        self.F = residual(self.scene, self.u, "neo-hookean")[0]
        self.problem = NonlinearProblem(self.F, self.contact, bcs=self.bcs, **options)
        self.press(0.1)

    def press(self, share):
        self.top.value[:] = (0.0, -share)


@pytest.mark.quick
def test_solve_gives_the_function_and_what_its_solver_gives():
    one, other = Pressed(), Pressed()
    assert one.problem.solve() is one.u is one.problem.u
    iterations, _ = SNESSolver(other.problem).solve()
    assert one.problem.solver.getIterationNumber() == iterations
    assert one.problem.solver.getConvergedReason() > 0
    assert difference(one.u, other.u) <= 1e-12
    assert difference(one.contact.multiplier, other.contact.multiplier) <= 1e-10


def test_objects_are_those_of_the_coupled_system():
    pressed = Pressed()
    problem, contact = pressed.problem, pressed.contact
    problem.solve()
    assert isinstance(problem.solver, PETSc.SNES)
    assert problem.A.handle == problem.solver.getJacobian()[0].handle
    assert problem.b.handle == problem.solver.getFunction()[0].handle
    x = problem.x.array.copy()
    assert len(x) == contact.layout.size
    # To a rounding: a multiplier is kept as gamma times its unknown, and divided again
    np.testing.assert_array_max_ulp(x, problem.start().array, maxulp=1)
    # What the unknowns hold: displacement, and multiplier over gamma
    n = contact.layout.n_u
    assert np.array_equal(x[:n], pressed.u.x.array[:n])
    assert worst(x[n:]) * GAMMA == pytest.approx(worst(contact.multiplier.x.array))
    assert problem.b.norm() <= 1e-6


def test_solves_go_on_from_the_last_one():
    pressed, at_once = Pressed(), Pressed()
    for share in (0.05, 0.1):
        pressed.press(share)
        pressed.problem.solve()
        pressed.contact.advance()
    at_once.problem.solve()
    assert difference(pressed.u, at_once.u) <= 1e-8


def test_several_contacts_and_several_solvers():
    blocks = three()
    problem = NonlinearProblem(
        blocks.F, [blocks.contact(LOWER), blocks.contact(UPPER)], blocks.bcs
    )
    blocks.move(0.5)
    assert problem.solve() is blocks.u
    found = blocks.u.x.array.copy()
    SNESSolver(problem).solve()
    assert worst(blocks.u.x.array - found) <= 1e-9 * worst(found)


def test_several_unknowns_are_returned_as_a_list():
    pressed, problem = beside_another_unknown()
    (_, w), found = problem.u, problem.solve()
    assert found == problem.u and found[0] is pressed.u and found[1] is w
    assert worst(w.x.array) == pytest.approx(0.1, rel=0.05)


# Programs for DOLFINx's Newton solver


def beside_another_unknown():
    """The problem of a block pressed on another one, and of a scalar of its own."""
    pressed = Pressed()
    w = fem.Function(compat.scalar_space(pressed.scene.mesh, 1), name="w")
    q = ufl.TestFunction(w.function_space)
    F = [pressed.F, (w - pressed.u[1]) * q * ufl.dx]
    contact = raymortar.Contact(pressed.u, pressed.scene.facet_tags, [(3, 4)])
    return pressed, NonlinearProblem(F, contact, bcs=pressed.bcs, u=[pressed.u, w])


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


# Options


def in_table():
    return [name for name in PETSc.Options().getAll() if "mine" in name]


def test_options_reach_petsc_and_leave_its_table():
    given = {"snes_max_it": 7, "snes_rtol": 1e-6, "snes_linesearch_type": "l2"}
    given["ksp_type"] = "gmres"
    pressed = Pressed(petsc_options=given, petsc_options_prefix="mine_")
    problem = pressed.problem
    problem.solve()
    solver = problem.solver
    assert solver.getOptionsPrefix() == "mine_" and not in_table()
    assert solver.getTolerances()[0] == 1e-6 and solver.getTolerances()[3] == 7
    assert solver.getKSP().getType() == "gmres"
    names = {name: getattr(problem, name).getOptionsPrefix() for name in "Abx"}
    assert names == {"A": "mine_A_", "b": "mine_b_", "x": "mine_x_"}
    # Of the defaults what was not given stays
    factors = solver.getKSP().getPC().getFactorMatrix()
    assert solver.getKSP().getPC().getFactorSolverType() == "mumps"
    assert factors.getMumpsIcntl(14) == 60


def test_command_line_goes_before_a_program():
    table = PETSc.Options()
    table["mine_snes_max_it"] = 9
    try:
        options = {"snes_max_it": 7}
        pressed = Pressed(petsc_options=options, petsc_options_prefix="mine_")
        assert pressed.problem.solver.getTolerances()[3] == 9
    finally:
        table.delValue("mine_snes_max_it")


def test_compilers_are_told(monkeypatch):
    seen, compile_form = [], fem.form

    def form(ufl_form, **options):
        seen.append(options)
        return compile_form(ufl_form)

    form.__signature__ = inspect.signature(compile_form)
    monkeypatch.setattr(fem, "form", form)
    Pressed(form_compiler_options={"epsilon": 1e-12}, jit_options={"timeout": 30})
    told = [set(map(str, options.values())) for options in seen if options]
    assert told == 2 * [{str({"epsilon": 1e-12}), str({"timeout": 30})}]


@pytest.mark.parametrize(
    "options, said",
    [
        ({"petsc_options_prefix": ""}, "petsc_options_prefix must be a text"),
        ({"petsc_options_prefix": 3}, "petsc_options_prefix must be a text"),
        ({"petsc_options": ["snes_monitor"]}, "petsc_options must be PETSc options by"),
    ],
)
def test_options_that_are_none_are_refused(options, said):
    with pytest.raises(ContactError, match=said):
        Pressed(**options)


# Failures


@pytest.mark.parametrize("told", [{}, {"snes_error_if_not_converged": True}])
def test_failure_is_an_error(told):
    pressed = Pressed(petsc_options={"snes_max_it": 1, **told})
    with pytest.raises(ConvergenceError, match="after 1 iterations .* pairs"):
        pressed.problem.solve()
    assert pressed.problem.solver.getConvergedReason() < 0
    assert raymortar.SNESSolver(pressed.problem).solve()[1]


def test_failure_is_a_warning_where_that_is_asked_for():
    options = {"snes_max_it": 1, "snes_error_if_not_converged": False}
    pressed = Pressed(petsc_options=options)
    with pytest.warns(ContactWarning, match="after 1 iterations .* pairs"):
        assert pressed.problem.solve() is pressed.u
    assert pressed.problem.solver.getConvergedReason() < 0
    pressed.problem.solver.setTolerances(max_it=25)
    pressed.problem.solve()
    assert pressed.problem.solver.getConvergedReason() > 0
    # Load steps never take what has not converged
    pressed.problem.solver.setTolerances(max_it=1)
    with pytest.raises(ConvergenceError, match="load factor"):
        LoadSteps(
            pressed.problem.snes_solver, lambda t: pressed.press(0.3 * t), 1, 1
        ).run()


# Load steps, and life times


def test_load_steps_take_the_solver_of_the_problem():
    one, other = Pressed(), Pressed()
    steps = LoadSteps(one.problem.snes_solver, lambda t: one.press(0.2 * t), steps=3)
    others = LoadSteps(
        SNESSolver(other.problem), lambda t: other.press(0.2 * t), steps=3
    )
    found = [[(s.factor, s.iterations) for s in path.run()] for path in (steps, others)]
    assert found[0] == found[1]
    assert difference(one.u, other.u) <= 1e-12


def test_load_steps_keep_a_problem_that_nothing_else_keeps():
    pressed = Pressed()
    steps = LoadSteps(
        pressed.problem.snes_solver, lambda t: pressed.press(0.2 * t), steps=1
    )
    del pressed.problem
    assert [step.factor for step in steps.run()] == [1.0]


def test_a_problem_goes_with_its_last_name():
    """No cycle holds it and its matrix until Python looks for cycles."""
    pressed = Pressed()
    pressed.problem.solve()
    kept = weakref.ref(pressed.problem)
    gc.disable()
    try:
        del pressed.problem
        assert kept() is None
    finally:
        gc.enable()


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
