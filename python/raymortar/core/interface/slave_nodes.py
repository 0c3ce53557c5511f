"""Slave nodes: which are covered by masters, at corners, shared, or prescribed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..compat import Mask
from ..discretization.facets import N_CORNERS, middle_normals, units
from ..discretization.ranks import marked_everywhere, sums_at
from ..discretization.surfaces import Surface, vector_areas
from ..errors import SetUpError, format_point, raise_everywhere, warn
from .contact_surfaces import ContactSurfaces
from .point_results import CLOSED, OPEN, nodal_average
from .zone_data import ZoneData

# A node is a corner if the mean of the unit normals around it is shorter. The mean of
# two normals is, if they are more than 60 degrees apart
STRAIGHT = np.cos(np.pi / 6.0)
# Cosine of the angle between facets of a flat surface
FLAT = np.cos(np.deg2rad(1.0))
# Share of the area of a tie's node that masters must cover
ENOUGH = 0.5
# Largest number of nodes that a message names
NAMED = 10


class Cover:
    """Tells zones which of their multiplier nodes are covered. Collective.

    A surface may be cut into any tags: a node that one zone covers counts as covered in
    all of them. At corners between surfaces, each zone counts by itself. A zone is
    alone if no other zone or rank has nodes of it.
    """

    def __init__(self, zones: Sequence[ZoneData], W: FunctionSpace) -> None:
        self._zones, self._W = zones, W
        self.alone = len(zones) == 1 and W.mesh.comm.size == 1
        self._corners: Mask | None = None
        if len(zones) > 1:
            self._corners = corners_between(zones, W)
            for zone in zones:
                corners = self._corners[zone.multiplier_nodes]
                zone.cpp.set_corner_nodes(corners.astype(np.int8))

    def share(self) -> None:
        """Send the common marks to the zones, after they have been paired."""
        if self.alone:
            return
        own = [
            marked_everywhere(
                self._W, zone.multiplier_nodes[zone.cpp.covered_nodes() != 0]
            )
            for zone in self._zones
        ]
        anywhere = np.logical_or.reduce(own)
        for zone, covered in zip(self._zones, own):
            if self._corners is not None:
                covered = np.where(self._corners, covered, anywhere)
            zone.cpp.set_covered_nodes(covered[zone.multiplier_nodes].astype(np.int8))


def corners_between(zones: Sequence[ZoneData], W: FunctionSpace) -> Mask:
    """Mark block dofs of the multiplier at corners, where zones have different normals.
    Collective."""
    degree, directions = compat.element_info(W).degree, []
    for zone in zones:
        # Vector areas as directions, on the axis of revolution too
        surface = replace(zone.facets.slave_surface, axisymmetric=False)
        areas = vector_areas(surface, W.dofmap.index_map, degree, zone.multiplier_table)
        length = np.linalg.norm(areas, axis=1, keepdims=True)
        directions.append(areas / np.where(length > 0.0, length, 1.0))
    total = np.linalg.norm(np.sum(directions, axis=0), axis=1)
    return total < STRAIGHT * np.any(directions, axis=2).sum(axis=0)


# Flat surroundings


def are_inside_flats(zone: ZoneData, V: FunctionSpace) -> Mask:
    """Mark slave facets from which the undeformed surface goes on flat, to all sides.
    Collective.

    The angles of the facets around a node add up to two right ones twice, and so do
    the facets' normals by these angles. At an edge, or at the rim of the tag, they fall
    short.
    """
    if zone.inside_flats is None:
        zone.inside_flats = _find_flats(zone, V)
    return zone.inside_flats


def _find_flats(zone: ZoneData, V: FunctionSpace) -> Mask:
    """Find these facets. Collective."""
    surface = zone.facets.slave_surface
    corners = N_CORNERS[surface.shape]
    cycle = [0, 1, 3, 2] if corners == 4 else list(range(corners))
    table = zone.result_table[:, cycle]
    n = units(middle_normals(surface.shape, surface.node_degree, surface.nodes))
    angles = np.full(table.shape, np.pi)  # in 2D of each end
    if corners > 2:
        x = surface.nodes[:, cycle]
        ahead = units(np.roll(x, -1, axis=1) - x)
        behind = np.roll(ahead, 1, axis=1)
        angles = np.pi - np.arccos(np.clip(np.sum(ahead * behind, axis=-1), -1.0, 1.0))
    shares = angles[..., None] * n[:, None]
    sums = sums_at(V.dofmap.index_map, surface.gdim, (table, shares))[table]
    return np.einsum("fai,fi->fa", sums, n).min(axis=1) > 2.0 * np.pi * FLAT


# Ties


def require_masters(tie: ContactSurfaces, partial: bool) -> None:
    """Raise for slave nodes of a paired tie without a master. Collective.

    If it is partial, one at least must have a master.
    """
    comm, V, covered = tie.comm, tie.scalar, Function(tie.scalar)
    nodal_average(tie.zones, lambda p: p["status"] >= OPEN, covered, hits_only=False)
    n, dim = V.dofmap.index_map.size_local, V.mesh.geometry.dim
    on = np.flatnonzero(np.isfinite(covered.x.array[:n]))
    share = covered.x.array[on]
    if partial and comm.allreduce(int((share > 0.0).any())):
        return
    x = V.tabulate_dof_coordinates()[on, :dim]
    bad = [(s, tuple(at)) for s, at in zip(share, x) if s < ENOUGH]
    # The least covered first
    found = sorted(sum(comm.allgather(bad), []))
    total = comm.allreduce(len(share))
    if not found:
        return
    places = [at for _, at in found]
    named = ", ".join(f"{format_point(at, places)}: {s:.2g}" for s, at in found[:NAMED])
    more = ", ..." if len(found) > NAMED else ""
    raise_everywhere(
        comm,
        f"{len(found)} of {total} slave nodes of {tie.tags} have no master for most of "
        f"what they stand for (node: covered share): {named}{more}. Move or enlarge a "
        "master, take a larger Search(reach=), or leave them free with partial=True",
    )


def crossing(
    tie: ContactSurfaces, contacts: Sequence[ContactSurfaces]
) -> list[npt.NDArray[np.int8]]:
    """Mark slave dofs of a tie that other interactions share, zone by zone.

    Shared are dofs on any master surface, and on slave surfaces of other contacts. The
    tie is one of the contacts. Collective.
    """
    dofs = [
        surface.dofs
        for one in contacts
        for zone in one.zones
        for surface in (zone.sides[1:] if one is tie else zone.sides)
    ]
    shared = marked_everywhere(tie.u.function_space, np.concatenate(dofs))
    slaves = (zone.facets.slave_surface for zone in tie.zones)
    return [shared[slave.dofs].astype(np.int8) for slave in slaves]


def warn_of_corners(tie: ContactSurfaces) -> None:
    """Warn of corners of a slave surface: one multiplier cannot be the traction on two
    faces. Collective."""
    assert tie.multiplier is not None
    W, shares = tie.multiplier.function_space, []
    dim, n = W.mesh.geometry.dim, W.dofmap.index_map.size_local
    for zone in tie.zones:
        side = zone.facets.slave_surface
        normals = units(middle_normals(side.shape, side.node_degree, side.nodes))
        # The last column counts facets
        rows = np.pad(normals, ((0, 0), (0, 1)), constant_values=1.0)
        shares.append((zone.multiplier_table, rows[:, None]))
    owned = sums_at(W.dofmap.index_map, dim + 1, *shares)[:n]
    length = np.linalg.norm(owned[:, :dim], axis=1)
    sharp = np.flatnonzero(length < STRAIGHT * owned[:, dim])
    found = W.tabulate_dof_coordinates()[sharp, :dim]
    places = [x for part in tie.comm.allgather(found) for x in part]
    if places:
        warn(
            f"the slave of {tie.tags} turns by more than 60 degrees at "
            f"{len(places)} node(s), as at {format_point(places[0], places)}. Give each "
            "face its own tag and Tie",
        )


# Prescribed displacements


def fixed_components(surface: Surface, marker: Mask) -> Mask:
    """Mark prescribed components of a surface's dofs, (dofs, d)."""
    return marker.reshape(-1, surface.gdim)[surface.dofs]


