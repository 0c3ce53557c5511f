"""Meshes that lie in each other at the start, before anything has moved."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import compress

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array
from ..errors import ContactWarning
from ..host.facet_areas import surface_sizes
from ..host.facets import format_point
from ..host.joined import parts_of
from .offsets import gap_without_offset
from .contact_surfaces import ContactSurfaces
from .inside import Skin, skin_of
from .pairs import Pair, global_masters, spoken
from .point_results import OPEN
from .straight_facets import largest_sagitta
from .zones import ZoneData

# Share of a facet's size, and of the thickness behind it, up to which meshes that should
# touch may overlap by their noise
NOISE = 0.01
# Depths that differ by less than this share are the same, but for rounding
ALIKE = 1e-9
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
    skin: Skin | None = None
    for k, zone in enumerate(surfaces.zones):
        if zone.facets.bodies:
            continue
        own = [pair for pair in pairs if pair.surface == k]
        noise, chords = _noise(zone, comm), _chords(zone, surfaces)
        messages = _of_points(zone, own, noise, chords, comm)
        if not messages:
            skin = skin_of(surfaces) if skin is None else skin
            messages = _beyond_search(zone, own, skin, noise, chords)
        for message in messages:
            warnings.warn(f"{message}, {REMEDY}", ContactWarning, stacklevel=4)


def _noise(zone: ZoneData, comm: MPI.Comm) -> list[Array]:
    """Overlap of each slave and each master facet that noise explains. Length.
    Collective."""
    facets, depth = zone.facets, zone.distances["depth"].max(initial=0.0)
    # From here on the thickness is unknown
    most = 2.0 * comm.allreduce(depth, op=MPI.MAX)
    sides = facets.slave_surface, facets.master_surface
    found = []
    for side, thickness in zip(sides, zone.thickness):
        size = surface_sizes(side) ** (1.0 / (side.gdim - 1))
        thin = np.where(thickness < most, thickness, np.inf)
        found.append(NOISE * np.minimum(size, thin))
    return found


def _chords(zone: ZoneData, surfaces: ContactSurfaces) -> float:
    """Overlap that chords of curved surfaces explain. Length. Collective."""
    facets = zone.facets
    meshes = [part.function_space.mesh for part in parts_of(surfaces.u)]
    sides = (
        (facets.slave_part, facets.slave_surface),
        (facets.master_part, facets.master_surface),
    )
    straight = [compat.geometry_degree(meshes[part]) == 1 for part, _ in sides]
    return sum(
        largest_sagitta(side, surfaces.comm) for _, side in compress(sides, straight)
    )


def _of_points(
    zone: ZoneData,
    pairs: Sequence[Pair],
    noise: Sequence[Array],
    chords: float,
    comm: MPI.Comm,
) -> list[str]:
    """Messages on pairs with points deeper than chords and noise explain. Collective."""
    points = zone.points()
    gap = np.maximum(points["gap"], gap_without_offset(zone, points))
    deep = (points["status"] >= OPEN) & (gap < 0.0)
    if not comm.allreduce(bool(deep.any())):
        return []
    depth = np.where(deep, -gap, 0.0)
    allowed = noise[0][points["slave"]]
    allowed[deep] = np.minimum(allowed, _of_hit(zone, points, noise[1], comm))[deep]
    master = zone.masters_of(points)
    messages = []
    for pair in pairs:
        mine = master == zone.facets.master_tags.index(pair.master)
        mine &= depth > allowed + chords
        most = float(comm.allreduce(depth[mine].max(initial=0.0), op=MPI.MAX))
        if most > 0.0:
            # The same one of several on any number of ranks
            at = points["x"][mine & (depth >= (1.0 - ALIKE) * most)].tolist()
            place = format_point(np.array(max(sum(comm.allgather(at), []))))
            messages.append(
                f"slave {spoken(pair.slave_name, pair.slave)} starts {most:.3g} deep in "
                f"{spoken(pair.master_name, pair.master)} at {place}"
            )
    return messages


def _of_hit(
    zone: ZoneData, points: dict[str, Array], values: Array, comm: MPI.Comm
) -> Array:
    """Values of the master facets that points hit, which may be other ranks';
    inf where none is hit. Collective."""
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
    skin: Skin,
    noise: Sequence[Array],
    chords: float,
) -> list[str]:
    """Message on facets inside a body that their rays do not see. Collective."""
    offset = zone.whole_offset
    wanted = 0.0 if offset is None else float(np.abs(offset).max(initial=0.0))
    wanted = skin.comm.allreduce(wanted, op=MPI.MAX)
    sides = zone.facets.slave_surface, zone.facets.master_surface
    place = skin.place_inside(sides, [each + chords + wanted for each in noise])
    if place is None:
        return []
    slave = spoken(pairs[0].slave_name, pairs[0].slave)
    masters = ", ".join(spoken(pair.master_name, pair.master) for pair in pairs)
    return [
        f"slave {slave} starts inside {masters}, or behind it, deeper than rays are "
        f"followed, at {format_point(np.array(place))}"
    ]
