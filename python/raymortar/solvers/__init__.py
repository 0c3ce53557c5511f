"""Solvers of the coupled system: Newton's method, and iterative linear solvers.

- solver: linear systems, checks and failures of both Newton solvers
- newton, snes: `NewtonSolver`, `SNESSolver`
- fixed_point: Newton's method at fixed segments, and a loop that pairs anew
- automatic: PETSc options of linear solvers, and the default
- kept_factors, compliance: a direct solver that keeps the factors of linear bodies
- lagged_factors: GMRES with the factors of an earlier tangent
- elimination, levels: preconditioners that eliminate multipliers, also one with the
  levels of the bodies
- condensed, node_frames: a preconditioner of condensed systems
- petsc_objects: PETSc options, and solvers within solvers
"""

from .automatic import (
    MOST_DIRECT,
    MULTIGRIDS,
    SolverWithFallback,
    direct,
    iterative,
    linear_options,
    with_fallback,
)
from .condensed import CondensedPreconditioner
from .elimination import (
    SPRINGS,
    BodiesPreconditioner,
    ContactPreconditioner,
    lumped_mass,
    surface_stiffness,
)
from .kept_factors import KeptFactorsSolver, kept_factors
from .lagged_factors import LaggedFactorsSolver, lagged_factors
from .levels import near_nullspace, rigid_motions
from .petsc_objects import attach

__all__ = [
    "BodiesPreconditioner",
    "CondensedPreconditioner",
    "ContactPreconditioner",
    "KeptFactorsSolver",
    "LaggedFactorsSolver",
    "MOST_DIRECT",
    "MULTIGRIDS",
    "SPRINGS",
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
