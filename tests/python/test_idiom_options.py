"""Options of `NonlinearProblem` as of DOLFINx's own, and solves that fail."""

from __future__ import annotations

import inspect

from petsc4py import PETSc

import pytest
from dolfinx import fem
from pressed import Pressed

import raymortar
from raymortar import ContactError, ContactWarning, ConvergenceError, LoadSteps

pytestmark = pytest.mark.mpi


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
