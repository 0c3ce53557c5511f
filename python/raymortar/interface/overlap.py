"""Meshes that lie in each other at the start, and interferences beyond the bodies."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array, Mask
from ..errors import ContactWarning
from ..host.bodies import bodies_of_facets
from ..host.facets import format_point
from ..host.joined import parts_of, places_of
from ..host.reference_facets import (
    N_CORNERS,
    facet_nodes,
    middle_normals,
    shape_functions,
)
from ..host.surfaces import Surface, surface_sizes
from ..host.thickness import Cells, thickness_behind
from .contact_surfaces import ContactSurfaces
from .pairs import Pair, spoken
from .point_results import OPEN
from .straight_facets import largest_sagitta
from .zone_data import ZoneData, global_masters

# Share of a facet's size, and of the thickness behind it, up to which meshes that should
# touch may overlap by their noise
NOISE = 0.01
# Depths that differ by less than this share are the same, but for rounding
ALIKE = 1e-9
# Share of an interference that counts as rounding error
_ROUNDING = 1e-6
REMEDY = (
    "before anything has moved: mesh the bodies so that they touch, give an "
    "interference that is wanted as the argument offset, or close overlaps up to a "
    "length by contact.adjust(within=...)"
)


def warn_of_overlap(surfaces: ContactSurfaces, pairs: Sequence[Pair]) -> None:
    """Warn of undeformed meshes that overlap, with pair, depth and place. Collective.

    An overlap that an offset undoes or `adjust` has closed is none; chords of curved
    surfaces and the noise of nodes overlap by little. Tools are where the user has put
    them.

    Parameters
    ----------
    surfaces
        Of a contact, paired where nothing has moved yet.
    pairs
        Of the same contact.
    """
    comm = surfaces.comm
    if surfaces.tied is not None or comm.allreduce(bool(surfaces.u.x.array.any())):
        return
    for k, zone in enumerate(surfaces.zones):
        if not zone.facets.bodies:
            own, allowed = [pair for pair in pairs if pair.surface == k], []
            for side, thickness in zip(_sides(zone), zone.thickness):
                allowed.append(_noise(zone, side, thickness, comm))
            chords = sum(
                largest_sagitta(s, comm) for s in _sides(zone) if s.is_straight
            )
            allowed = [noise + chords for noise in allowed]
            messages = _of_points(zone, own, allowed, comm)
            for text in messages or _beyond_search(zone, own, allowed, surfaces):
                warnings.warn(f"{text}, {REMEDY}", ContactWarning, stacklevel=4)


def _sides(zone: ZoneData) -> tuple[Surface, Surface]:
    return zone.facets.slave_surface, zone.facets.master_surface


def _noise(zone: ZoneData, side: Surface, thickness: Array, comm: MPI.Comm) -> Array:
    """Overlap of each facet of a side that noise explains. Length. Collective."""
    depth = zone.distances["depth"].max(initial=0.0)
    # From here on the thickness is unknown
    most = 2.0 * comm.allreduce(depth, op=MPI.MAX)
    size = surface_sizes(side) ** (1.0 / (side.gdim - 1))
    return NOISE * np.minimum(size, np.where(thickness < most, thickness, np.inf))


def _of_points(
    zone: ZoneData, pairs: Sequence[Pair], allowed: Sequence[Array], comm: MPI.Comm
) -> list[str]:
    """Messages on pairs with points deeper than is allowed on both sides. Collective."""
    points = zone.points()
    gap = np.maximum(points["gap"], gap_without_offset(zone, points))
    depth = np.where((points["status"] >= OPEN) & (gap < 0.0), -gap, 0.0)
    if not comm.allreduce(bool(depth.any())):
        return []
    least = np.minimum(
        allowed[0][points["slave"]], of_hit_masters(zone, points, allowed[1], comm)
    )
    master, messages = zone.masters_of(points), []
    for pair in pairs:
        mine = master == zone.facets.master_tags.index(pair.master)
        mine &= depth > least
        most = float(comm.allreduce(depth[mine].max(initial=0.0), op=MPI.MAX))
        if most > 0.0:
            # Choose alike on any number of ranks
            at = points["x"][mine & (depth >= (1.0 - ALIKE) * most)].tolist()
            place = format_point(np.array(max(sum(comm.allgather(at), []))))
            messages.append(
                f"slave {spoken(pair.slave_name, pair.slave)} starts {most:.3g} deep in "
                f"{spoken(pair.master_name, pair.master)} at {place}"
            )
    return messages


def of_hit_masters(
    zone: ZoneData, points: dict[str, Array], values: Array, comm: MPI.Comm
) -> Array:
    """Values of the master facets that points hit, which may be other ranks'; inf where
    none is hit. Collective."""
    known = comm.allgather((zone.facets.master_surface.facet_ids, values))
    ids, each = (np.concatenate(parts) for parts in zip(*known))
    met = global_masters(points, zone.cpp.pairs())
    order = np.argsort(ids)
    found = np.full(len(met), np.inf)
    hit = met >= 0
    found[hit] = each[order[np.searchsorted(ids, met[hit], sorter=order)]]
    return found


def _beyond_search(
    zone: ZoneData,
    pairs: Sequence[Pair],
    allowed: Sequence[Array],
    surfaces: ContactSurfaces,
) -> list[str]:
    """Message on facets inside a body that their rays do not see. Collective."""
    comm, offset, sides = surfaces.comm, zone.whole_offset, _sides(zone)
    more = 0.0 if offset is None else float(np.abs(offset).max(initial=0.0))
    more = comm.allreduce(more, op=MPI.MAX)
    # Straight cells lie off facets of degree 2
    more += sum(comm.allreduce(_bulge(side), op=MPI.MAX) for side in sides)
    of_sides, rows = np.zeros((2, surfaces.bodies.count), dtype=bool), []
    for k, (side, depth) in enumerate(zip(sides, allowed)):
        body = bodies_of_facets(surfaces.bodies, side)
        of_sides[k, body] = True
        points = _below(side, depth + more)
        rows.append(np.column_stack([np.full(len(body), 1 - k), body, points]))
    comm.Allreduce(MPI.IN_PLACE, of_sides, op=MPI.LOR)
    everywhere = np.unique(np.concatenate(comm.allgather(np.vstack(rows))), axis=0)
    found = _inside(surfaces, everywhere, of_sides)
    place = max(sum(comm.allgather(found), []), default=None)
    if place is None:
        return []
    slave = spoken(pairs[0].slave_name, pairs[0].slave)
    masters = ", ".join(spoken(pair.master_name, pair.master) for pair in pairs)
    return [
        f"slave {slave} starts inside {masters}, or behind it, deeper than rays are "
        f"followed, at {format_point(np.array(place[1:]))}"
    ]


def _inside(
    surfaces: ContactSurfaces, rows: Array, of_sides: Mask
) -> list[list[float]]:
    """Points, with the number of their other side, that are in a cell of this rank of
    another body there.

    Parameters
    ----------
    rows
        Number of the other side, of the point's own body, and the point, (n, 2 + d).
    of_sides
        Whether each body is on a side, (2, bodies).
    """
    x, found = rows[:, 2:], []
    other, own = rows[:, :2].astype(np.int64).T
    for k, part in enumerate(parts_of(surfaces.u)):
        V, places = part.function_space, places_of(surfaces.u, k)
        cells, dofs = Cells(V.mesh), compat.dofmap_array(V)[:, 0]
        body = surfaces.bodies.dofs[dofs if places is None else places[dofs]]
        nodes = cells.x[cells.corners]
        low, high = x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)
        near = (nodes.max(axis=1) > low) & (nodes.min(axis=1) < high)
        cell = np.flatnonzero(near.all(axis=1) & of_sides.any(axis=0)[body])
        if len(cell):
            at, cell = compat.points_in_boxes(V.mesh, cell.astype(np.int32), x)
            inside = cells.contain(cell, x[at]) & (own[at] != body[cell])
            at = at[inside & of_sides[other[at], body[cell]]]
            found += np.column_stack([other, x])[at].tolist()
    return found


def _bulge(side: Surface) -> float:
    """Largest distance of a facet's middle from that of its corners. Length."""
    nodes, centre = side.X[side.facet_nodes], facet_nodes(side.shape, 1).mean(axis=0)
    N, _ = shape_functions(side.shape, side.node_degree, centre[None])
    flat = nodes[:, : N_CORNERS[side.shape]].mean(axis=1)
    return float(np.linalg.norm(N[0] @ nodes - flat, axis=1).max(initial=0.0))


