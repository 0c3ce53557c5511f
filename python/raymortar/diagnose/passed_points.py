"""Slave points that contact has lost: within their master, or passed by rigid bodies."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from .. import _cpp
from ..core.compat import Indices
from ..core.discretization.ranks import of_all
from ..core.interface.zone_data import ZoneData


def passed_points(zone: ZoneData, comm: MPI.Comm) -> Indices:
    """Find this rank's points that are too deep in the master for contact, or that a
    rigid body has passed, by number. Collective."""
    found = zone.cpp.penetrating_points()
    if not zone.facets.bodies or not comm.allreduce(len(found)):
        return found
    # Some may be beside a body that is at the back of theirs
    return zone.cpp.penetrating_points(_slave_as_solid(zone, comm))


def _slave_as_solid(zone: ZoneData, comm: MPI.Comm) -> _cpp.Tool:
    """Make a solid of the slave's facets on all ranks, where they are. Collective."""
    surface = zone.facets.slave_surface
    (x,) = of_all(comm, zone.cpp.slave_positions()[surface.facet_nodes])
    nodes = np.arange(x.shape[0] * x.shape[1], dtype=np.int32)
    shape = getattr(_cpp.Shape, surface.shape)
    return _cpp.facet_tool(shape, surface.node_degree, x.ravel(), nodes)
