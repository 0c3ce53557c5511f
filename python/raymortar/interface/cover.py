"""Which multiplier nodes are covered, if several zones or ranks share them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace

from .. import compat
from ..host.marks import marked_everywhere
from ..host.vector_areas import vector_areas
from .zones import ZoneData

# A node is a corner if the mean of the zones' unit normals is shorter. The mean of two
# normals is, if they are more than 60 degrees apart
STRAIGHT = np.cos(np.pi / 6.0)


class Cover:
    """Tells zones which of their multiplier nodes are covered. Collective.

    A surface may be cut into any tags: a node that one zone covers counts as covered in
    all of them. At corners between surfaces, each zone counts by itself.

    Parameters
    ----------
    zones
        Of a contact with a multiplier.
    W
        Space of the multiplier.

    Attributes
    ----------
    alone
        Whether no other zone or rank has nodes of the zone.
    """

    def __init__(self, zones: Sequence[ZoneData], W: FunctionSpace) -> None:
        self._zones, self._W = zones, W
        self.alone = len(zones) == 1 and W.mesh.comm.size == 1
        if len(zones) == 1:
            return
        self._corners = self._find_corners()
        for zone in zones:
            corners = self._corners[zone.multiplier_nodes]
            zone.cpp.set_corner_nodes(corners.astype(np.int8))

    def _find_corners(self) -> npt.NDArray[np.bool_]:
        """Whether each block dof is at a corner, where zones have different normals."""
        total: Any = 0.0
        count: Any = 0
        for zone in self._zones:
            surface = zone.facets.slave_surface
            vector = vector_areas(
                replace(surface, axisymmetric=False),  # vector areas as directions, on
                # the axis too
                self._W.dofmap.index_map,
                compat.element_info(self._W).degree,
                zone.multiplier_table,
            )
            compat.scatter_forward(vector)
            areas = vector.array.reshape(-1, surface.gdim)
            length = np.linalg.norm(areas, axis=1)
            has = length > 0.0
            total = total + areas / np.where(has, length, 1.0)[:, None]
            count = count + has
        return np.linalg.norm(total, axis=1) < STRAIGHT * count

    def share(self) -> None:
        """Send the common marks to the zones, after they have been paired.
        Collective."""
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
            if len(own) > 1:
                covered = np.where(self._corners, covered, anywhere)
            zone.cpp.set_covered_nodes(covered[zone.multiplier_nodes].astype(np.int8))
