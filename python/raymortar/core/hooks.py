"""Hooks by which floors extend the core: by the default of each the core stands alone.

`raymortar/__init__` sets those of the whole package. Hooks are called on all ranks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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


def all_thick(mesh: Any) -> Callable[[Any, float], Any]:
    """Let all bodies of a mesh be as thick as is asked for."""
    return lambda facets, most: np.full(len(facets.cells), most)


def number_groups(system: Any, groups: Any) -> list[str]:
    """Name groups of rows by their numbers."""
    return [f"group {k}" for k in range(groups.count)]


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
    on_pairs, on_arguments
        Called with pairs of numbers, `ALL` or targets, and the name of each tag; and with
        the arguments of a contact, `Given`.
    on_tags, on_facets
        Called with a mesh, its tags, one that is looked up, None for all, and what
        messages call it; and with a mesh and facets of a contact.
    on_meshes, on_zones
        Called with `Tagged` facets of several meshes and the tags of one side of a pair;
        and with the displacement and the facets of all zones.
    on_revolved
        Called with the displacement and the facets of the zones of a solid of revolution.
    on_tools
        Called with a zone that meets rigid bodies, which may have moved, and whether it
        has friction.
    on_prescribed, on_held
        Called with the surfaces of a contact that meets rigid bodies, and which dofs of
        the displacement are prescribed; and with surfaces of which some facet has no free
        dof, or some node none along the normal, and these nodes, None for none.
    on_forms
        Called with residual, Jacobian and unknowns as they were given, and `Unknowns`.
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
    convergence
        Makes what judges the iterates of a problem, a `Convergence`, from its groups of
        rows; None: one that ends no solve early.
    keeper
        Makes the keeper of a volume's constant tangent, from the contact, its `Forms`, the
        pattern and the residual in UFL, which returns None where the tangent is not
        constant; None: tangents are assembled anew.
    linear_solver
        Chooses the PETSc options of the linear solver of a problem, from those that the
        user has given, their prefix, and whether they are of SNES; None: the direct solver.
    options
        Makes a solver's `PetscOptions`, from prefix, options, and names of the user's;
        None: plain ones.
    on_solver
        Called with a KSP whose options have been read, the problem, the factors of its
        rows, and a list of errors to raise after a solve.
    on_setting, on_solve
        Called with a solver and the name of an attribute that is set; and, before a solve,
        with the problem and what the user calls its unknowns.
    reason
        Puts PETSc's reason for the end of a solve in words.
    shared
        Finds whether two sides on one mesh share vertices, and whether these are the tips
        of a crack, from the mesh, their facets, and whether they may; the core alone
        takes them to be apart.
    exact
        Makes of the surfaces of a contact what closes the gaps that a penalty leaves, a
        `Correction` and `Follower`; None: no penalty is exact.
    behind
        Makes of a mesh what tells the lengths of the undeformed body behind facets, from
        these and a length from which on a body is thick.
    excess
        Message on an offset that has been set, from the surfaces of a contact, where no
        body is as thick as it is deep.
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
    several
        Makes one `Interaction` of two or more contacts; None: a problem has one contact.
    own_assembly
        Adds a contact, or several, to matrices and vectors that a user assembles; None:
        problems alone have contact.
    names
        Names the groups of rows of a coupled system, for messages.
    moved
        Finds an attribute of a contact, problem or solver that is none any more, or raises
        an error.
    results, reactions
        Makes the results of a contact, or of several in one problem; finds the forces of
        a problem's supports by name. None: no results.
    """

    judge: Callable[[Any, bool, str], None] = require_convergence
    check: Callable[[Any], list[Finding]] = lambda problem: []
    describe: Callable[[Any], str] = describe_residuals
    on_pairs: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_arguments: list[Callable[[Any], None]] = field(default_factory=list)
    on_tags: list[Callable[[Any, Any, Any, str], None]] = field(default_factory=list)
    on_facets: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_meshes: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_zones: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_forms: list[Callable[[Any, Any, Any, Any], None]] = field(default_factory=list)
    on_revolved: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_tools: list[Callable[[Any, bool], None]] = field(default_factory=list)
    on_prescribed: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_held: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_made: list[Callable[[Any], None]] = field(default_factory=list)
    on_volume: list[Callable[[Any, Any], None]] = field(default_factory=list)
    on_matrix: list[Callable[[Any], None]] = field(default_factory=list)
    on_setup: list[Callable[[Any], None]] = field(default_factory=list)
    on_first_pairs: list[Callable[[Any], None]] = field(default_factory=list)
    on_accept: list[Callable[[Any], bool]] = field(default_factory=list)
    convergence: Callable[[Any], Any] | None = None
    keeper: Callable[[Any, Any, Any, Any], Any] | None = None
    linear_solver: Callable[[Any, Any, str, bool], dict[str, Any]] | None = None
    options: Callable[[str, Any, Any], Any] | None = None
    on_solver: list[Callable[[Any, Any, Any, Any], None]] = field(default_factory=list)
    on_setting: list[Callable[[Any, str], None]] = field(default_factory=list)
    on_solve: list[Callable[[Any, Any], None]] = field(default_factory=list)
    reason: Callable[[int], str] = "SNES reason {}".format
    shared: Callable[..., tuple[bool, bool]] = lambda *_: (False, False)
    exact: Callable[[Any], Any] | None = None
    behind: Callable[[Any], Callable[[Any, float], Any]] = all_thick
    excess: Callable[[Any], str | None] = lambda surfaces: None
    as_target: Callable[[Any], Any] | None = None
    all_facets: Callable[[Any, Any, Any], Any] | None = None
    never_meet: Callable[[Any, Any, Any], Any] | None = None
    curve: Callable[[Any, Any, Any, Any], Any] | None = None
    adjust: Callable[[Any, float], Any] | None = None
    free_bodies: Callable[[Any], Any] | None = None
    bending: Callable[[Any, Any, Any], Any] | None = None
    constrain: Callable[[Any, Any, Any], Any] | None = None
    several: Callable[[Any], Any] | None = None
    own_assembly: Callable[[Any], Any] | None = None
    names: Callable[[Any, Any], list[str]] = number_groups
    moved: Callable[[Any, str], Any] = object.__getattribute__
    results: Callable[[Any], Any] | None = None
    reactions: Callable[[Any, Any], dict[str, Any]] | None = None


hooks = Hooks()
