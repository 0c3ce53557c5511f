"""Sensitivities through contact: exact gradients by one adjoint solve.

- functionals: what is differentiated: UFL functionals, forces of contact
- controls: by what: coefficients of the forms
- linear: the transposed system at a converged state
- forms: derivatives of the user's forms
- kinks: states without a derivative
- gradients: the gradient at one state
"""

from .functionals import force
from .gradients import gradient

__all__ = ["force", "gradient"]
