"""GMRES with the factors of an earlier tangent."""

from __future__ import annotations

from typing import Any

from ..core.errors import ContactError, is_whole_number
from ..core.solvers.petsc_objects import DIRECT

# Tangents of a solve that one factorisation serves (measured: docs/measured/solving.md)
LAG = 3

# Tolerance of a system, with which Newton's method takes no more iterations
RTOL = 1e-8


def lagged_factors(
    package: str = "mumps", lag: int = LAG, **options: Any
) -> dict[str, Any]:
    """PETSc options of GMRES whose preconditioner is an earlier tangent's factors.

    SNES factorises the first tangent of a solve, and then one out of ``lag``. From one
    iterate to the next the tangent changes little but for points that close, open or
    slip, and GMRES needs about as many iterations as there are of these.

    Parameters
    ----------
    package
        Direct solver that factorises: ``"mumps"``, or another one of PETSc.
    lag
        Tangents that one factorisation serves. PETSc's ``snes_lag_preconditioner``.
    options
        Options to add or to replace, such as ``ksp_rtol=1e-6``.

    Returns
    -------
    Options for `SNESSolver`. DOLFINx's `NewtonSolver` factorises each tangent.

    Raises
    ------
    ContactError
        If the package is no name, or ``lag`` no whole number from 1 on.
    """
    if not isinstance(package, str):
        raise ContactError(f"package must be the name of a solver, not {package!r}")
    if not (is_whole_number(lag) and lag >= 1):
        raise ContactError(f"lag = {lag!r} must be a whole number from 1 on")
    gmres = {"ksp_type": "gmres", "ksp_gmres_restart": 200, "ksp_rtol": RTOL}
    factors = DIRECT | {"pc_factor_mat_solver_type": package}
    return factors | gmres | {"snes_lag_preconditioner": int(lag)} | options