def held_slaves(surfaces: ContactSurfaces, marker: Mask) -> tuple[bool, bool]:
    """Tell whether a slave facet is prescribed throughout, and whether any slave node.

    Collective.
    """
    held = np.zeros(2, dtype=np.int32)
    for zone in surfaces.zones:
        surface = zone.facets.slave_surface
        fixed = fixed_components(surface, marker)
        throughout = fixed.all(axis=1)[surface.facet_dofs].all(axis=1)
        held |= [throughout.any(), fixed.any()]
    surfaces.comm.Allreduce(MPI.IN_PLACE, held, op=MPI.MAX)
    return bool(held[0]), bool(held[1])


def crack_tips(surfaces: ContactSurfaces) -> Mask:
    """Mark the local dofs of u at the tips of cracks, where slave and master share nodes:
    gaps there are zero at any u. Collective."""
    V = surfaces.u.function_space
    found = np.zeros(len(surfaces.u.x.array) // V.mesh.geometry.dim, dtype=bool)
    for zone in surfaces.zones:
        if zone.facets.has_tips:
            slave, master = (marked_everywhere(V, one.dofs) for one in zone.sides)
            found |= slave & master
    return np.repeat(found, V.mesh.geometry.dim)


def refuse_held_on_tools(surfaces: ContactSurfaces, marker: Mask) -> None:
    """Raise for slaves prescribed throughout on rigid bodies that are not free.

    Nothing could give way. Collective.
    """
    for zone in surfaces.zones:
        bodies = zone.facets.bodies
        if not bodies or any(body.is_free for body in bodies):
            continue
        held = bool(fixed_components(zone.facets.slave_surface, marker).all())
        if surfaces.comm.allreduce(held, op=MPI.LAND):
            names = ", ".join(body.name for body in bodies)
            raise SetUpError(
                f"{zone.facets.spoken} is prescribed throughout, and what it "
                f"meets is rigid ({names}): nothing can give way. Leave some of its "
                "displacement free, or free the rigid body"
            )


def refuse_held(surfaces: ContactSurfaces, unfelt: Mask | None) -> None:
    """Raise where the pressure is in no equation. Collective.

    That is where contact is closed all around a node of the multiplier, between facets
    whose displacement is prescribed on both sides, and no damped facet ties it to
    another node; or where nothing is free along the normal (nodes are marked, None: none
    is).
    """
    assert surfaces.multiplier is not None
    W, shares, ties = surfaces.multiplier.function_space, [], []
    for zone in surfaces.zones:
        points, table = zone.cpp.points(), zone.multiplier_table
        shut = points["status"] >= CLOSED
        # Points on uncovered parts integrate nothing
        free = ((zone.cpp.free_points() == 1) | ~shut) & (points["seed"] >= 0)
        for which, columns in ((free, [1.0, 0.0]), (shut, [0.0, 1.0])):
            shares.append((np.unique(table[points["slave"][which]]), columns))
        share = zone.cpp.segments()["covered"]
        partly = np.flatnonzero((share > 0.0) & (share < 1.0))
        ties.append(table[np.union1d(zone.cpp.held_facets(), partly)])
    known, closed = sums_at(W.dofmap.index_map, 2, *shares).T
    if unfelt is not None:
        known[unfelt] = 0.0
    for rows in ties:  # mark nodes that share a damped facet with a marked one
        known[rows[(known[rows] > 0.0).any(axis=1)]] = 1.0
    every, n = np.arange(len(known)), W.dofmap.index_map.size_local
    known = sums_at(W.dofmap.index_map, 1, (every, known[:, None]))[:, 0]
    held = np.flatnonzero((known[:n] == 0.0) & (closed[:n] > 0.0))
    count, message = surfaces.comm.allreduce(len(held)), None
    if len(held):
        X = W.tabulate_dof_coordinates()[:, : W.mesh.geometry.dim]
        message = (
            f"{count} node(s) of the contact traction, for example the one at "
            f"{format_point(X[held[0]], X)}, are between facets whose displacement is "
            "prescribed on both sides: leave these out of the slave's tag, or use "
            "a penalty"
        )
    raise_everywhere(surfaces.comm, message)
