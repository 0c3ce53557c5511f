"""Linear solvers beyond the direct one, and what they keep.

- automatic: the solver that suits the size, and iterative ones; linear: direct ones
- keeping_factors, compliance: a direct solver that keeps the factors of linear bodies
- lagging_factors: the factors of an earlier tangent as preconditioner
- elimination, levels: a preconditioner that eliminates multipliers, with the levels of
  the bodies
- condensed: a preconditioner of condensed systems
- correcting: corrections of iterates by the factors of their last tangent
- kept_forms: what is kept of linear forms
- inner: Python contexts that know the problem, solvers within solvers
- settings: misspelt options and settings, PETSc's reasons in words
- one_tangent: systems with one tangent, for paths
"""

from typing import TYPE_CHECKING

from ..core import on_demand

if TYPE_CHECKING:
    from .automatic import iterative, with_fallback
    from .condensed import CondensedPreconditioner
    from .keeping_factors import kept_factors
    from .lagging_factors import lagged_factors
    from .linear import direct

__all__ = [
    "CondensedPreconditioner",
    "direct",
    "iterative",
    "kept_factors",
    "lagged_factors",
    "with_fallback",
]

_PLACES = {
    "CondensedPreconditioner": ".condensed",
    "direct": ".linear",
    "iterative": ".automatic",
    "kept_factors": ".keeping_factors",
    "lagged_factors": ".lagging_factors",
    "with_fallback": ".automatic",
}
# Names that are no longer public, and where they are
_MOVED = {
    "BodiesPreconditioner": "solvers.elimination.BodiesPreconditioner",
    "ContactPreconditioner": "solvers.elimination.ContactPreconditioner",
    "KeptFactorsSolver": "solvers.keeping_factors.KeptFactorsSolver",
    "LaggedFactorsSolver": "solvers.lagging_factors.LaggedFactorsSolver",
    "MOST_DIRECT": "solvers.automatic.MOST_DIRECT",
    "MULTIGRIDS": "solvers.automatic.MULTIGRIDS",
    "SolverWithFallback": "solvers.automatic.SolverWithFallback",
    "attach": "solvers.inner.attach",
    "linear_options": "solvers.automatic.linear_options",
    "lumped_mass": "solvers.elimination.lumped_mass",
    "near_nullspace": "solvers.levels.near_nullspace",
    "rigid_motions": "solvers.levels.rigid_motions",
    "surface_stiffness": "solvers.elimination.surface_stiffness",
}

__getattr__ = on_demand.lookup(
    __name__, _PLACES, {name: f"raymortar.{new}" for name, new in _MOVED.items()}
)
