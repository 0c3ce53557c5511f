"""Slave facets at sharp edges, and smooth masters that they may slide on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx.fem import FunctionSpace

from .. import _cpp
from ..compat import Mask
from ..host.edges import Edges
from ..host.joined import parts_of
from ..host.marks import marked_everywhere
from ..host.tagged import ZoneFacets

# Rows of facets beside a sharp edge that count with it: those that touch where a corner is
# pressed in. Beyond them multipliers fade, by a factor of four in each row
ROWS = 3


def boundary_edges(u: object, zones: Sequence[ZoneFacets]) -> list[Edges]:
    """Edges of each mesh; none where slaves meet rigid bodies alone. Collective."""
    if all(zone.bodies for zone in zones):
        return []
    return [Edges(part.function_space.mesh) for part in parts_of(u)]


def mark_frames(
    zone: ZoneFacets,
    slave: _cpp.Surface,
    master: _cpp.Surface,
    edges: Sequence[Edges],
    V: FunctionSpace,
) -> None:
    """Tell both sides of a zone where the law takes the master's normal, (2.14).
    Collective."""
    if zone.bodies or not edges:
        return
    sharp = _near_sharp_edges(zone, edges[zone.slave_part], V)
    slave.set_sharp(sharp.astype(np.int8))
    smooth = edges[zone.master_part].are_smooth(zone.master)
    master.set_smooth(smooth.astype(np.int8))


def _near_sharp_edges(zone: ZoneFacets, edges: Edges, V: FunctionSpace) -> Mask:
    """Slave facets that end in a sharp edge, and some rows beside them, (facets,)."""
    surface, found = zone.slave_surface, edges.are_sharp(zone.slave)
    dofs = surface.dofs[surface.facet_dofs]
    for _ in range(ROWS):
        found = marked_everywhere(V, dofs[found].ravel())[dofs].any(axis=1)
    return found
