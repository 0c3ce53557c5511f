"""Contact between deformable bodies in large deformation, for FEniCSx."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import io, rigid, solvers, tools
from .condensed.condensed_problem import CondensedProblem
from .constraints.reduction import Constraints
from .core.contact import Contact
from .core.errors import (
    ContactError,
    ContactLost,
    ContactWarning,
    ConvergenceError,
    SetUpError,
)
from .core.finding import Finding
from .core.hooks import hooks
from .core.interface.pairs import Pair
from .core.interface.point_results import Status
from .core.nonlinear_problem import NonlinearProblem
from .core.options.friction import Coulomb, Friction, Stick, Tresca
from .core.options.methods import AugmentedLagrangian, Penalty, Search
from .core.solvers.newton import NewtonSolver, SNESSolver
from .core.solvers.solver import FixedPointSolver
from .diagnose.failure import describe
from .diagnose.outcome import check, require_convergence
from .diagnose.overlap import warn_of_overlaps
from .diagnose.rigid_slaves import refuse_finer_rigid_slaves
from .paths.checkpoint import Checkpoint
from .paths.controls import ArcLength, DisplacementControl
from .paths.history import History
from .paths.load_steps import LoadSteps
from .paths.output import LoadStep, Output
from .results.nodal_fields import results_of
from .rigid.body import as_body
from .rigid.free_bodies import FreeBodies
from .smooth.curving import curve
from .smooth.straight_facets import look_at_straight_facets, warn_of_turned_arcs
from .solvers.automatic import suited_to_size
from .solvers.kept_forms import keeper
from .ties.pretension import Pretension
from .ties.tie import Tie

if TYPE_CHECKING:
    from . import adjoint, dynamics
    from .adhesion.cohesive import Cohesive
    from .fluxes.field_problem import FieldProblem
    from .fluxes.field_tie import FieldTie
    from .fluxes.flux import Flux, FluxRates
    from .fluxes.tool_part import ToolField
    from .fluxes.wear import Archard, Wear
    from .plotting.movie import Movie
    from .plotting.picture import plot

# The floors extend the core
hooks.judge, hooks.check, hooks.describe = require_convergence, check, describe
hooks.on_setup += [refuse_finer_rigid_slaves, warn_of_overlaps]
hooks.on_first_pairs.append(look_at_straight_facets)
hooks.on_accept.append(warn_of_turned_arcs)
hooks.keeper, hooks.linear_solver = keeper, suited_to_size
hooks.results, hooks.free_bodies = results_of, FreeBodies
hooks.as_target, hooks.curve = as_body, curve
hooks.constrain = Constraints

# Rooms of names that are imported when they are first asked for
_ON_DEMAND = {
    "Archard": "fluxes.wear",
    "Cohesive": "adhesion.cohesive",
    "FieldProblem": "fluxes.field_problem",
    "FieldTie": "fluxes.field_tie",
    "Flux": "fluxes.flux",
    "FluxRates": "fluxes.flux",
    "Movie": "plotting.movie",
    "ToolField": "fluxes.tool_part",
    "Wear": "fluxes.wear",
    "plot": "plotting.picture",
}

__version__ = "0.1.0"

__all__ = [
    "ArcLength",
    "Archard",
    "AugmentedLagrangian",
    "Checkpoint",
    "Cohesive",
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
    "Finding",
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
    "Pretension",
    "SNESSolver",
    "Search",
    "SetUpError",
    "Status",
    "Stick",
    "Tie",
    "ToolField",
    "Tresca",
    "Wear",
    "adjoint",
    "dynamics",
    "io",
    "plot",
    "rigid",
    "solvers",
    "tools",
]

# Names that have moved
_MOVED = {"NodeStatus": "Status", "PointStatus": "Status"}
_MOVED_ROOMS = {"compat": "core.compat", "partitions": "io.partitions"}


def __getattr__(name: str) -> Any:
    """Import a name that few programs need, and keep it; find one that has moved, with a
    warning."""
    if name in _MOVED:
        warnings.warn(f"{name} is {_MOVED[name]} now", DeprecationWarning, stacklevel=2)
        return globals()[_MOVED[name]]
    if name in _MOVED_ROOMS:
        place = f"{__name__}.{_MOVED_ROOMS[name]}"
        warnings.warn(
            f"raymortar.{name} is {place} now", DeprecationWarning, stacklevel=2
        )
        return import_module(place)
    if name in ("adjoint", "dynamics"):
        return import_module(f".{name}", __name__)
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f".{_ON_DEMAND[name]}", __name__), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """List the public names, without rooms such as ``raymortar.discretization``."""
    return [*__all__, "__version__"]
