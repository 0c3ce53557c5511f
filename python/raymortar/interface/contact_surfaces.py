"""What a contact makes once: zones from tagged facets, the multiplier, the rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..compat import Indices
from ..host.bodies import Bodies, find_bodies
from ..host.facets import facet_dof_table
from ..host.host import Host
from ..host.joined import parts_of
from ..host.layout import Layout
from ..host.surfaces import Surface
from ..host.tagged import ZoneFacets, find_facets
from ..host.thickness import Cells
from ..options.contact_options import ContactOptions
from ..rigid.body import Body
from .coefficients import Interfaces
from .reference import Reference, references
from .zone_data import Masters, ZoneData
from .zones import create_zone


@dataclass(frozen=True, eq=False)
class ContactSurfaces:
    """Surfaces of a contact, and the functions on them.

    Attributes
    ----------
    host
        What the user solves for.
    tied
        ``"keep"`` or ``"close"`` for a tie; None: contact.
    zones
        A slave surface each, with all its masters.
    references
        Undeformed positions, to see whether the mesh is moved.
    slave_u
        Displacement on the mesh that all slave surfaces are on.
    multiplier
        Traction on the slave; None with a penalty.
    scalar, vector
        Spaces of results, of the multiplier's degree.
    layout
        Rows of the unknowns.
    bodies
        Parts of the mesh that are connected.
    """

    host: Host
    tied: str | None
    zones: list[ZoneData]
    references: Sequence[Reference]
    slave_u: Function
    multiplier: Function | None
    scalar: FunctionSpace
    vector: FunctionSpace
    layout: Layout
    bodies: Bodies

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.layout.comm

    @property
    def u(self) -> Function:
        """Displacement."""
        return self.host.u

    @property
    def axisymmetric(self) -> bool:
        """Whether integrals go over a full turn."""
        return self.zones[0].facets.slave_surface.axisymmetric

    @cached_property
    def interfaces(self) -> Interfaces:
        """Pairs of bodies that meet. Collective at first."""
        return Interfaces(self.zones, self.layout, self.bodies)

    @property
    def tags(self) -> str:
        """Slave tags, for messages."""
        tags = [str(zone.facets.slave_tag) for zone in self.zones]
        return f"tag{'s' * (len(tags) > 1)} {', '.join(tags)}"


def make_surfaces(
    host: Host,
    facet_tags: Any,
    groups: Mapping[int, Masters],
    options: ContactOptions,
    tied: str | None,
) -> ContactSurfaces:
    """Find the facets of a contact, and make its multiplier, rows and zones. Collective.

    Parameters
    ----------
    host
        What the user solves for.
    facet_tags
        Tags of exterior facets, for each mesh.
    groups
        Masters of each slave tag, from `zones.group_pairs`.
    options
        Arguments of the contact.
    tied
        ``"keep"`` or ``"close"`` for a tie; None: contact.
    """
    u = host.u
    turns, smooth = bool(options.axisymmetric), options.smooth
    facets = find_facets(u, facet_tags, groups, turns, smooth)
    fixed = references(u, facets)
    # All slaves are on one mesh
    slave_u = parts_of(u)[facets[0].slave_part]
    p = compat.element_info(slave_u.function_space).degree
    mesh = slave_u.function_space.mesh
    degree, components = options.multiplier_kind(
        p, mesh.geometry.dim, is_tie=tied is not None
    )
    multiplier = None
    if components:
        shape = (components,) if components > 1 else ()
        W = compat.space(mesh, "Lagrange", degree, shape)
        multiplier = Function(W, name="multiplier")
    scalar, vector = compat.scalar_space(mesh, degree), compat.vector_space(
        mesh, degree
    )
    free = free_bodies(facets, host.comm)
    layout = Layout(host, multiplier, _slave_dofs(multiplier, facets), free)
    bodies = find_bodies(u.function_space)
    cells = [Cells(part.function_space.mesh) for part in parts_of(u)]
    zones = [
        create_zone(zone, layout, options, scalar, cells, bodies, tied)
        for zone in facets
    ]
    return ContactSurfaces(
        host, tied, zones, fixed, slave_u, multiplier, scalar, vector, layout, bodies
    )


def _slave_dofs(multiplier: Function | None, facets: Sequence[ZoneFacets]) -> Indices:
    """Block dofs of the multiplier on this rank's slave facets."""
    if multiplier is None:
        return np.empty(0, dtype=np.int32)
    W = multiplier.function_space
    tables = [facet_dof_table(W, zone.slave) for zone in facets]
    return np.unique(np.concatenate([table.ravel() for table in tables]))


def free_bodies(facets: Sequence[ZoneFacets], comm: MPI.Comm) -> list[Body]:
    """The free bodies that slaves meet, each once. Gives them a lever. Collective."""
    found = dict.fromkeys(b for zone in facets for b in zone.bodies if b.is_free)
    for body in found:
        if body.freedom.lever is None:
            sides = [z.slave_surface for z in facets if body in z.bodies]
            body.freedom.lever = _extent(sides, comm)
    return list(found)


def _extent(surfaces: Sequence[Surface], comm: MPI.Comm) -> float:
    """Diagonal of the box around surfaces. Length. Collective."""
    dim = surfaces[0].gdim
    ends = np.full((2, dim), -np.inf)
    for surface in surfaces:
        X = surface.X.reshape(-1, dim)
        for end, values in zip(ends, (X, -X)):
            np.maximum(end, values.max(axis=0, initial=-np.inf), out=end)
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    return float(np.linalg.norm(ends.sum(axis=0)))
