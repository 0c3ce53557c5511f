"""PETSc options of the linear solver of a problem, where the user gives none or some."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from petsc4py import PETSc

from ..hooks import hooks
from ..problem import CoupledProblem
from .petsc_objects import DIRECT

log = logging.getLogger("raymortar")

# Tolerance of SNES's first linear system (docs/measured/linear_solvers.md)
INEXACT = 1e-4

# Prefixes of options with which the user chooses the linear solver
_ITS_OPTIONS = ("ksp_", "pc_", "mat_", "displacement_", "near_")


def direct() -> dict[str, Any]:
    """PETSc options of the direct solver, MUMPS, for problems of any size."""
    return dict(DIRECT)


def inexact(first: float = INEXACT) -> dict[str, Any]:
    """PETSc options of SNES, which solves systems as exactly as Newton's method needs.

    Parameters
    ----------
    first
        Tolerance of the first system, and the largest one. Those that follow are
        Eisenstat's and Walker's. 0: all systems are solved to ``ksp_rtol``.
    """
    if not first > 0.0:
        return {"snes_ksp_ew": False}
    ends = {f"snes_ksp_ew_{name}": first for name in ("rtol0", "rtolmax")}
    return {"snes_ksp_ew": True, **ends}


def linear_options(
    problem: CoupledProblem,
    given: Mapping[str, Any] | None,
    prefix: str,
    snes: bool = False,
) -> dict[str, Any]:
    """PETSc options of the linear solver that a problem gets. Collective.

    Parameters
    ----------
    problem
        Problem.
    given
        Options that the user has given, without prefix.
    prefix
        Prefix of the options: those in PETSc's table count too.
    snes
        Whether the options are for SNES, which may solve its first systems less
        exactly.

    Returns
    -------
    If the user gives any option of the linear solver, the options of the direct solver
    and those of the user (options of MUMPS only if factors are made). Otherwise options
    of the solver that suits the size, see `Hooks.linear_solver`.
    """
    table = PETSc.Options(prefix)
    given_by_options = any(name.startswith(_ITS_OPTIONS) for name in given or ())
    given_by_options = given_by_options or any(
        table.hasName(name) for name in ("ksp_type", "pc_type")
    )
    contact = problem.contact
    comm, unknowns = contact.layout.comm, contact.layout.size_global
    if comm.allreduce(int(given_by_options)):
        kind = (given or {}).get("pc_type", table.getString("pc_type", "lu"))
        # MUMPS makes no factors of other kinds, such as ILU
        named = DIRECT if kind in ("lu", "cholesky") else ("ksp_type", "pc_type")
        return {name: DIRECT[name] for name in named}
    options, name = direct(), "a direct one"
    if hooks.linear_solver is not None:
        options, name = hooks.linear_solver(problem, snes)
    if comm.rank == 0:
        log.info("linear solver of %d unknowns: %s", unknowns, name)
    return options
