"""Motion with contact: inertia without mass at contact surfaces, and time steps.

- massless, inertia: nodes of contact surfaces have no mass
- schemes: schemes of time integration
- motion, moving_bodies: what a step starts from, and inertia in its equations
- time_path, time_steps: paths of time and the loop over steps
- account: energies and momentum
"""

from .account import Energy
from .inertia import Inertia
from .schemes import GeneralizedAlpha, Midpoint, Newmark
from .time_path import Adaptive
from .time_steps import TimeStep, TimeSteps

__all__ = [
    "Adaptive",
    "Energy",
    "GeneralizedAlpha",
    "Inertia",
    "Midpoint",
    "Newmark",
    "TimeStep",
    "TimeSteps",
]
