"""Linear solvers beyond the direct one, and what they keep.

- automatic: the solver that suits the size, and iterative ones
- kept_factors, compliance: a direct solver that keeps the factors of linear bodies
- lagged_factors: the factors of an earlier tangent as preconditioner
- elimination, levels: a preconditioner that eliminates multipliers, with the levels of
  the bodies
- condensed: a preconditioner of condensed systems
- kept_forms: what is kept of linear forms
"""

from __future__ import annotations

from typing import Any

from ..core.errors import warn
from ..core.solvers.linear import direct, linear_options
from ..core.solvers.petsc_objects import attach
from .automatic import (
    MOST_DIRECT,
    MULTIGRIDS,
    SolverWithFallback,
    iterative,
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
from .lagged_factors import lagged_factors
from .levels import near_nullspace, rigid_motions

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


def __getattr__(name: str) -> Any:
    """Look up a name that goes in the next release, with a warning."""
    if name != "SPRINGS":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn("raymortar.solvers.SPRINGS has no use any more: it goes in the next release")
    return 10.0
