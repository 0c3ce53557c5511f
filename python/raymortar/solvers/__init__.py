"""Solvers of the coupled system: Newton's method, and iterative linear solvers.

- newton, snes: `NewtonSolver`, `SNESSolver`
- fixed_point: Newton's method at fixed segments, and a loop that pairs anew
- line_search, capped: shortened Newton steps
- linear: PETSc options of iterative solvers, which this module offers
- automatic: the default linear solver, and the one that takes over if it stalls
- elimination, springs: a preconditioner that eliminates multipliers
- bodies, levels, interpolation, near_contact: a preconditioner with the levels of the
  bodies
- kept_factors, surface_system, compliance, coupling, supports, small_systems: a direct
  solver that keeps the factors of linear bodies
- lagged_factors: GMRES with the factors of an earlier tangent
"""

from .automatic import (
    MOST_DIRECT,
    SolverWithFallback,
    direct,
    linear_options,
    with_fallback,
)
from .bodies import BodiesPreconditioner
from .elimination import SPRINGS, ContactPreconditioner, attach
from .kept_factors import KeptFactorsSolver, kept_factors
from .lagged_factors import LaggedFactorsSolver, lagged_factors
from .linear import MULTIGRIDS, iterative
from .rigid_motions import near_nullspace, rigid_motions
from .springs import lumped_mass, surface_stiffness

__all__ = [
    "BodiesPreconditioner",
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
