"""Terms: what adds to a problem's equations beside its forms and its contacts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Any

from petsc4py import PETSc

import numpy as np

from .compat import Array
from .errors import ContactError


class Term:
    """A part of the equations of a problem beside the user's forms and contact.

    Heat that flows through contact, inertia, viscous forces and softened tangents are
    terms. A problem loops over its list of terms and knows none of them by name. A term
    overrides what it has; every other member adds nothing. Each is collective.

    A term decides at the start of a step or of a solve. Residual and tangent then depend
    on the unknowns alone, whatever was assembled before.

    Attributes
    ----------
    spoken
        Its name in messages, a plural.
    functions
        Unknowns that the term brings. Their forms are none.
    is_of_contact
        Whether it acts through contact: `CoupledProblem.loads` leaves it out.
    is_linear
        Whether the tangent of the forms' unknowns stays a constant matrix with it, and
        `keep` gives the keeper of that matrix; solvers may keep its factors.
    unit_forces
        Force of inertia that a unit of each owned unknown of the forms takes, (n,); None:
        the term has no inertia.
    leads_far
        Whether a solve with it may end far from where it begins, so that the end of a
        linear step misleads.
    advice
        What to try where a step fails; None: nothing of its own.
    """

    spoken: str = "further terms"
    functions: Sequence[Any] = ()
    is_of_contact: bool = False
    is_linear: bool = False
    unit_forces: Array | None = None
    leads_far: bool = False
    advice: str | None = None

    def start(self, system: Any) -> None:
        """Take the system of contacts, whose unknowns include `functions`."""

    def couple(self, pattern: Any) -> None:
        """Take the pattern of the volume, and make room in it for the tangent."""

    def set_groups(self, groups: Any) -> None:
        """Take the groups of rows by which residuals are measured."""

    def rows(self) -> list[Any]:
        """Rows of fields on the zones' facets, which need room for all pairs."""
        return []

    def residual(self, bcs: Sequence[Any], lacking: Any) -> Array | float:
        """Residual of the owned unknowns of the forms, (n,), with the effect of what
        the unknowns lack to meet the conditions."""
        return 0.0

    def multiplier_residual(self) -> Array | None:
        """Residual of the owned rows behind those of the forms, (rows - n,), after
        `residual`; None: nothing."""
        return None

    def forces(self, bcs: Sequence[Any]) -> Array | float:
        """Forces of a body at the owned unknowns of the forms, (n,), after a solve."""
        return 0.0

    def add_matrices(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add whole matrices to the tangent, before anything has added an entry."""

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add entries to the tangent, without constrained rows and columns."""

    def keep(self, kept: Any) -> Any:
        """The keeper of the constant tangent with this term, given that without it."""
        return kept

    def sizes(self) -> tuple[Array, Array] | None:
        """Sizes of what the rows of each group add up, and their rounding errors
        [theory (5.13)]; None: groups of the term's rows have none of their own."""
        return None


class Addition:
    """An object of the user that adds to a problem, in a list beside contacts.

    Attributes
    ----------
    part
        Object that adds entries to residual and tangent.
    """

    part: Any

    @staticmethod
    def term(additions: Sequence[Any]) -> Term:
        """Make one term of all such objects of a problem."""
        raise NotImplementedError

    def require_among(self, contacts: Sequence[Any]) -> None:
        """Raise unless the contacts that it needs are among those of a problem."""

    def require_apart(self, other: Any) -> None:
        """Raise if it and another object determine the same values, on this rank."""


class Adhesion:
    """A law by which the surfaces of a contact hold together."""

    def bond(
        self, contact: Any, u: Any, facet_tags: Any, pairs: Any, names: Any
    ) -> Any:
        """Make the term that holds them together, from the contact's arguments.
        Collective."""
        raise NotImplementedError


def apart(given: Any) -> tuple[Any, list[Any]]:
    """Divide what a problem is given into contacts and additions.

    Raises
    ------
    ContactError
        If an addition is there twice, or two determine the same values.
    """
    if isinstance(given, Addition):
        return [], [given]
    if not isinstance(given, (list, tuple)):
        return given, []
    additions = [one for one in given if isinstance(one, Addition)]
    for i, one in enumerate(additions):
        if any(one is other for other in additions[:i]):
            kind = type(one).__name__
            raise ContactError(f"the {kind} of {one.part.name} is in the list twice")
    return [one for one in given if not isinstance(one, Addition)], additions


def require_apart(additions: Sequence[Addition]) -> None:
    """Raise on a rank where two additions determine the same values."""
    for i, one in enumerate(additions):
        for other in additions[:i]:
            other.require_apart(one)


def terms_of(additions: Sequence[Addition]) -> list[Term]:
    """Make the terms of what a user has added to a problem."""
    by_maker: dict[Any, list[Addition]] = {}
    for one in additions:
        by_maker.setdefault(one.term, []).append(one)
    return [make(some) for make, some in by_maker.items()]


def is_linear(terms: Iterable[Term]) -> bool:
    """Whether the tangent of the forms stays constant with all terms."""
    return all(term.is_linear for term in terms)


def kept_with(terms: Iterable[Term], kept: Any) -> Any:
    """The keeper of the constant tangent with all terms; None: nothing is kept."""
    return reduce(lambda so_far, term: term.keep(so_far), terms, kept)


def added_sizes(terms: Iterable[Term]) -> tuple[Array, Array] | None:
    """Add up the sizes of the terms by group, and their rounding errors."""
    found = [one for term in terms if (one := term.sizes()) is not None]
    if not found:
        return None
    terms_of_rows, errors = np.sqrt((np.array(found) ** 2).sum(axis=0))
    return terms_of_rows, errors


def inertia_of(terms: Iterable[Term]) -> Array | None:
    """Add up the inertia of the terms; None: there is none."""
    found = [term.unit_forces for term in terms if term.unit_forces is not None]
    return sum(found[1:], found[0]) if found else None