def _below(side: Surface, depth: Array) -> Array:
    """Points below the middles of facets' corners, (facets, d)."""
    nodes = side.X[side.facet_nodes]
    m = middle_normals(side.shape, side.node_degree, nodes)
    unit = m / np.linalg.norm(m, axis=1, keepdims=True)
    flat: Array = nodes[:, : N_CORNERS[side.shape]].mean(axis=1)
    return flat - depth[:, None] * unit


def excess_of_interference(surfaces: ContactSurfaces) -> str | None:
    """Message on present offsets for which no body is thick enough. Collective."""
    found = []
    for zone in surfaces.zones:
        mine = 0.0 if zone.offset is None else float((-zone.offset).max(initial=0.0))
        overlap = float(surfaces.comm.allreduce(mine, op=MPI.MAX))
        there = _thickness(zone, surfaces, overlap)
        if overlap > there * (1.0 + _ROUNDING):
            found.append(
                f"the argument offset makes an interference of {overlap:.4g} on slave "
                f"tag {zone.facets.slave_tag}, more than the {there:.4g} of body that "
                "lies behind the thinner side: it is a length in the unit of the mesh, "
                "negative where bodies overlap"
            )
    return "; ".join(found) or None


def _thickness(zone: ZoneData, surfaces: ContactSurfaces, length: float) -> float:
    """Thickness of the body behind the thinner side of a zone if it is below a length,
    else a larger number. Collective."""
    facets, comm = zone.facets, surfaces.comm
    # A rigid tool has no thickness that counts
    count = 1 if facets.bodies else 2

    def thinner(sides: Sequence[Array]) -> float:
        most = [comm.allreduce(s.max(initial=0.0), op=MPI.MAX) for s in sides[:count]]
        return float(min(most))

    known = thinner(zone.thickness)
    if known >= length:
        return known
    parts = parts_of(surfaces.u)
    sides = (facets.slave_part, facets.slave), (facets.master_part, facets.master)
    return thinner(
        [
            thickness_behind(Cells(parts[k].function_space.mesh), side, 2.0 * length)
            for k, side in sides
        ]
    )


def gap_without_offset(zone: ZoneData, points: dict[str, Array]) -> Array:
    """Gap without the user's clearance or interference, which are wanted. Length."""
    gap = points["gap"]
    if zone.offset is None:
        return gap
    surface = zone.facets.slave_surface
    degree = surface.displacement_degree
    N, _ = shape_functions(surface.shape, degree, points["xi"])
    return np.asarray(gap - np.einsum("qk,qk->q", N, zone.offset[points["slave"]]))
