"""Sensitivities through contact: exact gradients by one adjoint solve.

- functionals: what is differentiated: UFL functionals, forces of contact
- controls: by what: coefficients of the forms, and parameters of contact
- linear: the transposed system at a converged state, derivatives of contact
- forms: derivatives of the user's forms
- gradients: the gradient at one state
- tape: the gradient along a path with friction
"""

from .controls import coordinates, friction, offset, place, radius
from .functionals import force
from .gradients import gradient
from .tape import Tape

__all__ = [
    "Tape",
    "coordinates",
    "force",
    "friction",
    "gradient",
    "offset",
    "place",
    "radius",
]
