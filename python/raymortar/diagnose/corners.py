"""Corners between slave surfaces of a contact, whose faces share a multiplier."""

from __future__ import annotations

import numpy as np
from dolfinx.fem import FunctionSpace

from ..compat import Array
from ..contact import Contact
from ..discretization.ranks import sums_at
from ..errors import format_point
from ..interface.point_results import CLOSED
from ..interface.slave_nodes import corners_between
from ..interface.zone_data import ZoneData

# Force beside a corner, of the larger one on its other face, that is worth a word
WORTH = 0.05


def corner_between(one: Contact, pressed: int) -> str | None:
    """Tell of a corner between slave surfaces of which one or two press there.
    Collective."""
    zones = one.zones
    if one.multiplier is None or one.tied is not None or len(zones) == 1:
        return None
    W, comm = one.multiplier.function_space, one.layout.comm
    *_, second, first = np.sort([_forces(zone, W) for zone in zones], axis=0)
    enough = first > 0.0 if pressed == 1 else (second > 0.0) & (second > WORTH * first)
    if not comm.allreduce(int(enough.any())):
        return None
    at = np.flatnonzero(enough & corners_between(zones, W))
    meet = [np.isin(at, zone.multiplier_nodes).tolist() for zone in zones]
    X = W.tabulate_dof_coordinates()[at, : W.mesh.geometry.dim].tolist()
    # A rank may know a corner by some of its faces alone
    found = sorted(sum(comm.allgather(list(zip(X, zip(*meet)))), []))
    if not found:
        return None
    place = found[0][0]
    faces = np.any([meets for x, meets in found if x == place], axis=0)
    named = " and ".join(zone.facets.spoken for zone, on in zip(zones, faces) if on)
    return f"{named} share a corner at {format_point(place, [x for x, _ in found])}"


def _forces(zone: ZoneData, W: FunctionSpace) -> Array:
    """Sum the forces on the facets around each block dof of the multiplier. Collective."""
    points = zone.points()
    closed = points["status"] >= CLOSED
    size = np.abs(points["weight"] * points["pressure"])[closed]
    table = zone.multiplier_table
    force = np.bincount(points["slave"][closed], size, len(table))
    return sums_at(W.dofmap.index_map, 1, (table, force[:, None, None]))[:, 0]
