"""Surfaces of a contact, made once: zones, multiplier, rows; whether the mesh moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..discretization.facets import Facets, coordinates, facet_dof_table, node_table
from ..discretization.joined import parts_of
from ..discretization.layout import Layout
from ..discretization.ranks import ends_of, keep_communicator
from ..discretization.surfaces import Bodies, facet_lengths, find_bodies
from ..discretization.tagged import Group, ZoneFacets, find_facets
from ..discretization.unknowns import Unknowns
from ..errors import ContactError, format_point, require_agreement, speak_on, together
from ..hooks import hooks
from ..options.methods import ContactOptions, Penalty
from ..target import Target
from .coefficients import Interfaces
from .pairs import PairTable, known_names, names_by_tag, read_pairs
from .zone_data import ZoneData
from .zones import create_zone

# Share of coordinates and displacements that may stay where a displacement is added to
# the mesh and taken off again, a few times
MAX_DRIFT = 1e-12


class Reference:
    """Nodes of a displacement's mesh on the contact surfaces, and where they were.

    Reference positions, areas, search distances, the halo and the automatic gamma are
    taken from them once. Nodes elsewhere are the volume's forms' alone, which read the
    mesh at each assembly.
    """

    def __init__(self, u: Function, surfaces: Sequence[Facets]) -> None:
        self._u, self._mesh = u, u.function_space.mesh
        tables = [node_table(self._mesh, facets).ravel() for facets in surfaces]
        self._nodes = np.unique(np.concatenate(tables))
        self._X = coordinates(self._mesh)[self._nodes]

    def fault(self) -> str | None:
        """Message about a mesh that has moved on this rank, if it has."""
        x = coordinates(self._mesh)[self._nodes]
        if np.array_equal(x, self._X):
            return None
        moved = np.abs(x - self._X).max(axis=1)
        size = np.abs(self._X).max() + np.abs(self._u.x.array).max()
        # Written so that NaN has moved
        bad = np.flatnonzero(~(moved <= MAX_DRIFT * size))
        if len(bad) == 0:
            return None
        before, now = (format_point(at[bad[0]], at) for at in (self._X, x))
        return (
            f"{len(bad)} node(s) of the contact surfaces have moved in the mesh since "
            f"Contact was made, for example the one from {before} to {now}: make "
            "contact, problem and solver anew; restore(old.state()) takes tractions over"
        )


def references(u: Any, zones: Sequence[ZoneFacets]) -> list[Reference]:
    """Note the nodes of each mesh that has contact surfaces."""
    found = []
    for k, part in enumerate(parts_of(u)):
        sides = [zone.slave for zone in zones if zone.slave_part == k]
        sides += [m for zone in zones if zone.master_part == k for m in zone.masters]
        if sides:
            found.append(Reference(part, sides))
    return found


@dataclass(frozen=True, eq=False)
class ContactSurfaces:
    """Surfaces of a contact, and the functions on them."""

    unknowns: Unknowns
    pairs: PairTable
    tied: str | None  # "keep" or "close" for a tie; None: contact
    zones: list[ZoneData]  # a slave surface each, with all its masters
    references: Sequence[Reference]  # to see whether the mesh is moved
    slave_u: Function  # displacement on the mesh that all slave surfaces are on
    multiplier: Function | None  # traction on the slave; None with a penalty
    scalar: FunctionSpace  # of results, of the multiplier's degree
    vector: FunctionSpace
    layout: Layout  # rows of the unknowns
    bodies: Bodies  # parts of the mesh that are connected
    options: ContactOptions  # with what the method of those given leaves open
    why: str | None  # the law is what it is; None: it was given

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.layout.comm

    @property
    def u(self) -> Function:
        """Displacement."""
        return self.unknowns.u

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
        facets = (zone.facets for zone in self.zones)
        return ", ".join(one.words(one.slave_tag) for one in facets)


@dataclass(frozen=True, eq=False)
class Given:
    """Arguments of a contact, checked."""

    unknowns: Unknowns
    facet_tags: Any
    pairs: PairTable
    groups: Sequence[Group]  # slaves with their masters
    options: ContactOptions
    tied: str | None


def make_surfaces(given: Given) -> ContactSurfaces:
    """Find the facets of a contact, and make its multiplier, rows and zones.
    Collective."""
    unknowns, options, tied = given.unknowns, given.options, given.tied
    joined, turns = unknowns.u, bool(options.axisymmetric)
    # Facets at shared vertices have no partner, which a multiplier needs; faces of a
    # crack have one
    may_share = isinstance(options.method, Penalty) and tied is None
    by_tag = names_by_tag(given.pairs.names_at(0))
    tags, groups, smooth = given.facet_tags, given.groups, options.smooth
    shared = may_share, tied is None
    facets = find_facets(joined, tags, groups, turns, smooth, *shared, by_tag)
    # All slaves are on one mesh
    slave_u = parts_of(joined)[facets[0].slave_part]
    mesh, p = slave_u.function_space.mesh, facets[0].slave_surface.displacement_degree
    is_narrow = options.leaves_law_open and _is_narrow(facets, mesh.comm)
    options, why = options.with_law(p, tied is not None, is_narrow)
    degree, components = options.multiplier_kind(p, mesh.geometry.dim, tied is not None)
    multiplier, slave_dofs = None, np.empty(0, dtype=np.int32)
    if components:
        shape = (components,) if components > 1 else ()
        W = compat.space(mesh, "Lagrange", degree, shape)
        multiplier = Function(W, name="multiplier")
        tables = [facet_dof_table(W, zone.slave).ravel() for zone in facets]
        slave_dofs = np.unique(np.concatenate(tables))
    scalar = compat.scalar_space(mesh, degree)
    free = free_bodies(facets, unknowns.comm)
    layout = Layout(unknowns, multiplier, slave_dofs, free)
    bodies = find_bodies(joined.function_space)
    behind = [hooks.behind(part.function_space.mesh) for part in parts_of(joined)]
    zones = [
        create_zone(zone, layout, options, scalar, behind, bodies, tied)
        for zone in facets
    ]
    return ContactSurfaces(
        unknowns=unknowns,
        pairs=given.pairs,
        tied=tied,
        zones=zones,
        references=references(joined, facets),
        slave_u=slave_u,
        multiplier=multiplier,
        scalar=scalar,
        vector=compat.vector_space(mesh, degree),
        layout=layout,
        bodies=bodies,
        options=options,
        why=why,
    )


def _is_narrow(facets: Sequence[ZoneFacets], comm: MPI.Comm) -> bool:
    """Whether a master is smaller than the slave's facets: of a rigid tool its radius, of
    facets half the box around them. Collective."""
    for zone in facets:
        lengths = facet_lengths(zone.slave_surface)
        total, count = comm.allreduce(np.array([lengths.sum(), len(lengths)]))
        sizes = [getattr(body.shape, "radius", np.inf) for body in zone.bodies]
        if not sizes:
            box = np.ptp(ends_of(zone.master_surface.X, comm), axis=0)
            sizes = [0.5 * float(np.linalg.norm(box))]
        if min(sizes) < total / count:
            return True
    return False


def checked(
    u: Function | Sequence[Function],
    facet_tags: Any,
    pairs: Any,
    names: Mapping[str, Any] | None,
    options: ContactOptions,
    tied: str | None,
) -> Given:
    """Check all arguments of a contact but its facets. Collective.

    They are those of `Contact`.
    """
    first = u[0] if isinstance(u, (list, tuple)) and u else u
    if not isinstance(first, Function):
        raise ContactError(f"u must be a Function, not {type(first).__name__}")
    mesh = first.function_space.mesh
    with together(mesh.comm):
        unknowns = Unknowns(u)
    keep_communicator(mesh)
    speak_on(mesh.comm)
    with together(mesh.comm):
        options.check()
        known = known_names(names, unknowns.u.function_space.mesh.topology.dim - 1)
        each, groups = read_pairs(pairs, known)
    require_agreement(mesh.comm, **vars(options), pairs=groups, names=each)
    table = PairTable(each, [known] * len(each))
    given = Given(unknowns, facet_tags, table, groups, options, tied)
    for check in hooks.on_arguments:
        check(given)
    return given


def free_bodies(facets: Sequence[ZoneFacets], comm: MPI.Comm) -> list[Target]:
    """Find the free bodies that slaves meet, each once; give them levers. Collective."""
    found = dict.fromkeys(b for zone in facets for b in zone.bodies if b.is_free)
    for body in found:
        if body.freedom.lever is None:
            sides = [zone.slave_surface.X for zone in facets if body in zone.bodies]
            # Diagonal of the box around the slaves
            ends = ends_of(np.concatenate(sides), comm)
            body.freedom.lever = float(np.linalg.norm(np.ptp(ends, axis=0)))
    return list(found)
