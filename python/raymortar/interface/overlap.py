"""Gaps at the start: meshes that lie in each other, and lengths that are added to gaps.

These are clearances, interferences, and adjustments that make surfaces touch which their
meshes hold apart.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from .. import compat
from ..checked import positive
from ..compat import Array, Indices, Mask
from ..discretization.bodies import bodies_of_facets
from ..discretization.facets import format_point
from ..discretization.folded import corner_ids
from ..discretization.joined import NUMBERS_OF_PART, parts_of, places_of
from ..discretization.ranks import index_among, largest, of_all
from ..discretization.reference_facets import (
    N_CORNERS,
    facet_nodes,
    middle_normals,
    shape_functions,
    units,
)
from ..discretization.slave_fields import OFFSET, FieldValue, check_field, on_facets
from ..discretization.surfaces import Surface, facet_lengths
from ..discretization.thickness import Cells, thickness_behind
from ..errors import ContactError, ContactWarning, require_agreement, together
from .contact_surfaces import ContactSurfaces
from .pairs import Pair, spoken
from .point_results import OPEN
from .straight_facets import largest_sagitta
from .tool_overlap import at_points, deepest, warn_of_tools
from .zone_data import ZoneData, global_masters

# Share of a facet's size, and of the thickness behind it, up to which meshes that should
# touch may overlap by their noise
NOISE = 0.01
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
    surfaces and the noise of nodes overlap by little. Tools that `move` has moved are
    where the user wants them. The surfaces are paired where nothing has moved yet.
    """
    comm = surfaces.comm
    if surfaces.tied is not None or comm.allreduce(bool(surfaces.u.x.array.any())):
        return
    for k, zone in enumerate(surfaces.zones):
        own = [pair for pair in pairs if pair.surface == k]
        if zone.facets.bodies:
            warn_of_tools(zone, own, NOISE, comm)
            continue
        # From here on the thickness is unknown
        most = 2.0 * largest(comm, zone.distances["depth"])
        chords = sum(largest_sagitta(s, comm) for s in zone.sides if s.is_straight)
        allowed = []
        for side, thickness in zip(zone.sides, zone.thickness):
            known = np.where(thickness < most, thickness, np.inf)
            allowed.append(NOISE * np.minimum(facet_lengths(side), known) + chords)
        messages = _of_points(zone, own, allowed, comm)
        messages = messages or _beyond_search(zone, own, allowed, surfaces)
        if zone.facets.meets_itself:
            messages += _inside_itself(zone, own, allowed[0], surfaces)
        for text in messages:
            warnings.warn(f"{text}, {REMEDY}", ContactWarning, stacklevel=4)


def _of_points(
    zone: ZoneData, pairs: Sequence[Pair], allowed: Sequence[Array], comm: MPI.Comm
) -> list[str]:
    """Messages on pairs with points deeper than is allowed on both sides. Collective."""
    points = zone.points()
    gap = np.maximum(points["gap"], gap_without_offset(zone, points))
    depth = np.where((points["status"] >= OPEN) & (gap < 0.0), -gap, 0.0)
    if not comm.allreduce(bool(depth.any())):
        return []
    met = of_hit_masters(zone, points, allowed[1], comm)
    depth[depth <= np.minimum(allowed[0][points["slave"]], met)] = 0.0
    master, messages = zone.masters_of(points), []
    for pair in pairs:
        mine = master == zone.facets.master_tags.index(pair.master)
        most = largest(comm, depth[mine])
        if most > 0.0:
            place = deepest(points["x"][mine], depth[mine], most, comm)
            messages.append(
                f"slave {spoken(pair.slave_name, pair.slave)} starts {most:.3g} deep in "
                f"{spoken(pair.master_name, pair.master)} at {place}"
            )
    return messages


def of_hit_masters(
    zone: ZoneData, points: dict[str, Array], values: Array, comm: MPI.Comm
) -> Array:
    """Values of the master facets, of all ranks, that points hit; else inf. Collective."""
    ids, each = of_all(comm, zone.facets.master_surface.facet_ids, values)
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
        f"slave {slave} starts inside {masters}, or behind it, deeper than rays are "
        f"followed, at {format_point(np.array(place[1:]))}"
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
        f"{format_point(places[worst, :d])}"
    ]


def _in_own_cells(
    zone: ZoneData, surfaces: ContactSurfaces, x: Array, body: Indices, ids: Array
) -> Mask:
    """Whether points are in cells of this rank, of a body, that have no vertex of some
    numbers, (n,)."""
    k = zone.facets.slave_part
    V, places = parts_of(surfaces.u)[k].function_space, places_of(surfaces.u, k)
    dofs = compat.dofmap_array(V)
    number = compat.local_to_global(V.dofmap.index_map) + k * NUMBERS_OF_PART
    cells, own = Cells(V.mesh), dofs[:, 0]
    of_cell = surfaces.bodies.dofs[own if places is None else places[own]]
    every = np.arange(len(dofs), dtype=np.int32)
    inside = np.zeros(len(x), dtype=bool)
    if len(x) and len(every):
        at, cell = compat.points_in_boxes(V.mesh, every, x)
        is_near = (ids[at, :, None] == number[dofs[cell]][:, None]).any(axis=(1, 2))
        is_in = cells.contain(cell, x[at]) & (of_cell[cell] == body[at]) & ~is_near
        inside[at[is_in]] = True
    return inside


