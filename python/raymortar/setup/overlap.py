"""Meshes that lie in each other, or in rigid tools, before anything has moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from ..core import compat
from ..core.compat import Array, Indices, Mask
from ..core.discretization.facets import (
    N_CORNERS,
    facet_nodes,
    middle_normals,
    shape_functions,
    units,
)
from ..core.discretization.joined import NUMBERS_OF_PART, parts_of, places_of
from ..core.discretization.ranks import index_among, largest, of_all
from ..core.discretization.surfaces import bodies_of_facets, corner_ids, facet_lengths
from ..core.errors import format_point, warn
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.pairs import Pair, spoken
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData, global_masters
from ..core.target import Target
from .straight_facets import largest_sagitta
from .thickness import Cells

# Share of a facet's size, and of the thickness behind it, up to which meshes that should
# touch may overlap by their noise
NOISE = 0.01
# Depths that differ by less than this share are the same, but for rounding
ALIKE = 1e-9
# Motion of a body that nobody has moved
_UNMOVED = np.concatenate([np.zeros(6), np.eye(3).ravel()])
_TOOL_REMEDY = (
    "before anything has moved: make the tool where it touches, or give the argument "
    "offset"
)
_REMEDY = (
    "before anything has moved: mesh bodies that touch, give offset, or call "
    "contact.adjust(within=...)"
)


def warn_of_overlaps(problem: Any) -> None:
    """Warn of masters that other bodies of a problem overlap, undeformed. Collective."""
    for one in problem.contact.contacts:
        warn_of_overlap(one.surfaces, one.pairs)


def warn_of_overlap(surfaces: ContactSurfaces, pairs: Sequence[Pair]) -> None:
    """Warn of undeformed meshes that overlap, with pair, depth and place. Collective.

    An overlap that an offset undoes or `adjust` has closed is none; chords of curved
    surfaces and the noise of nodes overlap by little. Tools that `move` has moved are
    where the user wants them. The surfaces are paired where nothing has moved yet.
    """
    comm = surfaces.comm
    if surfaces.tied is not None or comm.allreduce(bool(surfaces.u.x.array.any())):
        return
    for k, zone in enumerate(surfaces.zones):
        own = [pair for pair in pairs if pair.surface == k]
        if zone.facets.bodies:
            messages, remedy = list(_in_tools(zone, own)), _TOOL_REMEDY
        else:
            messages, remedy = _in_meshes(zone, own, surfaces), _REMEDY
        for text in messages:
            warn(f"{text}, {remedy}")


def _in_meshes(
    zone: ZoneData, pairs: Sequence[Pair], surfaces: ContactSurfaces
) -> list[str]:
    """Messages on masters with facets in which a slave starts. Collective."""
    comm = surfaces.comm
    # From here on the thickness is unknown
    most = 2.0 * largest(comm, zone.distances["depth"])
    chords = sum(largest_sagitta(s, comm) for s in zone.sides if s.is_straight)
    allowed = []
    for side, thickness in zip(zone.sides, zone.thickness):
        known = np.where(thickness < most, thickness, np.inf)
        allowed.append(NOISE * np.minimum(facet_lengths(side), known) + chords)
    messages = _of_points(zone, pairs, allowed)
    messages = messages or _beyond_search(zone, pairs, allowed, surfaces)
    if zone.facets.meets_itself:
        messages += _inside_itself(zone, pairs, allowed[0], surfaces)
    return messages


def _of_points(
    zone: ZoneData, pairs: Sequence[Pair], allowed: Sequence[Array]
) -> list[str]:
    """Messages on pairs with points deeper than is allowed on both sides. Collective."""
    points, comm = zone.points(), zone.comm
    gap = np.maximum(points["gap"], zone.gap_without_offset(points))
    depth = np.where((points["status"] >= OPEN) & (gap < 0.0), -gap, 0.0)
    if not comm.allreduce(bool(depth.any())):
        return []
    met = of_hit_masters(zone, points, allowed[1])
    depth[depth <= np.minimum(allowed[0][points["slave"]], met)] = 0.0
    master, messages = zone.masters_of(points), []
    for pair in pairs:
        mine = master == zone.facets.master_tags.index(pair.master)
        most = largest(comm, depth[mine])
        if most > 0.0:
            place = _deepest(points["x"][mine], depth[mine], most, comm)
            messages.append(
                f"slave {spoken(pair.slave_name, pair.slave)} starts {most:.3g} deep in "
                f"{spoken(pair.master_name, pair.master)} at {place}"
            )
    return messages


def of_hit_masters(zone: ZoneData, points: dict[str, Array], values: Array) -> Array:
    """Values of the master facets, of all ranks, that points hit; else inf. Collective."""
    ids, each = of_all(zone.comm, zone.facets.master_surface.facet_ids, values)
    met = global_masters(points, zone.cpp.pairs())
    # The last one is for points that hit no master
    return np.append(each, np.inf)[index_among(ids, met)]


def _beyond_search(
    zone: ZoneData,
    pairs: Sequence[Pair],
    allowed: Sequence[Array],
    surfaces: ContactSurfaces,
) -> list[str]:
    """Message on facets inside a body that their rays do not see. Collective."""
    comm, offset = surfaces.comm, zone.whole_offset
    more = largest(comm, 0.0 if offset is None else np.abs(offset))
    rows, of_sides = [], np.zeros((2, surfaces.bodies.count), dtype=bool)
    for k, (side, depth) in enumerate(zip(zone.sides, allowed)):
        nodes, body = side.nodes, bodies_of_facets(surfaces.bodies, side)
        of_sides[k, body] = True
        flat = nodes[:, : N_CORNERS[side.shape]].mean(axis=1)
        centre = facet_nodes(side.shape, 1).mean(axis=0, keepdims=True)
        N, _ = shape_functions(side.shape, side.node_degree, centre)
        # Straight cells lie off facets of degree 2
        more += largest(comm, np.linalg.norm(N[0] @ nodes - flat, axis=1))
        n = units(middle_normals(side.shape, side.node_degree, nodes))
        rows.append((np.full(len(body), 1 - k), body, flat, depth, n))
    comm.Allreduce(MPI.IN_PLACE, of_sides, op=MPI.LOR)
    # Number of the other side, own body, and a point below the middle of the facet
    below = [
        np.column_stack([other, body, flat - (depth + more)[:, None] * n])
        for other, body, flat, depth, n in rows
    ]
    everywhere = np.unique(of_all(comm, np.vstack(below))[0], axis=0)
    found = _inside(surfaces, everywhere, of_sides)
    place = max(sum(comm.allgather(found), []), default=None)
    if place is None:
        return []
    slave = spoken(pairs[0].slave_name, pairs[0].slave)
    masters = ", ".join(spoken(pair.master_name, pair.master) for pair in pairs)
    return [
        f"slave {slave} starts inside {masters}, or behind it, deeper than rays "
        f"follow, at {format_point(place[1:], everywhere[:, 2:])}"
    ]


def _inside_itself(
    zone: ZoneData, pairs: Sequence[Pair], allowed: Array, surfaces: ContactSurfaces
) -> list[str]:
    """Message on facets inside a wall of their own body that no hit tells. Collective.

    Their middle, and a point below it, are in cells that share no vertex with them.
    """
    side, points = zone.sides[0], zone.points()
    is_told = np.zeros(len(side.facet_dofs), dtype=bool)
    deep = -points["gap"] > allowed[points["slave"]]
    is_told[points["slave"][deep & (points["status"] >= OPEN)]] = True
    nodes = side.nodes[:, : N_CORNERS[side.shape]]
    middle, n = nodes.mean(axis=1), units(middle_normals(side.shape, 1, nodes))
    body = bodies_of_facets(surfaces.bodies, side)
    half = np.minimum(0.5 * zone.thickness[0], zone.distances["depth"])
    places = np.hstack([middle, middle - allowed[:, None] * n])
    half, places, body, ids = of_all(
        surfaces.comm, *(v[~is_told] for v in (half, places, body, corner_ids(side)))
    )
    d, inside = side.gdim, np.zeros((2, len(half)), dtype=bool)
    for k, x in enumerate((places[:, :d], places[:, d:])):
        inside[k] = _in_own_cells(zone, surfaces, x, body, ids)
    surfaces.comm.Allreduce(MPI.IN_PLACE, inside, op=MPI.LOR)
    found = np.flatnonzero(inside.all(axis=0))
    if not len(found):
        return []
    worst = max(found, key=lambda k: (half[k], *places[k]))
    return [
        f"{spoken(pairs[0].slave_name, pairs[0].slave)} starts inside itself, deeper "
        f"than {half[worst]:.3g} (half of its wall, or the search depth), at "
        f"{format_point(places[worst, :d], places)}"
    ]


def _in_own_cells(
    zone: ZoneData, surfaces: ContactSurfaces, x: Array, body: Indices, ids: Array
) -> Mask:
    """Whether points are in cells of this rank, of a body, that have no vertex of some
    numbers, (n,)."""
    k = zone.facets.slave_part
    V = parts_of(surfaces.u)[k].function_space
    number = compat.local_to_global(V.dofmap.index_map) + k * NUMBERS_OF_PART
    at, cell, of_cell = _cells_at(surfaces, k, x, np.arange(surfaces.bodies.count))
    at_cell = number[compat.dofmap_array(V)[cell]][:, None]
    is_near = (ids[at, :, None] == at_cell).any(axis=(1, 2))
    inside = np.zeros(len(x), dtype=bool)
    inside[at[(of_cell == body[at]) & ~is_near]] = True
    return inside


def _cells_at(
    surfaces: ContactSurfaces, k: int, x: Array, chosen: Indices
) -> tuple[Indices, Indices, Indices]:
    """Points by number, cells of chosen bodies on the k-th mesh that they are in, and
    the bodies of these."""
    V, places = parts_of(surfaces.u)[k].function_space, places_of(surfaces.u, k)
    cells, dofs = Cells(V.mesh), compat.dofmap_array(V)[:, 0]
    body = surfaces.bodies.dofs[dofs if places is None else places[dofs]]
    nodes = cells.x[cells.corners]
    low, high = x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)
    near = (nodes.max(axis=1) > low) & (nodes.min(axis=1) < high)
    cell = np.flatnonzero(near.all(axis=1) & np.isin(body, chosen)).astype(np.int32)
    if not len(cell):
        return cell, cell, cell
    at, cell = compat.points_in_boxes(V.mesh, cell, x)
    inside = cells.contain(cell, x[at])
    at, cell = at[inside], cell[inside]
    return at, cell, body[cell]


def _inside(
    surfaces: ContactSurfaces, rows: Array, of_sides: Mask
) -> list[list[float]]:
    """Points, with the number of their other side, in a cell of this rank there.

    Rows have the number of the other side, of the point's own body, and the point; a
    table says whether each body is on a side, (2, bodies). The cell is of another body.
    """
    x, found = rows[:, 2:], []
    other, own = rows[:, :2].astype(np.int64).T
    for k in range(len(parts_of(surfaces.u))):
        on_sides = np.flatnonzero(of_sides.any(axis=0))
        at, _, body = _cells_at(surfaces, k, x, on_sides)
        at = at[(own[at] != body) & of_sides[other[at], body]]
        found += np.column_stack([other, x])[at].tolist()
    return found


# Rigid tools


def _in_tools(zone: ZoneData, pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield messages on rigid tools in which a slave starts. Collective."""
    points, side, comm = zone.points(), zone.sides[0], zone.comm
    x, n = (
        np.ascontiguousarray(np.pad(points[name], ((0, 0), (0, 3 - side.gdim))))
        for name in ("x", "normal")
    )
    chords = largest_sagitta(side, comm) if side.is_straight else 0.0
    allowed = NOISE * np.minimum(facet_lengths(side), zone.thickness[0]) + chords
    # An overlap that a clearance undoes is none, nor is an interference that is wanted
    added = zone.at_points(zone.adjustment, points)
    added = added + np.maximum(zone.at_points(zone.offset, points), 0.0)
    for pair in pairs:
        body = pair.master
        if not isinstance(body, Target) or not np.array_equal(body.motion(), _UNMOVED):
            continue
        depth = -(body.tool.distances_along(x, n) + added)
        depth[depth <= allowed[points["slave"]]] = 0.0
        if not body.shape.has_inside:
            depth[points["status"] < OPEN] = 0.0
        most = largest(comm, depth)
        if most > 0.0:
            place = _deepest(points["x"], depth, most, comm)
            slave = spoken(pair.slave_name, pair.slave)
            yield (
                f"slave {slave} starts {most:.3g} deep in the rigid {body.name} at {place}"
            )


def _deepest(x: Array, depth: Array, most: float, comm: MPI.Comm) -> str:
    """Place of the deepest point, chosen alike on any number of ranks. Collective."""
    at = x[depth >= (1.0 - ALIKE) * most].tolist()
    size = largest(comm, np.abs(x))
    return format_point(max(sum(comm.allgather(at), [])), [size])
