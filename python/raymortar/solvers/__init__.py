"""Solvers of the coupled system: Newton's method, and iterative linear solvers.

- solver: linear systems, checks and failures of both Newton solvers
- newton, snes: `NewtonSolver`, `SNESSolver`
- automatic: PETSc options of linear solvers, and the default
- kept_factors, compliance: a direct solver that keeps the factors of linear bodies
- elimination, levels: a preconditioner that eliminates multipliers, with the levels of
  the bodies
- condensed: a preconditioner of condensed systems
- petsc_objects: PETSc options, and solvers within solvers
"""

from __future__ import annotations

from typing import Any

from ..errors import warn
from .automatic import (
    MOST_DIRECT,
    MULTIGRIDS,
    SolverWithFallback,
    direct,
    iterative,
    lagged_factors,
    linear_options,
    with_fallback,
)
from .condensed import CondensedPreconditioner
from .elimination import (
    BodiesPreconditioner,
    ContactPreconditioner,
    lumped_mass,
    surface_stiffness,
)
from .kept_factors import KeptFactorsSolver, kept_factors
from .levels import near_nullspace, rigid_motions
from .petsc_objects import attach

__all__ = [
    "BodiesPreconditioner",
    "CondensedPreconditioner",
    "KeptFactorsSolver",
    "MOST_DIRECT",
    "MULTIGRIDS",
    "SolverWithFallback",
    "attach",
    "direct",
    "iterative",
    "kept_factors",
    "lagged_factors",
    "linear_options",
    "lumped_mass",
    "near_nullspace",
    "rigid_motions",
    "surface_stiffness",
    "with_fallback",
]

# Names of the last release, each with what stands for it
_OLDER = {"LaggedFactorsSolver": SolverWithFallback, "SPRINGS": 10.0}


def __getattr__(name: str) -> Any:
    """Look up a name that goes in the next release, with a warning."""
    if name not in _OLDER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn(
        f"raymortar.solvers.{name} has no use any more: it goes in the next release", 2
    )
    return _OLDER[name]
