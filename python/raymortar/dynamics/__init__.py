"""Motion with contact: time steps with the inertia of `mass`.

- schemes: schemes of time integration, paths of time
- motion, moving_bodies: what a step starts from, and inertia in its equations
- rest: static balance of values without mass
- time_steps: the loop over steps
- account: energies and momentum
"""

from ..mass.inertia import Inertia
from .account import Energy
from .schemes import Adaptive, GeneralizedAlpha, Midpoint, Newmark
from .time_steps import TimeStep, TimeSteps

__all__ = [
    "Adaptive",
    "GeneralizedAlpha",
    "Midpoint",
    "Newmark",
]
