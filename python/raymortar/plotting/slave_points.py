"""Slave facets and integration points of all ranks, for pictures."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..host.gathering import gather, gather_boundary

if TYPE_CHECKING:
    from ..contact import Contact


def gather_slave_facets(contact: Contact, *functions: Function) -> list[Any]:
    """Vertices of all slave facets, the displacement and functions there, on rank 0: see
    `gather_boundary`. Rank by rank, and there zone by zone. Collective."""
    facets = np.concatenate([zone.facets.slave.facets for zone in contact.zones])
    mesh = contact.u.function_space.mesh
    return gather_boundary(mesh, contact.u, *functions, facets=facets)


def gather_points(
    contact: Contact,
    least: int,
    quantities: Callable[[dict[str, Array], int], list[Array]],
) -> list[Any] | None:
    """Quantities at points of all zones and ranks, on rank 0; None elsewhere. Collective.

    Parameters
    ----------
    least
        Lowest `PointStatus` of the points.
    quantities
        Takes the points of a zone, and the place of its first slave facet among those of
        `gather_slave_facets`; gives arrays of n rows.
    """
    comm = contact.u.function_space.mesh.comm
    counts = [len(zone.facets.slave.facets) for zone in contact.zones]
    first, zones = comm.exscan(sum(counts), op=MPI.SUM) or 0, []
    for i, count in enumerate(counts):
        points = contact.points(i)
        chosen = points["status"] >= least
        zones.append([values[chosen] for values in quantities(points, first)])
        first += count
    gathered = [gather(comm, np.concatenate(parts)) for parts in zip(*zones)]
    return None if comm.rank > 0 else gathered
