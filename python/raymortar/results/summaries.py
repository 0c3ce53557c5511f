"""One line that says what an object is, for ``repr``.

Nothing here communicates: a line may be printed by one rank alone. Counts are those of
this rank, and a line says so where there are several.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from dolfinx.fem import Function

from ..interface.point_results import CLOSED, OPEN

if TYPE_CHECKING:
    from ..contact import Contact
    from ..paths.history import History
    from ..paths.load_steps import LoadSteps
    from ..problem import CoupledProblem


def of_options(options: Any) -> str:
    """A method or a law with the arguments that are no defaults."""
    if not dataclasses.is_dataclass(options):
        return repr(options)
    changed = [
        f"{field.name}={_of_value(getattr(options, field.name))}"
        for field in dataclasses.fields(options)
        if getattr(options, field.name) is not field.default
    ]
    return f"{type(options).__name__}({', '.join(changed)})"


def _of_value(value: Any) -> str:
    """A number, a field or a function as a user would call it."""
    if isinstance(value, Function):
        return f"Function {value.name!r}"
    if callable(value):
        return str(getattr(value, "__name__", type(value).__name__))
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else repr(value)


def _of_gamma(gamma: Any) -> str:
    if gamma is None:
        return "gamma not yet set"
    return (
        f"gamma {_of_value(gamma) if isinstance(gamma, Function) else f'{gamma:.4g}'}"
    )


def _here(comm: Any) -> str:
    return "" if comm.size == 1 else f" on rank {comm.rank} of {comm.size}"


def of_contact(contact: Contact) -> str:
    """Pairs, method, law, coefficient, and counts of this rank."""
    facets = sum(len(zone.facets.slave_surface.facet_ids) for zone in contact.zones)
    counts = f"{facets} slave facets"
    if contact.updates:
        status = np.concatenate([zone.points()["status"] for zone in contact.zones])
        hits, closed = (np.count_nonzero(status >= least) for least in (OPEN, CLOSED))
        counts += f", {hits} of {len(status)} points hit, {closed} closed"
    else:
        counts += ", not yet paired"
    friction = "no friction"
    if contact.tied is not None:
        friction = f"gaps {'kept' if contact.tied == 'keep' else 'closed'}"
    elif contact.friction is not None:
        friction = of_options(contact.friction)
    parts = [
        ", ".join(map(str, contact.pairs)),
        f"{of_options(contact.method)}, {friction}, {_of_gamma(contact.gamma)}",
        counts + _here(contact.layout.comm),
    ]
    return f"<{type(contact).__name__} of {'; '.join(parts)}>"


def of_contacts(contacts: Sequence[Contact]) -> str:
    """Several contacts in one problem."""
    return f"<Interactions of {len(contacts)}: {', '.join(map(repr, contacts))}>"


def of_problem(problem: CoupledProblem) -> str:
    """Unknowns, conditions and contact of a problem."""
    functions = problem.contact.host.functions
    solved_for = ", ".join(repr(f.name) for f in functions)
    conditions = len(problem.bcs)
    return (
        f"<{type(problem).__name__} for {solved_for}, "
        f"{problem.contact.layout.ranges[-1]} unknowns, {conditions} Dirichlet "
        f"condition{'' if conditions == 1 else 's'}, {problem.contact!r}>"
    )


def of_load_steps(steps: LoadSteps, factor: float) -> str:
    """How a path is led, and how far it is."""
    begin, end = steps.path
    led = "" if steps.control is None else f" led by {type(steps.control).__name__}"
    return (
        f"<LoadSteps from {begin:g} to {end:g} in {steps.steps} steps{led} with "
        f"{type(steps.solver).__name__}, strategy {steps.strategy!r}, at load factor "
        f"{factor:.6g}, {steps.halvings} halvings>"
    )


def of_history(history: History) -> str:
    """Records, columns and file."""
    file = "no file" if history.path is None else f"file {str(history.path)!r}"
    return (
        f"<History of {len(history)} records, {file}, columns "
        f"{', '.join(history.columns)}>"
    )
