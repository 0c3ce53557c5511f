"""Meshes that lie in each other at the start, before anything has moved."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array
from ..errors import ContactWarning
from ..host.facet_areas import surface_sizes
from ..host.facets import format_point
from ..host.joined import parts_of
from .adjustment import gap_without_offset
from .contact_surfaces import ContactSurfaces
from .pairs import Pair
from .point_results import OPEN
from .straight_facets import sagittas
from .zones import ZoneData

# Share of a facet's size up to which meshes that should touch may overlap by their noise
NOISE = 0.01
# Depths that differ by less than this share are the same, but for rounding
ALIKE = 1e-9


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
        if zone.facets.bodies:
            continue
        points = zone.points()
        gap = np.maximum(points["gap"], gap_without_offset(zone, points))
        depth = np.where(points["status"] >= OPEN, -gap, 0.0)
        excess = depth - _allowed(zone, surfaces)[points["slave"]]
        master = zone.masters_of(points)
        for pair in (pair for pair in pairs if pair.surface == k):
            mine = master == zone.facets.master_tags.index(pair.master)
            mine &= excess > 0.0
            most = float(comm.allreduce(depth[mine].max(initial=0.0), op=MPI.MAX))
            if most > 0.0:
                # The same one of several on any number of ranks
                at = points["x"][mine & (depth >= (1.0 - ALIKE) * most)].tolist()
                place = max(sum(comm.allgather(at), []))
                warnings.warn(_message(pair, most, place), ContactWarning, stacklevel=4)


def _allowed(zone: ZoneData, surfaces: ContactSurfaces) -> Array:
    """Overlap of each slave facet that chords and noise explain. Length. Collective."""
    facets = zone.facets
    side = facets.slave_surface
    meshes = [part.function_space.mesh for part in parts_of(surfaces.u)]
    chords = 0.0
    for part, surface in (
        (facets.slave_part, side),
        (facets.master_part, facets.master_surface),
    ):
        if compat.geometry_degree(meshes[part]) == 1:
            most = sagittas(surface).max(initial=0.0)
            chords += max(surfaces.comm.allgather(float(most)))
    allowed: Array = NOISE * surface_sizes(side) ** (1.0 / (side.gdim - 1)) + chords
    return allowed


def _message(pair: Pair, depth: float, place: list[float]) -> str:
    slave, master = (
        f"tag {tag}" if name is None else repr(name)
        for tag, name in (
            (pair.slave, pair.slave_name),
            (pair.master, pair.master_name),
        )
    )
    return (
        f"slave {slave} starts {depth:.3g} deep in {master} at {format_point(np.array(place))}, "
        "before anything has moved: mesh the bodies so that they touch, give an "
        "interference that is wanted as the argument offset, or close overlaps up to a "
        "length by contact.adjust(within=...)"
    )
