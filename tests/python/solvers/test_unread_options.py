"""Options that the user gives and PETSc never asks for are told, and no others."""

import os
import warnings

from petsc4py import PETSc

import pytest
from pressed import Pressed
from told import refuse_warnings

from raymortar import ContactWarning, NewtonSolver, Penalty, SNESSolver, solvers

QUIET = f"ascii:{os.devnull}"


@pytest.mark.parametrize(
    "kind, options, name",
    [
        (SNESSolver, {"snes_rtoll": 1e-3}, "'snes_rtoll'"),
        (SNESSolver, {"max_it": 9, "rtol": 1e-3}, "'max_it', 'rtol'"),
        (SNESSolver, {"snes_rtol": 1e-8, "-snes_rtol": 1e-8}, "'-snes_rtol'"),
        (NewtonSolver, {**solvers.direct(), "ksp_rtoll": 1e-3}, "'ksp_rtoll'"),
    ],
)
@pytest.mark.mpi(where=lambda name, **_: name == "'snes_rtoll'")
def test_unread_options_are_told_once(kind, options, name):
    pressed = Pressed()
    solver = kind(pressed.problem, options)
    with pytest.warns(ContactWarning, match=f"read the PETSc option.s. {name}:"):
        solver.solve()
    pressed.press(0.12)
    with warnings.catch_warnings():
        refuse_warnings()
        solver.solve()


def test_options_of_a_problem_are_told():
    pressed = Pressed(petsc_options={"snes_maxit": 3})
    with pytest.warns(ContactWarning, match="'snes_maxit'"):
        pressed.problem.solve()


@pytest.mark.parametrize(
    "options",
    [
        {"snes_inexact": 1e-3},
        {"snes_monitor": QUIET, "snes_view": QUIET, "snes_converged_reason": QUIET},
        {"ksp_monitor": QUIET, "ksp_view": QUIET, "ksp_converged_reason": QUIET},
        {"snes_linesearch_type": "bt", "snes_linesearch_max_it": 5},
        {"snes_divergence_tolerance": 1e6, "snes_error_if_not_converged": True},
        solvers.direct(),
        solvers.iterative(),
        solvers.with_fallback(),
        solvers.kept_factors(),
        solvers.kept_factors(1000),
        solvers.lagged_factors(),
    ],
    ids=lambda options: next(iter(options)),
)
def test_options_that_are_of_use_are_not_told(options):
    pressed = Pressed()
    with warnings.catch_warnings():
        refuse_warnings()
        SNESSolver(pressed.problem, options).solve()


@pytest.mark.parametrize("name, count", [("snes_rtol", 0), ("snes_rtoll", 1)])
def test_options_that_the_command_line_replaces_are_not_told(name, count):
    table = PETSc.Options("replaced_")
    table["snes_rtol"] = 1e-9
    pressed = Pressed(petsc_options={name: 1e-8}, petsc_options_prefix="replaced_")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        pressed.problem.solve()
    table.delValue("snes_rtol")
    assert len(caught) == count


def test_options_of_mumps_stay_with_its_factors():
    """ILU is not one of them: PETSc refused it by the name of MUMPS."""
    solver = SNESSolver(Pressed(Penalty(100.0)).problem, {"pc_type": "ilu"})
    assert solver.krylov_solver.pc.getType() == "ilu"
    options = solver.options.given
    assert not [name for name in options if "mumps" in f"{name} {options[name]}"]
