"""Solvers of the coupled system: Newton's method, and iterative linear solvers.

- newton: `NewtonSolver`, `SNESSolver`
- fixed_point: segments fixed inside, paired anew outside
- line_search, capped: steps that full ones do not solve
- linear: PETSc options of iterative solvers, which this module offers
"""

from .linear import (
    MULTIGRIDS,
    SPRINGS,
    ContactPreconditioner,
    attach,
    iterative,
    lumped_mass,
    near_nullspace,
    rigid_motions,
    surface_stiffness,
)

__all__ = [
    "ContactPreconditioner",
    "MULTIGRIDS",
    "SPRINGS",
    "attach",
    "iterative",
    "lumped_mass",
    "near_nullspace",
    "rigid_motions",
    "surface_stiffness",
]
