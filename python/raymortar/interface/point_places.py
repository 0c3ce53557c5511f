"""From nodes of a slave surface to its integration points, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array
from ..host.facets import reference_corners
from ..host.reference_facets import shape_functions
from ..host.surfaces import Surface
from .point_results import OPEN
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


def nodal_average(
    zones: Sequence[ZoneData],
    quantity: Callable[[dict[str, Array]], Any],
    field: Function,
    hits_only: bool = True,
) -> None:
    """Average a point quantity around each slave node; NaN elsewhere. Collective.

    Points weigh by their area times the square of the node's shape function, which
    is positive and largest next to the node. `quantity` gives values (n,) or (n, d)
    from the points of a zone; those without a hit are left out, if asked.
    """
    V = field.function_space
    index_map, bs = V.dofmap.index_map, V.dofmap.index_map_bs
    sums = compat.create_la_vector(index_map, bs)
    weights = compat.create_la_vector(index_map, 1)
    degree = compat.element_info(V).degree
    for zone in zones:
        points = zone.points()
        hit = points["status"] >= (OPEN if hits_only else 0)
        values = quantity(points)[hit].astype(np.float64).reshape(-1, 1, bs)
        shape = zone.facets.slave_surface.shape
        N, _ = shape_functions(shape, degree, points["xi"][hit])
        w = points["weight"][hit, None] * N**2
        dofs = zone.result_table[points["slave"][hit]]
        np.add.at(weights.array, dofs, w)
        np.add.at(sums.array.reshape(-1, bs), dofs, w[:, :, None] * values)
    for vector in (sums, weights):
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
    with np.errstate(invalid="ignore", divide="ignore"):
        average = sums.array.reshape(-1, bs) / weights.array[:, None]
    field.x.array[:] = average.ravel()
