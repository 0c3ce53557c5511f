"""Contact between deformable bodies in large deformation, for FEniCSx."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .core import on_demand
from .core.contact import Contact
from .core.errors import ContactError, ContactWarning, ConvergenceError
from .core.hooks import hooks
from .core.nonlinear_problem import NonlinearProblem
from .core.options.friction import Coulomb, Stick, Tresca
from .core.options.methods import AugmentedLagrangian, Penalty, Search
from .core.solvers.newton import NewtonSolver, SNESSolver

if TYPE_CHECKING:
    from . import (
        adjoint,
        dynamics,
        fluxes,
        io,
        paths,
        plotting,
        results,
        rigid,
        solvers,
        tools,
    )
    from .adhesion.cohesive import Cohesive
    from .condensed.condensed_problem import CondensedProblem
    from .dynamics.time_steps import TimeSteps
    from .mass.inertia import Inertia
    from .paths.load_steps import LoadSteps
    from .plotting.picture import plot
    from .records.checkpoint import Checkpoint
    from .records.history import History
    from .ties.pretension import Pretension
    from .ties.tie import Tie
    from .user_laws.friction import Friction

__version__ = "0.1.0"

__all__ = [
    "AugmentedLagrangian",
    "Checkpoint",
    "Cohesive",
    "CondensedProblem",
    "Contact",
    "ContactError",
    "ContactWarning",
    "ConvergenceError",
    "Coulomb",
    "Friction",
    "History",
    "Inertia",
    "LoadSteps",
    "NewtonSolver",
    "NonlinearProblem",
    "Penalty",
    "Pretension",
    "SNESSolver",
    "Search",
    "Stick",
    "Tie",
    "TimeSteps",
    "Tresca",
    "adjoint",
    "dynamics",
    "fluxes",
    "io",
    "paths",
    "plot",
    "plotting",
    "results",
    "rigid",
    "solvers",
    "tools",
]

# Rooms, and modules of names that not every program needs
_PLACES = {
    **{name: "" for name in __all__ if name.islower() and name != "plot"},
    "Checkpoint": ".records.checkpoint",
    "Cohesive": ".adhesion.cohesive",
    "CondensedProblem": ".condensed.condensed_problem",
    "Friction": ".user_laws.friction",
    "History": ".records.history",
    "Inertia": ".mass.inertia",
    "LoadSteps": ".paths.load_steps",
    "Pretension": ".ties.pretension",
    "Tie": ".ties.tie",
    "TimeSteps": ".dynamics",
    "plot": ".plotting.picture",
}
# Names that have moved, and where they are
_MOVED = {
    "ArcLength": "paths.ArcLength",
    "Archard": "fluxes.Archard",
    "ContactLost": "core.errors.ContactLost",
    "DisplacementControl": "paths.DisplacementControl",
    "FieldProblem": "fluxes.FieldProblem",
    "FieldTie": "fluxes.FieldTie",
    "Finding": "core.finding.Finding",
    "Flux": "fluxes.Flux",
    "FluxRates": "fluxes.flux.FluxRates",
    "LoadStep": "paths.LoadStep",
    "Movie": "plotting.Movie",
    "NodeStatus": "results.Status",
    "Output": "paths.Output",
    "Pair": "results.Pair",
    "PointStatus": "results.Status",
    "SetUpError": "core.errors.SetUpError",
    "Status": "results.Status",
    "ToolField": "fluxes.ToolField",
    "Wear": "fluxes.Wear",
    "compat": "versions",
    "partitions": "io.partitions",
}

__getattr__ = on_demand.lookup(
    __name__, _PLACES, {name: f"{__name__}.{new}" for name, new in _MOVED.items()}
)


def __dir__() -> list[str]:
    """List the public names, without rooms such as ``raymortar.diagnose``."""
    return [*__all__, "__version__"]


def _floor(place: str) -> Callable[..., Any]:
    """A function of a floor, which is imported when it is first called."""
    return on_demand.function(f"{__name__}.{place}")


# The floors extend the core
hooks.judge = _floor("diagnose.outcome.require_convergence")
hooks.check = _floor("diagnose.outcome.check")
hooks.describe = _floor("diagnose.failure.describe")
hooks.on_pairs.append(_floor("setup.arguments.check_pairs"))
hooks.on_arguments.append(_floor("setup.arguments.check_arguments"))
hooks.on_tags.append(_floor("setup.facets.check_tags"))
hooks.on_facets.append(_floor("setup.facets.check_facets"))
hooks.on_meshes.append(_floor("setup.facets.check_meshes"))
hooks.on_zones.append(_floor("setup.facets.check_zones"))
hooks.on_revolved.append(_floor("setup.revolution.check"))
hooks.on_forms.append(_floor("setup.forms.check_forms"))
hooks.on_tools.append(_floor("setup.rigid_loads.check"))
hooks.on_prescribed.append(_floor("setup.held_slaves.refuse_held_on_tools"))
hooks.on_held.append(_floor("setup.held_slaves.refuse_held"))
hooks.on_volume += [
    _floor("setup.forms.check_coefficients"),
    _floor("setup.forms.warn_of_plane_form"),
]
hooks.on_made += [
    _floor("setup.problems.warn_of_shared_pairs"),
    _floor("setup.problems.warn_of_inertia"),
]
hooks.on_matrix.append(_floor("setup.memory.require_memory"))
hooks.on_setup += [
    _floor("setup.rigid_slaves.refuse_finer_rigid_slaves"),
    _floor("setup.overlap.warn_of_overlaps"),
]
hooks.on_first_pairs.append(_floor("setup.straight_facets.look_at_straight_facets"))
hooks.on_accept.append(_floor("setup.straight_facets.warn_of_turned_arcs"))
hooks.convergence = _floor("diagnose.trouble.Watched")
hooks.keeper = _floor("solvers.kept_forms.keeper")
hooks.linear_solver = _floor("solvers.automatic.linear_options")
hooks.options = _floor("solvers.settings.WatchedOptions")
hooks.on_solver.append(_floor("solvers.inner.attach"))
hooks.on_setting.append(_floor("solvers.settings.check_name"))
hooks.on_solve.append(_floor("solvers.settings.check_unknowns"))
hooks.reason = _floor("solvers.settings.reason_in_words")
hooks.several = _floor("several.interactions.Interactions")
hooks.own_assembly = _floor("own_assembly.assembly.OwnAssembly")
hooks.names = _floor("diagnose.groups.names_of")
hooks.moved = _floor("moved.find")
hooks.results = _floor("results.nodal_fields.results_of")
hooks.reactions = _floor("results.reactions.reactions")
hooks.shared = _floor("setup.shared_vertices.shared")
hooks.exact = _floor("exact.Augmentation")
hooks.behind = _floor("setup.thickness.behind")
hooks.excess = _floor("setup.interference.excess")
hooks.adjust = _floor("setup.adjustment.adjust")
hooks.free_bodies = _floor("rigid.free_bodies.FreeBodies")
hooks.all_facets = _floor("self_contact.all_facets.all_facets")
hooks.never_meet = _floor("self_contact.never_meet.facets_that_never_meet")
hooks.bending = _floor("bending.coefficients.Bending")
hooks.as_target = _floor("rigid.body.as_body")
hooks.curve = _floor("smooth.curving.curve")
hooks.constrain = _floor("constraints.reduction.Constraints")
