"""Slave points that contact has lost: within their master, or passed by rigid bodies."""

from __future__ import annotations

import numpy as np

from .. import _cpp
from ..core.compat import Indices
from ..core.discretization.facets import facet_nodes
from ..core.discretization.ranks import of_all
from ..core.interaction import Interaction
from ..core.interface.zone_data import ZoneData, positions


def passed_points(zone: ZoneData, contact: Interaction) -> Indices:
    """Find this rank's points that are too deep in the master for contact, or that a
    rigid body has passed, by number. Collective."""
    found = zone.cpp.penetrating_points()
    if not zone.facets.bodies or not contact.layout.comm.allreduce(len(found)):
        return found
    # Some may be beside a body that is at the back of theirs
    return zone.cpp.penetrating_points(_slave_as_solid(zone, contact))


def _slave_as_solid(zone: ZoneData, contact: Interaction) -> _cpp.Tool:
    """Make a solid of the slave's facets on all ranks, where they are. Collective."""
    surface = zone.facets.slave_surface
    count, degree = len(surface.facet_ids), surface.node_degree
    nodes = facet_nodes(surface.shape, degree)
    facets = np.repeat(np.arange(count, dtype=np.int32), len(nodes))
    u = contact.u.x.array.reshape(-1, surface.gdim)
    own = positions(surface, facets, np.tile(nodes, (count, 1)), u)
    (x,) = of_all(contact.layout.comm, own)
    numbers = np.arange(len(x), dtype=np.int32)
    shape = getattr(_cpp.Shape, surface.shape)
    return _cpp.facet_tool(shape, degree, x.ravel(), numbers)
