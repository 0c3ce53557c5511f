"""Hooks by which floors extend the core: by the default of each the core stands alone.

`raymortar/__init__` sets those of the whole package. Hooks are called on all ranks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from .errors import ConvergenceError, raise_everywhere
from .finding import Finding


def describe_residuals(problem: Any) -> str:
    """Say what is known of a failed solve: its residuals."""
    norms = ", ".join(f"{norm:.3e}" for norm in problem.history)
    return f"residuals {norms}"


def require_convergence(problem: Any, converged: bool, reason: str) -> None:
    """Raise on every rank if a solve has failed."""
    if not converged:
        text = f"Newton did not converge {reason}: {hooks.describe(problem)}"
        raise_everywhere(problem.comm, text, ConvergenceError)


@dataclass
class Hooks:
    """Functions that floors put in the place of the core's, or beside them.

    Attributes
    ----------
    judge
        Judges the end of a solve, given the problem, whether it has converged, and its
        end in words: raises an error where it has failed.
    check
        Finds what is doubtful about a problem's present state.
    describe
        Message on a problem whose solve has failed.
    on_revolved, on_revolved_tools
        Called with the displacement and the facets of the zones of a solid of revolution;
        and with the tools that it meets and the communicator, where they have moved.
    on_made
        Called with a problem that has been made.
    on_volume
        Called with a coupled system that has read the volume's form, and with Dirichlet
        conditions.
    on_matrix
        Called with a coupled system before the memory of its first matrix is taken.
    on_setup
        Called with a problem whose first matrix is made, before the first solve.
    on_first_pairs
        Called with the surfaces of a contact that are paired for the first time.
    on_accept
        Called with the surfaces of a contact with curved facets whose step is accepted,
        until one returns True.
    keeper
        Makes the keeper of a volume's constant tangent, from the contact, its `Forms`, the
        pattern and the residual in UFL, which returns None where the tangent is not
        constant; None: tangents are assembled anew.
    linear_solver
        Chooses the linear solver of a problem, with or without SNES: its PETSc options
        and its name; None: the direct solver.
    as_target
        Makes a `Target` of what may be the master of a pair in place of a tag, and leaves
        all else as it is; None: a pair has tags and targets alone.
    all_facets, never_meet
        Sorts all exterior facets by tag and body, from the displacement, the mesh and its
        tags; lists facets that never meet each other, from two surfaces that share
        vertices and the communicator. None: sides are tags, and apart.
    curve
        Curves a surface of straight facets, from the surface, the mesh, its facets and
        the argument `smooth`; None: facets stay straight.
    adjust
        Makes near surfaces of a contact just touch, given a length; None: no adjustment.
    free_bodies
        Makes the equations of free targets, from the coupled system.
    bending
        Finds coefficients of laws at nodes, from the coupled system, the pattern of the
        volume and Dirichlet conditions, by ``bends(part)`` and ``coefficients(part)``
        until ``destroy()``; None: those of laws at points.
    constrain
        Makes the reduction of a problem's equations by constraints, given these, the
        system and Dirichlet conditions; None: a problem takes none.
    own_assembly
        Adds a contact, or several, to matrices and vectors that a user assembles; None:
        problems alone have contact.
    results, reactions
        Makes the results of a contact, or of several in one problem; finds the forces of
        a problem's supports by name. None: no results.
    """

    judge: Callable[[Any, bool, str], None] = require_convergence
    check: Callable[[Any], list[Finding]] = lambda problem: []
    describe: Callable[[Any], str] = describe_residuals
    on_revolved: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_revolved_tools: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_made: list[Callable[[Any], None]] = field(default_factory=list)
    on_volume: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_matrix: list[Callable[[Any], None]] = field(default_factory=list)
    on_setup: list[Callable[[Any], None]] = field(default_factory=list)
    on_first_pairs: list[Callable[[Any], None]] = field(default_factory=list)
    on_accept: list[Callable[[Any], bool]] = field(default_factory=list)
    keeper: Callable[[Any, Any, Any, Any], Any] | None = None
    linear_solver: Callable[[Any, bool], tuple[dict[str, Any], str]] | None = None
    as_target: Callable[[Any], Any] | None = None
    all_facets: Callable[[Any, Any, Any], Any] | None = None
    never_meet: Callable[[Any, Any, Any], Any] | None = None
    curve: Callable[[Any, Any, Any, Any], Any] | None = None
    adjust: Callable[[Any, float], Any] | None = None
    free_bodies: Callable[[Any], Any] | None = None
    bending: Callable[[Any, Any, Any], Any] | None = None
    constrain: Callable[[Any, Any, Any], Any] | None = None
    own_assembly: Callable[[Any], Any] | None = None
    results: Callable[[Any], Any] | None = None
    reactions: Callable[[Any, Any], dict[str, Any]] | None = None


hooks = Hooks()
