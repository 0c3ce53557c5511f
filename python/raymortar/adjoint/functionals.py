"""Functionals that have gradients: forms in UFL, and forces of contact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from ..core import compat
from ..core.contact import Contact
from ..core.errors import ContactError, is_whole_number, of_type
from .forms import by_function, has
from .linear import Linearised


class Functional(ABC):
    """A number that depends on unknowns and parameters.

    Attributes
    ----------
    forms
        Its parts in UFL, with a factor each.
    contacts
        Contacts whose residual it has.
    """

    forms: Sequence[tuple[Any, float]] = ()
    contacts: tuple[Contact, ...] = ()

    @abstractmethod
    def value(self, problem: Any) -> float:
        """Its value at the present state. Collective."""

    @abstractmethod
    def by_unknowns(self, at: Linearised) -> PETSc.Vec:
        """Derivative by all unknowns. Collective."""

    def weights(self, problem: Any) -> PETSc.Vec:
        """Factors of contact's residual of which it is a sum, all rows. Collective."""
        return problem.create_vector()


class FormFunctional(Functional):
    """A functional in UFL, of unknowns and coefficients."""

    def __init__(self, form: ufl.Form) -> None:
        self._form, self.forms = form, [(form, 1.0)]

    def value(self, problem: Any) -> float:
        found = fem.assemble_scalar(compat.form(self._form))
        return float(problem.comm.allreduce(found))

    def by_unknowns(self, at: Linearised) -> PETSc.Vec:
        unknowns, y = at.system.unknowns, at.problem.create_vector()
        for f, start in zip(unknowns.functions, unknowns.owned_starts):
            if has(self._form, f):
                index_map, bs = compat.unknowns_of(f)
                n = bs * index_map.size_local
                y.array[start : start + n] = by_function(self._form, f)[:n]
        for contact in at.problem.contact.contacts:
            f, (part,) = contact.multiplier, contact.parts
            if f is None or not has(self._form, f):
                continue
            own, c = part.layout.owned_multipliers, part.layout.components
            values = by_function(self._form, f).reshape(-1, c)[own]
            rows = part.layout.multiplier_rows[own, None] + np.arange(c)
            # The unknown is a length
            y.setValues(rows.astype(PETSc.IntType), part.gamma_scale * values)
        y.assemble()
        return y


class Force(Functional):
    """A component of the force that contact exerts on the nodes of the slave."""

    def __init__(self, contact: Contact, axis: int) -> None:
        of_type("contact", contact, Contact, "a Contact")
        self.contacts, self.axis = (contact,), axis
        d = contact.u.function_space.mesh.geometry.dim
        if not (is_whole_number(axis) and 0 <= axis < d):
            raise ContactError(f"axis = {axis!r} must be a whole number below {d}")
        for zone in contact.zones:
            sides = zone.facets.slave_surface, zone.facets.master_surface
            shared = np.intersect1d(sides[0].dofs, sides[1].dofs)
            if not zone.facets.bodies and shared.size:
                raise ContactError(
                    f"force: {zone.facets.spoken} shares nodes with its master, where "
                    "rows have the forces on both"
                )

    def weights(self, problem: Any) -> PETSc.Vec:
        """Factors of contact's residual whose sum it is, all rows. Collective."""
        (contact,), e = self.contacts, problem.create_vector()
        for zone in contact.zones:
            dofs = zone.facets.slave_surface.dofs
            rows = problem.contact.layout.u_rows[dofs, self.axis]
            e.setValues(rows.astype(PETSc.IntType), np.full(len(rows), -1.0))
        e.assemble()
        return e

    def value(self, problem: Any) -> float:
        b, system = problem.create_vector(), problem.contact.system
        system.constrained(())
        system.cpp.add_residual(b.handle)
        b.assemble()
        system.constrained(problem.bcs)
        e = self.weights(problem)
        found = e.dot(b)
        e.destroy()
        b.destroy()
        return float(found)

    def by_unknowns(self, at: Linearised) -> PETSc.Vec:
        e = self.weights(at.problem)
        y = at.by_unknowns(e)
        e.destroy()
        return y


class Sum(Functional):
    """A weighted sum of functionals."""

    def __init__(self, parts: Sequence[Functional], factors: Sequence[float]) -> None:
        self._parts = [(one, w) for one, w in zip(parts, factors) if w != 0.0]
        self.forms = [(form, v * w) for one, w in self._parts for form, v in one.forms]
        self.contacts = tuple(c for one, _ in self._parts for c in one.contacts)

    def value(self, problem: Any) -> float:
        return sum(w * one.value(problem) for one, w in self._parts)

    def by_unknowns(self, at: Linearised) -> PETSc.Vec:
        return self._sum(at.problem, lambda one: one.by_unknowns(at))

    def weights(self, problem: Any) -> PETSc.Vec:
        return self._sum(problem, lambda one: one.weights(problem))

    def _sum(
        self, problem: Any, vector: Callable[[Functional], PETSc.Vec]
    ) -> PETSc.Vec:
        """Add up vectors of all parts. Collective."""
        total = problem.create_vector()
        for one, w in self._parts:
            y = vector(one)
            total.axpy(w, y)
            y.destroy()
        return total


def force(contact: Contact, axis: int) -> Force:
    """A component of the force that contact exerts on the nodes of the slave surface.

    Parameters
    ----------
    contact
        Contact.
    axis
        Number of the component.

    Returns
    -------
    Functional for `gradient` and `Tape`; ``value(problem)`` is the force (per thickness
    in 2D, or of a full turn).

    Raises
    ------
    ContactError
        If slave and master share nodes.
    """
    return Force(contact, axis)


def as_functional(J: Any) -> Functional:
    """A functional as it is, a form in UFL as one; raise for anything else."""
    if isinstance(J, Functional):
        return J
    if isinstance(J, ufl.Form) and not J.arguments():
        return FormFunctional(J)
    raise ContactError(
        "J must be a functional in UFL, without test functions, or one of adjoint, such "
        f"as force(contact, axis=0), not {J!r}"
    )
