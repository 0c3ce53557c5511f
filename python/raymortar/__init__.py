"""Contact between deformable bodies in large deformation, for FEniCSx."""

from . import rigid, solvers
from .contact import Contact
from .control import ArcLength, DisplacementControl
from .errors import (
    ContactError,
    ContactLost,
    ContactWarning,
    ConvergenceError,
    SetUpError,
)
from .fixed_point import FixedPointSolver
from .friction import Coulomb, Friction, Stick, Tresca
from .history import History
from .load_step import LoadStep
from .load_steps import LoadSteps
from .methods import AugmentedLagrangian, Penalty, Search
from .nonlinear_problem import NonlinearProblem
from .output import Output
from .pairs import Pair
from .picture import plot
from .solver import NewtonSolver, SNESSolver
from .tie import Tie

__version__ = "0.1.0"

__all__ = [
    "ArcLength",
    "AugmentedLagrangian",
    "Contact",
    "ContactError",
    "ContactLost",
    "ContactWarning",
    "ConvergenceError",
    "Coulomb",
    "DisplacementControl",
    "FixedPointSolver",
    "Friction",
    "History",
    "LoadStep",
    "LoadSteps",
    "NewtonSolver",
    "NonlinearProblem",
    "Output",
    "Pair",
    "Penalty",
    "SNESSolver",
    "Search",
    "SetUpError",
    "Stick",
    "Tie",
    "Tresca",
    "plot",
    "rigid",
    "solvers",
]
