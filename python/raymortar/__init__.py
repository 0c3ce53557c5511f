"""Contact between deformable bodies in large deformation, for FEniCSx."""

import warnings
from typing import Any

from . import dynamics, io, rigid, solvers, tools
from .condensed import CondensedProblem
from .contact import Contact
from .diagnose.failure import describe
from .diagnose.outcome import require_convergence
from .errors import (
    ContactError,
    ContactLost,
    ContactWarning,
    ConvergenceError,
    SetUpError,
)
from .field_problem import FieldProblem
from .flux import Flux, FluxRates
from .hooks import hooks
from .interface.overlap import warn_of_overlaps
from .interface.pairs import Pair
from .interface.point_results import Status
from .nonlinear_problem import NonlinearProblem
from .options.friction import Coulomb, Friction, Stick, Tresca
from .options.methods import AugmentedLagrangian, Penalty, Search
from .paths.checkpoint import Checkpoint
from .paths.controls import ArcLength, DisplacementControl
from .paths.history import History
from .paths.load_steps import LoadSteps
from .paths.output import LoadStep, Output
from .plotting.movie import Movie
from .plotting.picture import plot
from .solvers.automatic import suited_to_size
from .solvers.newton import NewtonSolver, SNESSolver
from .solvers.solver import FixedPointSolver
from .system.kept_forms import keeper
from .system.tool_part import ToolField
from .tie import FieldTie, Tie
from .wear import Archard, Wear

# What the package adds to its core
hooks.judge, hooks.describe = require_convergence, describe
hooks.on_setup.append(warn_of_overlaps)
hooks.keeper, hooks.linear_solver = keeper, suited_to_size

__version__ = "0.1.0"

__all__ = [
    "ArcLength",
    "Archard",
    "AugmentedLagrangian",
    "Checkpoint",
    "CondensedProblem",
    "Contact",
    "ContactError",
    "ContactLost",
    "ContactWarning",
    "ConvergenceError",
    "Coulomb",
    "DisplacementControl",
    "FieldProblem",
    "FieldTie",
    "FixedPointSolver",
    "Flux",
    "FluxRates",
    "Friction",
    "History",
    "LoadStep",
    "LoadSteps",
    "Movie",
    "NewtonSolver",
    "NonlinearProblem",
    "Output",
    "Pair",
    "Penalty",
    "SNESSolver",
    "Search",
    "SetUpError",
    "Status",
    "Stick",
    "Tie",
    "ToolField",
    "Tresca",
    "Wear",
    "dynamics",
    "io",
    "plot",
    "rigid",
    "solvers",
    "tools",
]

# Names of one release ago
_MOVED = {"NodeStatus": "Status", "PointStatus": "Status"}


def __getattr__(name: str) -> Any:
    """Find a name that has moved, with a warning."""
    if name not in _MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(f"{name} is {_MOVED[name]} now", DeprecationWarning, stacklevel=2)
    return globals()[_MOVED[name]]


def __dir__() -> list[str]:
    """List the public names, without rooms such as ``raymortar.discretization``."""
    return [*__all__, "__version__"]
