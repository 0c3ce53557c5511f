"""Contact between deformable bodies in large deformation, for FEniCSx."""

from . import solvers
from .contact import Contact
from .errors import ContactError, ConvergenceError
from .friction import Coulomb, Stick, Tresca
from .methods import AugmentedLagrangian, Penalty, Search
from .problem import NonlinearProblem
from .solver import LoadStep, LoadSteps, NewtonSolver, SNESSolver

__version__ = "0.1.0"

__all__ = [
    "AugmentedLagrangian",
    "Contact",
    "ContactError",
    "ConvergenceError",
    "Coulomb",
    "LoadStep",
    "LoadSteps",
    "NewtonSolver",
    "NonlinearProblem",
    "Penalty",
    "SNESSolver",
    "Search",
    "Stick",
    "Tresca",
    "solvers",
]
