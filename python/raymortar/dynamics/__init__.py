"""Motion with contact: inertia without mass at contact surfaces, and time steps.

- massless, inertia: nodes of contact surfaces have no mass
- schemes: schemes of time integration, paths of time
- motion, moving_bodies: what a step starts from, and inertia in its equations
- time_steps: the loop over steps
- account: energies and momentum
"""

from .account import Energy
from .inertia import Inertia
from .schemes import Adaptive, GeneralizedAlpha, Midpoint, Newmark
from .time_steps import TimeStep, TimeSteps

__all__ = [
    "Adaptive",
    "GeneralizedAlpha",
    "Midpoint",
    "Newmark",
]
