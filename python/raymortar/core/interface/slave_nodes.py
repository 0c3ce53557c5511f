"""Slave nodes: which are covered by masters, at corners, shared, or prescribed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace

from .. import compat
from ..compat import Mask
from ..discretization.ranks import marked_everywhere
from ..discretization.surfaces import Surface, vector_areas
from .contact_surfaces import ContactSurfaces
from .zone_data import ZoneData

# A node is a corner if the mean of the unit normals around it is shorter. The mean of
# two normals is, if they are more than 60 degrees apart
STRAIGHT = np.cos(np.pi / 6.0)


class Cover:
    """Tells zones which of their multiplier nodes are covered. Collective.

    A surface may be cut into any tags: a node that one zone covers counts as covered in
    all of them. At corners between surfaces, each zone counts by itself. A zone is
    alone if no other zone or rank has nodes of it.
    """

    def __init__(self, zones: Sequence[ZoneData], W: FunctionSpace) -> None:
        self._zones, self._W = zones, W
        self.alone = len(zones) == 1 and W.mesh.comm.size == 1
        self._corners: Mask | None = None
        if len(zones) > 1:
            self._corners = corners_between(zones, W)
            for zone in zones:
                corners = self._corners[zone.multiplier_nodes]
                zone.cpp.set_corner_nodes(corners.astype(np.int8))

    def share(self) -> None:
        """Send the common marks to the zones, after they have been paired."""
        if self.alone:
            return
        own = [
            marked_everywhere(
                self._W, zone.multiplier_nodes[zone.cpp.covered_nodes() != 0]
            )
            for zone in self._zones
        ]
        anywhere = np.logical_or.reduce(own)
        for zone, covered in zip(self._zones, own):
            if self._corners is not None:
                covered = np.where(self._corners, covered, anywhere)
            zone.cpp.set_covered_nodes(covered[zone.multiplier_nodes].astype(np.int8))


def corners_between(zones: Sequence[ZoneData], W: FunctionSpace) -> Mask:
    """Mark block dofs of the multiplier at corners, where zones have different normals.
    Collective."""
    degree, directions = compat.element_info(W).degree, []
    for zone in zones:
        # Vector areas as directions, on the axis of revolution too
        surface = replace(zone.facets.slave_surface, axisymmetric=False)
        areas = vector_areas(surface, W.dofmap.index_map, degree, zone.multiplier_table)
        length = np.linalg.norm(areas, axis=1, keepdims=True)
        directions.append(areas / np.where(length > 0.0, length, 1.0))
    total = np.linalg.norm(np.sum(directions, axis=0), axis=1)
    return total < STRAIGHT * np.any(directions, axis=2).sum(axis=0)


def crossing(
    tie: ContactSurfaces, contacts: Sequence[ContactSurfaces]
) -> list[npt.NDArray[np.int8]]:
    """Mark slave dofs of a tie that other interactions share, zone by zone.

    Shared are dofs on any master surface, and on slave surfaces of other contacts. The
    tie is one of the contacts. Collective.
    """
    dofs = [
        surface.dofs
        for one in contacts
        for zone in one.zones
        for surface in (zone.sides[1:] if one is tie else zone.sides)
    ]
    shared = marked_everywhere(tie.u.function_space, np.concatenate(dofs))
    slaves = (zone.facets.slave_surface for zone in tie.zones)
    return [shared[slave.dofs].astype(np.int8) for slave in slaves]


# Prescribed displacements


def fixed_components(surface: Surface, marker: Mask) -> Mask:
    """Mark prescribed components of a surface's dofs, (dofs, d)."""
    return marker.reshape(-1, surface.gdim)[surface.dofs]


def held_slaves(surfaces: ContactSurfaces, marker: Mask) -> tuple[bool, bool]:
    """Tell whether a slave facet is prescribed throughout, and whether any slave node.

    Collective.
    """
    held = np.zeros(2, dtype=np.int32)
    for zone in surfaces.zones:
        surface = zone.facets.slave_surface
        fixed = fixed_components(surface, marker)
        throughout = fixed.all(axis=1)[surface.facet_dofs].all(axis=1)
        held |= [throughout.any(), fixed.any()]
    surfaces.comm.Allreduce(MPI.IN_PLACE, held, op=MPI.MAX)
    return bool(held[0]), bool(held[1])


def crack_tips(surfaces: ContactSurfaces) -> Mask:
    """Mark the local dofs of u at the tips of cracks, where slave and master share nodes:
    gaps there are zero at any u. Collective."""
    V = surfaces.u.function_space
    found = np.zeros(len(surfaces.u.x.array) // V.mesh.geometry.dim, dtype=bool)
    for zone in surfaces.zones:
        if zone.facets.has_tips:
            slave, master = (marked_everywhere(V, one.dofs) for one in zone.sides)
            found |= slave & master
    return np.repeat(found, V.mesh.geometry.dim)
