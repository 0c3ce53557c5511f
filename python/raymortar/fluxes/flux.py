"""Fluxes through contact: heat, charge or moisture between its two sides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..core import compat
from ..core.compat import Array
from ..core.contact import Contact
from ..core.discretization.joined import Displacement, parts_of
from ..core.errors import (
    ContactError,
    is_real_number,
    of_type,
    require_agreement,
    together,
)
from ..core.terms import Addition
from ..setup.arguments import check_fields
from .flux_law import FluxLaw
from .flux_part import FluxPart
from .flux_terms import FluxTerms
from .tool_part import ToolField


@dataclass(frozen=True)
class FluxRates:
    """Sums over a contact, each per time.

    Attributes
    ----------
    through
        From the slaves to the masters.
    slave_heat, master_heat
        Heat of friction that each side takes.
    """

    through: float
    slave_heat: float
    master_heat: float


class Flux(Addition):
    """A flux of a scalar field between the sides of contact, and the heat of friction.

    Give it to the problem in a list with its contact: ``NonlinearProblem([F_u, F_T],
    [contact, flux], bcs, u=[u, T])``. The field is one of the unknowns, and its equation
    one of the forms. Several fluxes may go through one contact. Collective.

    Parameters
    ----------
    contact
        The contact whose points are used: closed ones, and open ones within reach. Or a
        `Tie`, through which a flux depends on the field alone: p, g and v are 0 there.
    T
        The field: a scalar Lagrange Function of degree 1 or 2, or a part of a mixed
        Function that is one, such as ``w.sub(1)``. If bodies have meshes of their own, a
        list.
    law
        q(T_s, T_m, p, g, v), from arrays (n,) of the points to (n,): flux per area from
        the slave to the master. T_s and T_m are the field on slave and master, p >= 0 the
        pressure that acts, g the gap with the offset, v >= 0 the slip rate: slip of the
        step over ``Contact.dt``. Further arguments are given by their names, as to
        `Friction`: ``x``, undeformed positions (3, n); ``slip``, length of the slip of
        all accepted steps; ``dt``; ``fields``, a list of the values of `fields`.
    derivatives
        From the same to the derivatives by T_s, T_m, p, g and v: five arrays (n,), or
        numbers. None: by complex steps, so `law` must take complex arrays.
    friction_heat
        Share of the heat of friction that the slave takes; the master takes the rest.
        None: friction makes no heat, as for a field that is no temperature.
    fields
        Scalar Functions on the slave's mesh, evaluated at the nodes of the slave facets.
    tool
        The field on rigid tools: a number, or a `ToolField`, which is an unknown.

    Attributes
    ----------
    contact, part
        The contact, and what adds entries to residual and tangent.

    Raises
    ------
    ContactError
        For input that cannot work, on every rank alike.

    Notes
    -----
    Area follows the contact's `measure`. Derivatives are compared with
    differences once, where points are hit for the first time: a wrong one is an error.

    Examples
    --------
    Conductance that grows with the pressure, and radiation over the gap:

    >>> def law(T_s, T_m, p, g, v):
    ...     return 2.0 * p**0.95 * (T_s - T_m) + 1e-8 * (T_s**4 - T_m**4)
    >>> flux = raymortar.fluxes.Flux(contact, T, law)
    """

    term = FluxTerms

    def __init__(
        self,
        contact: Contact,
        T: Function | Sequence[Function],
        law: Callable[..., Array],
        derivatives: Callable[..., Sequence[Array]] | None = None,
        friction_heat: float | None = 0.5,
        fields: Sequence[Function] = (),
        tool: float | ToolField | None = None,
    ) -> None:
        _require_point_tractions(contact)
        comm = contact.layout.comm
        several = list(T) if isinstance(T, (list, tuple)) else [T]
        with together(comm):
            made = FluxLaw(law, derivatives, fields)
            heat = _shares(friction_heat)
            _check_fields(contact, several, made)
            if heat != (0.0, 0.0):
                _require_heat(contact)
            on_tools = _value_on_tools(contact, tool)
        require_agreement(comm, friction_heat=friction_heat, tool=on_tools)
        self.contact, self.tool = contact, tool
        parts = [Displacement(f, 0) for f in several]
        self.part = FluxPart(
            contact.assembly,
            parts,
            made,
            heat,
            on_tools.of(comm) if isinstance(on_tools, ToolField) else on_tools,
        )

    def __repr__(self) -> str:
        return f"<Flux of {self.part.name} through {self.contact!r}>"

    def require_among(self, contacts: Sequence[Contact]) -> None:
        """Raise unless its contact is among those of a problem."""
        if not any(self.contact is one for one in contacts):
            raise ContactError(
                f"the Flux of {self.part.name} goes through a contact that the problem "
                "does not have: give the problem a list with both"
            )

    def _require_problem(self) -> None:
        """Raise if no problem has this flux, whose field then knows nothing of it."""
        if not self.part.is_solved_for:
            raise ContactError(
                f"the Flux of {self.part.name} is in no problem: give NonlinearProblem "
                "a list with its contact and the flux"
            )

    def rates(self) -> FluxRates:
        """Sum up the flux and the heat of friction over the contact. Collective.

        At the last `update` of the contact and the present field; each per time. With
        ``axisymmetric=True`` sums are over a full turn.
        """
        self._require_problem()
        return FluxRates(*self.part.rates())

    def points(self, zone: int = 0) -> dict[str, Array]:
        """Arrays over this rank's points with a hit of a zone. Collective.

        Returns
        -------
        Arrays (n,) by name: ``point``, index into the arrays of ``Contact.points(zone)``;
        ``T_s``, ``T_m``, ``p``, ``g``, ``v``: what the law is given; ``q``: the flux;
        ``slave_heat``, ``master_heat``: heat of friction per area and time; ``weight``:
        area.
        """
        count = len(self.part.sides)
        if zone not in range(count):
            raise ContactError(f"zone = {zone!r} must be a number below {count}")
        self._require_problem()
        return self.part.points(zone)


def _shares(friction_heat: Any) -> tuple[float, float]:
    """Shares of the heat of friction that slave and master take."""
    if friction_heat is None:
        return 0.0, 0.0
    if not (is_real_number(friction_heat) and 0.0 <= friction_heat <= 1.0):
        raise ContactError(
            f"friction_heat = {friction_heat!r} must be a number from 0 to 1, the "
            "slave's share, or None"
        )
    return float(friction_heat), 1.0 - float(friction_heat)


def _value_on_tools(contact: Contact, tool: Any) -> float | ToolField:
    """The field on the rigid tools of a contact, 0 where there are none."""
    has_tools = any(zone.facets.bodies for zone in contact.zones)
    if isinstance(tool, ToolField):
        if not has_tools:
            raise ContactError("Flux.tool is a ToolField, and there are no rigid tools")
        return tool
    if tool is None:
        if has_tools:
            raise ContactError(
                "the contact of Flux has rigid tools: give the field on them, tool= a "
                "number or a ToolField"
            )
        return 0.0
    if not (is_real_number(tool) and np.isfinite(tool)):
        raise ContactError(f"tool = {tool!r} must be a finite number, or a ToolField")
    if not has_tools:
        raise ContactError(
            f"Flux.tool = {tool!r} is the field on rigid tools, and there are no rigid "
            "tools in its contact: leave it out"
        )
    return float(tool)


def _check_fields(contact: Contact, fields: Sequence[Any], law: FluxLaw) -> None:
    """Raise unless there is a scalar Lagrange field on each mesh of a contact."""
    check_fields("Flux.T", fields, (), "a flux is of a scalar")
    for f in fields:
        if not compat.scalar_type_is_real() or f.x.array.dtype != np.float64:
            raise ContactError(f"Flux.T, {f.name}, must be of real numbers")
    meshes = [u.function_space.mesh for u in parts_of(contact.u)]
    for f in fields:
        if not any(compat.on_mesh(f, mesh) for mesh in meshes):
            raise ContactError(
                f"Flux.T, {f.name}, is on another mesh than the displacement "
                f"{contact.unknowns.name}"
            )
    for zone in contact.zones:
        sides = [zone.facets.slave_part]
        sides += [] if zone.facets.bodies else [zone.facets.master_part]
        for part in sides:
            found = sum(compat.on_mesh(f, meshes[part]) for f in fields)
            if found != 1:
                raise ContactError(
                    f"Flux.T has {found} Functions on the mesh of a side of "
                    f"{zone.facets.spoken}: it must have one for each mesh"
                )
    slave_mesh = contact.surfaces.slave_u.function_space.mesh
    for f in law.fields:
        if not compat.on_mesh(f, slave_mesh):
            raise ContactError(
                f"Flux.fields has {f.name}, a Function on another mesh than the slave"
            )


def _require_heat(contact: Contact) -> None:
    """Raise where the derivative of the heat of friction is not known."""
    options = contact.surfaces.options
    if options.has_elastic_slip and options.has_springs:
        raise ContactError(
            "the contact of Flux has elastic_slip, of which the heat of friction is not "
            "known to Flux: pass friction_heat=None"
        )


def _require_point_tractions(contact: Any) -> None:
    """Raise unless the argument is a contact whose tractions at points are known. A dual
    multiplier that was chosen gives way to a vector."""
    of_type("Flux.contact", contact, Contact, "a Contact")
    why = "Flux takes tractions at points"
    if contact.method.is_dual and not contact.assembly.change_law(
        "nodes", "vector", why
    ):
        raise ContactError(
            "Flux.contact has multiplier='dual', whose traction at a point is not known "
            "to Flux: take multiplier='vector'"
        )
