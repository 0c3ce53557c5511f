"""Solvers of the coupled system: Newton's method, and iterative linear solvers.

- newton: `NewtonSolver`, `SNESSolver`
- fixed_point: segments fixed inside, paired anew outside
- line_search, capped: steps that full ones do not solve
- linear: PETSc options of iterative solvers, which this module offers
- automatic: which one a problem gets, and what takes over where it stalls
- elimination, springs: a preconditioner without multipliers
- bodies, levels, interpolation, near_contact: one at the price of the bodies
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
from .linear import MULTIGRIDS, iterative
from .rigid_motions import near_nullspace, rigid_motions
from .springs import lumped_mass, surface_stiffness

__all__ = [
    "BodiesPreconditioner",
    "ContactPreconditioner",
    "MOST_DIRECT",
    "MULTIGRIDS",
    "SPRINGS",
    "SolverWithFallback",
    "attach",
    "direct",
    "iterative",
    "linear_options",
    "lumped_mass",
    "near_nullspace",
    "rigid_motions",
    "surface_stiffness",
    "with_fallback",
]
