"""Surfaces of a contact, made once: zones, multiplier, rows."""

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
from ..errors import ContactError, require_agreement, together
from ..host.bodies import Bodies, find_bodies
from ..host.checks import check_space
from ..host.facets import facet_dof_table
from ..host.host import Host
from ..host.joined import parts_of
from ..host.ranks import keep_communicator
from ..host.layout import Layout
from ..host.surfaces import Surface
from ..host.tagged import ZoneFacets, find_facets
from ..host.thickness import Cells
from ..options.contact_options import ContactOptions
from ..rigid.body import Body
from .coefficients import Interfaces
from .pairs import PairTable, known_names, numbered, table
from .reference import Reference, references
from .zone_data import Masters, ZoneData
from .zones import create_zone, described, group_pairs


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


@dataclass(frozen=True)
class Given:
    """Arguments of a contact that say where it is.

    Attributes
    ----------
    host
        What is solved for.
    names
        Facet tag by name.
    pairs
        Each pair once.
    groups
        Masters of each slave tag.
    """

    host: Host
    names: dict[str, int]
    pairs: PairTable
    groups: dict[int, Masters]


def check_given(
    u: Function | Sequence[Function],
    pairs: Any,
    names: Mapping[str, Any] | None,
    options: ContactOptions,
) -> Given:
    """Arguments of a contact, after checks of all but its facets. Collective.

    Raises
    ------
    ContactError
        For input that cannot work, or that differs between ranks.
    """
    first = u[0] if isinstance(u, (list, tuple)) and u else u
    if not isinstance(first, Function):
        raise ContactError(f"u must be a Function, not {type(first).__name__}")
    mesh = first.function_space.mesh
    with together(mesh.comm):
        host = Host(u)
    keep_communicator(mesh)
    with together(mesh.comm):
        options.check()
        known = known_names(names, host.u.function_space.mesh.topology.dim - 1)
        tags = numbered(pairs, known)
        groups = group_pairs(tags)
        each = table(tags, known)
    require_agreement(
        mesh.comm,
        **vars(options),
        pairs={slave: described(masters) for slave, masters in groups.items()},
        names=each,
    )
    for part in host.displacements:
        check_space(part.u)
    return Given(host, known, PairTable(each, [known] * len(each)), groups)
