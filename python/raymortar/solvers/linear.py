"""PETSc options of direct solvers, and of systems that are solved less exactly."""

from __future__ import annotations

from typing import Any

from ..core.solvers.petsc_objects import DIRECT

# Options of factors whose type follows the symmetry of the matrix
SYMMETRIC_OR_NOT = {k: v for k, v in DIRECT.items() if k != "pc_type"}
# Tolerance of SNES's first linear system (docs/measured/linear_solvers.md)
INEXACT = 1e-4


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