def _inside(
    surfaces: ContactSurfaces, rows: Array, of_sides: Mask
) -> list[list[float]]:
    """Points, with the number of their other side, in a cell of this rank there.

    Rows have the number of the other side, of the point's own body, and the point; a
    table says whether each body is on a side, (2, bodies). The cell is of another body.
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


def gap_without_offset(zone: ZoneData, points: dict[str, Array]) -> Array:
    """Gap without the user's clearance or interference, which are wanted. Length."""
    return np.asarray(points["gap"] - at_points(zone, zone.offset, points))


# Offsets


@dataclass(frozen=True)
class Adjustment:
    """Changes that `Contact.adjust` has made, on all ranks.

    Attributes
    ----------
    facets
        Slave facets that have been adjusted.
    largest
        Largest change of a gap at their nodes. Length.
    """

    facets: int
    largest: float


class Offsets:
    """Sets offset and adjustments of the zones of a contact. Collective.

    `value` is the offset as it was given, `excess` a message on an interference for
    which no body is thick enough, else None.
    """

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._surfaces, self._zones = surfaces, surfaces.zones
        self.value: FieldValue | None = None
        self.excess: str | None = None

    def set(self, offset: FieldValue) -> None:
        """Set what is added to the gap; see `Contact.set_offset`."""
        comm = self._surfaces.comm
        with together(comm):
            check_field(OFFSET, offset, self._surfaces.slave_u.function_space.mesh)
        require_agreement(comm, offset=offset)
        nodal = [on_facets(OFFSET, offset, zone.facets, comm) for zone in self._zones]
        for zone, values in zip(self._zones, nodal):
            zone.offset = values
        self.value = offset
        found = [self._excess_on(zone) for zone in self._zones]
        before, self.excess = self.excess, "; ".join(filter(None, found)) or None
        if self.excess is not None and before is None:
            warnings.warn(self.excess, ContactWarning, stacklevel=3)
        self._send()

    def require_start(self, within: Any) -> None:
        """Raise unless surfaces can be adjusted by a length. Collective."""
        with together(self._surfaces.comm):
            if np.any(self._surfaces.u.x.array):
                raise ContactError(
                    "adjust is for the undeformed start, and the displacement is not "
                    "zero: call it before the first step"
                )
            positive("within", within)
        require_agreement(self._surfaces.comm, within=within)

    def adjust(self, within: float) -> Adjustment:
        """Make near surfaces just touch, after an update; see `Contact.adjust`."""
        comm = self._surfaces.comm
        changes = [adjustment(zone, float(within)) for zone in self._zones]
        for zone, change in zip(self._zones, changes):
            known = zone.adjustment
            zone.adjustment = change if known is None else known + change
        self._send()
        facets = sum(int(change.any(axis=1).sum()) for change in changes)
        most = max(float(np.abs(change).max(initial=0.0)) for change in changes)
        return Adjustment(comm.allreduce(facets), largest(comm, most))

    def _send(self) -> None:
        """Send offsets and adjustments to the zones."""
        for zone in self._zones:
            if zone.whole_offset is not None:
                zone.cpp.set_offset(zone.whole_offset)

    def _excess_on(self, zone: ZoneData) -> str | None:
        """Message on an interference for which no body is thick enough. Collective."""
        facets, surfaces = zone.facets, self._surfaces
        assert zone.offset is not None
        overlap = largest(surfaces.comm, -zone.offset)
        # A rigid tool has no thickness that counts
        count, parts = 1 if facets.bodies else 2, parts_of(surfaces.u)

        def thinner(sides: Sequence[Array]) -> float:
            return min(largest(surfaces.comm, side) for side in sides[:count])

        there = thinner(zone.thickness)
        if there < overlap:
            sides = (facets.slave_part, facets.slave), (
                facets.master_part,
                facets.master,
            )
            there = thinner(
                [
                    thickness_behind(
                        Cells(parts[k].function_space.mesh), side, 2.0 * overlap
                    )
                    for k, side in sides
                ]
            )
        if overlap <= there * (1.0 + _ROUNDING):
            return None
        return (
            f"the argument offset makes an interference of {overlap:.4g} on slave "
            f"tag {facets.slave_tag}, more than the {there:.4g} of body that "
            "lies behind the thinner side: it is a length in the unit of the mesh, "
            "negative where bodies overlap"
        )


def adjustment(zone: ZoneData, within: float) -> Array:
    """Change of a zone's offset with which near surfaces just touch, (facets, nodes).

    On each facet with points whose gap is at most `within`, a polynomial of the
    displacement's degree is fitted to minus the gap, and raised until no point
    overlaps. So the start is free of stress. Between points a clearance is left: the
    part of the gap that such a polynomial cannot represent.
    """
    surface, points = zone.facets.slave_surface, zone.points()
    slave, gap = points["slave"], gap_without_offset(zone, points)
    N, _ = shape_functions(surface.shape, surface.displacement_degree, points["xi"])
    near = np.flatnonzero((points["status"] > 0) & (np.abs(gap) <= within))
    change = np.zeros((len(surface.facet_dofs), N.shape[1]))
    # Points come in the order of their slave facets
    facets, first = np.unique(slave[near], return_index=True)
    for facet, at in zip(facets, np.split(near, first[1:])):
        # Fit the deviation from the mean: where points do not determine all nodes, the
        # others get the mean
        mean = -gap[at].mean()
        fit, *_ = np.linalg.lstsq(N[at], -gap[at] - mean, rcond=1e-8)
        above = float(np.max(-gap[at] - N[at] @ (mean + fit)))
        change[facet] = mean + fit + max(0.0, above)
    return change
