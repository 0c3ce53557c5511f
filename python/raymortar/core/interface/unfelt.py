"""Parts of a multiplier that no free displacement feels [theory (5.21), (5.22)]."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..compat import Array, Mask
from ..discretization.facets import facet_nodes, units
from ..discretization.ranks import sums_at
from .contact_surfaces import ContactSurfaces
from .zone_data import ZoneData, unit_normals

# Length of a unit normal's part along some axes, up to which it is none
ALONG_HELD = 1e-6


class UnfeltParts:
    """Parts of nodal tractions that friction takes from the accepted step.

    Attributes
    ----------
    accepted
        Multiplier of the accepted step, of this rank's dofs; empty without one.
    normals
        Local nodes at which nothing is free along the normal, (nodes,).
    along
        Axes along the surface in which nothing is free there, (nodes, d). Both are None
        where all components are felt at all nodes.
    """

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._surfaces = surfaces
        self.accepted = np.empty(0)
        if surfaces.multiplier is not None:
            self.accepted = np.zeros_like(surfaces.multiplier.x.array)
        self.normals: Mask | None = None
        self.along: Mask | None = None

    def accept(self) -> None:
        """Take the present multiplier as the accepted one."""
        if self._surfaces.multiplier is not None:
            self.accepted[:] = self._surfaces.multiplier.x.array

    def send(self, u_old: Array) -> None:
        """Find the parts at the begin of a step, and hand them to the zones. The step
        begins at the displacement u_old of this rank's dofs. Collective."""
        surfaces, zones = self._surfaces, self._surfaces.zones
        self.normals = self.along = None
        if surfaces.multiplier is None or surfaces.tied or not zones:
            return
        d = zones[0].facets.slave_surface.gdim
        marks = [zone.cpp.unfelt().reshape(-1, d) != 0 for zone in zones]
        mine = any(mark.any() for mark in marks)
        if not surfaces.comm.allreduce(mine, op=MPI.LOR):
            for zone in zones:
                zone.cpp.set_unfelt(np.empty(0), np.empty(0), np.empty(0, np.int8))
            return
        u, shares = u_old.reshape(-1, d), []
        for zone, mark in zip(zones, marks):
            n = normals_at_nodes(zone, u)
            felt = np.broadcast_to(~mark[:, None], n.shape)
            shares.append((zone.multiplier_table, np.concatenate([felt, n], axis=2)))
        index_map = surfaces.multiplier.function_space.dofmap.index_map
        sums = sums_at(index_map, 2 * d, *shares)
        felt = sums[:, :d] > 0.0
        # Damping ties the multiplier of a node to those of its facets  [theory (5.5)]
        ties = []
        for zone in zones:
            rows = zone.multiplier_table[zone.cpp.held_facets()]
            ties.append((rows, felt[rows].any(axis=1)[:, None]))
        tied = felt | (sums_at(index_map, d, *ties) > 0.0)
        for zone in zones:
            if zone.frictional:
                nodes = zone.multiplier_nodes
                parts = unfelt_parts(~tied[nodes], units(sums[nodes, d:]))
                values = self.accepted.reshape(-1, d)[nodes]
                zone.cpp.set_unfelt(parts, values, (~felt[nodes]).astype(np.int8))
        on = np.flatnonzero(sums.any(axis=1))
        held, n = ~felt[on], units(sums[on, d:])
        self.normals = np.zeros(len(sums), dtype=bool)
        self.along = np.zeros((len(sums), d), dtype=bool)
        self.normals[on] = held.any(axis=1) & ~moves_along_normal(held, n)
        self.along[on] = ~tied[on] & (np.abs(n) <= ALONG_HELD)


def normals_at_nodes(zone: ZoneData, u: Array) -> Array:
    """Deformed unit normals of slave facets at the nodes of their multiplier,
    (facets, n, d)."""
    surface = zone.facets.slave_surface
    facets = np.arange(len(surface.facet_dofs), dtype=np.int32)
    found = [
        unit_normals(surface, facets, np.tile(place, (len(facets), 1)), u)
        for place in facet_nodes(surface.shape, zone.multiplier_degree)
    ]
    return np.stack(found, axis=1)


def moves_along_normal(held: Mask, n: Array) -> Mask:
    """Tell where components that are not held have a part along a normal, (nodes, d)
    each."""
    length: Array = np.linalg.norm(n * ~held, axis=1)
    return length > ALONG_HELD


def unfelt_parts(held: Mask, n: Array) -> Array:
    """Matrices P of the unfelt parts of tractions, (nodes, d, d) [theory (5.21)].

    Given the components in which nothing is free at each node, and its unit normal,
    (nodes, d) each. Friction uses P only behind the projection on the tangent plane.
    """
    d = n.shape[1]
    parts = held[:, :, None] * np.eye(d)
    has_normal = moves_along_normal(held, n)
    count = held.sum(axis=1)
    # The gap takes the only free displacement
    parts[has_normal & (count == d - 1)] = np.eye(d)
    # The trace of the held direction in the tangent plane
    one = has_normal & (count == 1) & (d == 3)
    along = held[one] - n[one] * (n[one] * held[one]).sum(axis=1)[:, None]
    squares = (along**2).sum(axis=1)[:, None, None]
    parts[one] = held[one][:, :, None] * along[:, None, :] / squares
    return parts
