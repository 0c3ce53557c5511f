"""Sensitivities through contact: exact gradients by one adjoint solve.

- functionals: what is differentiated: UFL functionals, forces of contact
- controls: by what: coefficients of the forms
- parameters, coordinates: by what: parameters of contact, undeformed positions
- linear: the transposed system at a converged state, derivatives of contact
- forms: derivatives of the user's forms
- kinks: states without a derivative
- gradients: the gradient at one state
- tape: gradients along a path
"""

from .coordinates import coordinates
from .functionals import force
from .gradients import gradient
from .parameters import friction, gamma, offset, place, radius
from .tape import Tape

__all__ = [
    "Tape",
    "coordinates",
    "force",
    "friction",
    "gamma",
    "gradient",
    "offset",
    "place",
    "radius",
]
