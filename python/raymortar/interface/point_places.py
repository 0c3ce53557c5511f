"""Places of integration points on the undeformed slave and in its mesh's cells."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array
from ..host.facets import reference_corners
from ..host.reference_facets import shape_functions
from ..host.surfaces import Surface
from .zone_data import ZoneData


def undeformed(surface: Surface, facet: Any, xi: Array) -> Array:
    """Find undeformed positions of points on facets, (n, d). Length."""
    N, _ = shape_functions(surface.shape, surface.node_degree, xi)
    return np.einsum("qa,qad->qd", N, surface.X[surface.facet_nodes[facet]])


def accumulated_slip(zone: ZoneData, facet: Any, xi: Array) -> Array:
    """Interpolate the slip of all accepted steps at points, (n,). Length."""
    assert zone.slip is not None
    degree = compat.element_info(zone.slip.function_space).degree
    N, _ = shape_functions(zone.facets.slave_surface.shape, degree, xi)
    nodal = zone.slip.x.array[zone.result_table[facet]]
    # Polynomials of degree 2 may fall below zero between their nodes
    return np.maximum(np.einsum("qa,qa->q", N, nodal), 0.0)


def places(zone: ZoneData, points: dict[str, Array], mesh: Mesh) -> dict[str, Array]:
    """Name the facet, the cell and the places of points, as `Contact.points`."""
    facet, xi, facets = points["slave"], points["xi"], zone.facets.slave
    N, _ = shape_functions(zone.facets.slave_surface.shape, 1, xi)
    corners = reference_corners(mesh, facets)[facet]
    found = {
        "X": undeformed(zone.facets.slave_surface, facet, xi),
        "facet": facets.facets[facet],
        "cell": facets.cells[facet],
        "reference": np.einsum("qa,qad->qd", N, corners),
    }
    if zone.slip is not None:
        found["accumulated_slip"] = accumulated_slip(zone, facet, xi)
    return found
