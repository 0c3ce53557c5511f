"""DOLFINx's Newton solver, and PETSc objects that nobody holds."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import dolfinx
import dolfinx.nls.petsc  # noqa: F401 (makes the C++ module)
from dolfinx import cpp as _cpp


def destroy_garbage(comm: MPI.Comm) -> None:
    """Free the PETSc objects that no Python variable of any rank names. Collective.

    From petsc4py 3.18 on they are only put aside, as ranks may drop them at different
    times, and a solver's functions keep all that they refer to.
    """
    clean = getattr(PETSc, "garbage_cleanup", None)
    if clean is not None and not PETSc.Sys.isFinalized():
        clean(comm)


def newton_solver_class() -> type | None:
    """C++ Newton solver of DOLFINx; ``None`` where it has been removed."""
    return getattr(_cpp.nls.petsc, "NewtonSolver", None)


def make_newton_solver(comm: MPI.Comm) -> Any:
    """DOLFINx's C++ Newton solver, the same interface in all versions.

    It has ``setF(fn(x, b), b)``, ``setJ(fn(x, A), A)``, ``set_form(fn(x))``,
    ``set_update(fn(solver, dx, x))``, ``krylov_solver``, ``rtol``, ``atol``,
    ``max_it``, ``convergence_criterion`` (``"residual"`` or ``"incremental"``),
    ``relaxation_parameter``, ``report``, ``error_on_nonconvergence`` and
    ``solve(x) -> (iterations, converged)`` on ``PETSc.Vec``.

    Raises
    ------
    NotImplementedError
        If this DOLFINx no longer has it.
    """
    solver_class = newton_solver_class()
    if solver_class is None:
        raise NotImplementedError(
            f"DOLFINx {dolfinx.__version__} has no Newton solver: use SNES"
        )
    return solver_class(comm)
