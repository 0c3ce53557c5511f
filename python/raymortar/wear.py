"""Wear: contact that loses material where it slips under pressure."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from dolfinx.fem import Function

from . import compat
from .checked import is_real_number, positive
from .compat import Array
from .contact import Contact
from .discretization.facets import facet_dof_table
from .discretization.ranks import largest as largest_of
from .discretization.ranks import sums_at
from .discretization.reference_facets import shape_functions
from .discretization.surfaces import surface_normals
from .errors import ContactError, ContactWarning, require_agreement, together
from .interface.zone_data import ZoneData
from .options.methods import has_dual_multiplier


@dataclass(frozen=True)
class Archard:
    """Archard's law of wear: depth per slip is ``k`` times the pressure.

    Attributes
    ----------
    k
        Wear coefficient over hardness, >= 0. Area per force.
    """

    k: float

    def __post_init__(self) -> None:
        if not (is_real_number(self.k) and np.isfinite(self.k) and self.k >= 0.0):
            raise ContactError(f"Archard.k = {self.k!r} must be a number, not negative")

    def __call__(self, p: Array, v: Array) -> Array:
        """Depth per time, (n,), of pressures and slip rates (n,)."""
        return self.k * p * v


class Wear:
    """Depth of material that contact has lost, which widens its gaps. Collective.

    It grows when a step is accepted, by what the step has done, and becomes the
    contact's offset: ``LoadSteps(..., on_accept=wear.accept)``. The depth belongs to the
    slave's material, so of two bodies that wear it is the sum.

    Parameters
    ----------
    contact
        A contact without an offset of its own, with friction or without.
    law
        `Archard`, or a function of pressures p >= 0 and slip rates v >= 0, (n,) each, to
        depths per time >= 0, (n,).
    largest
        A step that wears deeper than this is warned of, once: the next steps should be
        smaller. Length. None: any depth.

    Attributes
    ----------
    depth
        Depth so far, positive: a Function of degree 1 on the slave's mesh, 0 off the
        slave surfaces. Give it to ``Checkpoint(more=[wear.depth])`` to keep it.
    step
        Largest depth of the last accepted step. Length.

    Notes
    -----
    Steps are explicit: pressures are those at the end of the step, gaps those of the
    worn surface from the next step on. The depth is spread to the nodes such that its
    integral over the undeformed surface is that of the law, to rounding.

    Examples
    --------
    >>> wear = raymortar.Wear(contact, raymortar.Archard(1e-6))
    >>> steps = raymortar.LoadSteps(solver, slide, steps=100, on_accept=wear.accept)
    >>> history.include({"worn": wear.volume})
    """

    def __init__(
        self,
        contact: Contact,
        law: Archard | Callable[[Array, Array], Array],
        largest: float | None = None,
    ) -> None:
        if not isinstance(contact, Contact):
            raise ContactError(
                f"Wear.contact must be a Contact, not {type(contact).__name__}"
            )
        self._comm = contact.layout.comm
        with together(self._comm):
            if contact.tied is not None:
                raise ContactError("Wear.contact is a Tie, which does not slip")
            if has_dual_multiplier(contact.method):
                raise ContactError(
                    "Wear.contact has multiplier='dual', whose traction at a point is "
                    "not known to Wear: take multiplier='vector'"
                )
            if contact.offset is not None:
                raise ContactError(
                    "Wear.contact has an offset, which wear would replace: set "
                    "wear.depth instead"
                )
            if not callable(law):
                raise ContactError(
                    "Wear.law must be Archard or a function of p and v, not " f"{law!r}"
                )
            if largest is not None:
                positive("Wear.largest", largest)
        require_agreement(self._comm, largest=largest)
        self.contact, self.law, self.largest, self.step = contact, law, largest, 0.0
        mesh = contact.slave_u.function_space.mesh
        self.depth = Function(compat.scalar_space(mesh, 1), name="wear")
        V = self.depth.function_space
        self._tables = [facet_dof_table(V, z.facets.slave) for z in contact.zones]
        shares = [
            (table, _nodal_areas(zone)[..., None])
            for table, zone in zip(self._tables, contact.zones)
        ]
        self._areas = sums_at(V.dofmap.index_map, 1, *shares)[:, 0]

    def __repr__(self) -> str:
        return f"<Wear of {self.contact!r} by {self.law!r}>"

    def accept(self) -> None:
        """Add what the last step has worn, and widen the gaps by it. Collective.

        Call it once for each step, after `Contact.advance` and before the next
        `update`, as ``LoadSteps(on_accept=wear.accept)`` does.

        Raises
        ------
        ContactError
            If the law returns no depths.
        """
        shares = []
        with together(self._comm):
            for zone, table in zip(self.contact.zones, self._tables):
                facet, xi, worn = self._worn(zone)
                N, _ = shape_functions(zone.facets.slave_surface.shape, 1, xi)
                shares.append((table[facet], (N * worn[:, None])[..., None]))
        V = self.depth.function_space
        sums = sums_at(V.dofmap.index_map, 1, *shares)[:, 0]
        change = np.where(self._areas > 0.0, sums, 0.0)
        change /= np.where(self._areas > 0.0, self._areas, 1.0)
        self.step = largest_of(self._comm, change)
        self.depth.x.array[:] += change
        self.contact.set_offset(self.depth)
        if self.largest is not None and self.step > self.largest:
            warnings.warn(
                f"a step has worn {self.step:.3g} deep, more than largest = "
                f"{self.largest:.3g}: take smaller steps",
                ContactWarning,
                stacklevel=2,
            )
            self.largest = None

    def _worn(self, zone: ZoneData) -> tuple[Array, Array, Array]:
        """Facets and places of the points that slip, and depth times area of the
        step."""
        points, dt = zone.points(), self.contact.dt
        slip = points["slip"] if zone.frictional else zone.cpp.slips_without_friction()
        nu = points["contact_normal"]
        p = -np.einsum("qi,qi->q", points["traction"], nu)
        closed = (points["status"] > 0) & (p > 0.0)
        v = np.linalg.norm(slip[closed], axis=1) / dt
        rate = np.asarray(self.law(p[closed], v.copy()))
        if rate.shape != v.shape or not np.isrealobj(rate):
            raise ContactError(
                f"Wear.law returns values of type {rate.dtype} and shape {rate.shape} "
                f"for {len(v)} points: they must be real, of shape ({len(v)},)"
            )
        if not (np.isfinite(rate).all() and rate.min(initial=0.0) >= 0.0):
            raise ContactError(
                "Wear.law returns depths that are negative or not finite"
            )
        worn = rate * dt * points["weight"][closed]
        return points["slave"][closed], points["xi"][closed], worn

    def volume(self) -> float:
        """Volume that the slave surfaces have lost: the integral of the depth over the
        undeformed surface, in 2D per thickness or of a full turn. Collective."""
        V = self.depth.function_space
        owned = V.dofmap.index_map.size_local
        mine = self.depth.x.array[:owned] @ self._areas[:owned]
        return float(self._comm.allreduce(mine))


def _nodal_areas(zone: ZoneData) -> Array:
    """Integrals of the linear shape functions over the undeformed facets, (facets, n)."""
    surface = zone.facets.slave_surface
    points, weights, m = surface_normals(surface)
    N, _ = shape_functions(surface.shape, 1, points)
    found: Array = np.einsum("q,qa,fq->fa", weights, N, np.linalg.norm(m, axis=-1))
    return found
