"""Attributes of contacts, problems and solvers that have moved."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from operator import attrgetter
from pkgutil import resolve_name
from typing import Any

import numpy as np

from .core.compat import Array
from .core.interaction import Interaction
from .core.problem import CoupledProblem
from .core.solvers.solver import CoupledSolver


def _own_couplings(contact: Interaction) -> Array:
    """Coupling of each row of the forms to its field, (owned rows,)."""
    system = contact.system
    found = np.zeros(system.layout.n)
    for field, row in zip(system.unknowns.fields(), system.volume.couplings):
        found[field.rows] = row[field.rows]
    return found


# Where an attribute is now, in words, and what finds it
Place = tuple[str, Callable[[Any], Any]]


def _function(what: str, place: str) -> Place:
    """A method that is a function now, by its place: its object is the first argument."""
    return f"{place}({what}, ...)", lambda thing: partial(resolve_name(place), thing)


_OF_CONTACT: dict[str, Place] = {
    name: (f"contact.{owner}.{name}", attrgetter(f"{owner}.{name}"))
    for owner, names in {
        "system": "add_tangent assemble_residual axisymmetric bodies constrained cpp "
        "extend_room free_bodies preallocations prepare require_mesh revision "
        "set_groups solve_for stiffness_diagonal take updates use_volume",
        "states": "changing extrapolate go_back owners quantities u_of u_old values_of",
        "results": "accumulated_slip coverage meetings of_pair parts_of_all resultant_on "
        "resultants to_nodes write_segments",
        "surfaces": "interfaces slave_u",
        "assembly": "gamma_scale",
        "offsets": "excess",
    }.items()
    for name in names.split()
}
_OF_CONTACT["own_couplings"] = "contact.system.volume.couplings", _own_couplings
_OF_CONTACT["translation_forces"] = (
    "contact.system.volume.translation",
    attrgetter("system.volume.translation"),
)
_OF_PROBLEM = {"as_part": _function("problem", "raymortar.diagnose.failure.as_part")}
_OF_SOLVER = {
    name: _function("solver", f"raymortar.solvers.one_tangent.{name}")
    for name in ("linearise", "correct")
}
_KINDS: dict[str, tuple[type, dict[str, Place]]] = {
    "contact": (Interaction, _OF_CONTACT),
    "problem": (CoupledProblem, _OF_PROBLEM),
    "solver": (CoupledSolver, _OF_SOLVER),
}


def find(thing: Any, name: str) -> Any:
    """Find an attribute of a contact, problem or solver that has moved, with a
    DeprecationWarning at the line that asks for it.

    Raises
    ------
    AttributeError
        That of the object, where the name has not moved.
    """
    for what, (kind, moved) in _KINDS.items():
        if isinstance(thing, kind) and name in moved:
            now, get = moved[name]
            # This function, the hook that calls it, and the object's own
            warnings.warn(
                f"{what}.{name} has moved: use {now}", DeprecationWarning, stacklevel=4
            )
            return get(thing)
    return object.__getattribute__(thing, name)
