"""Places where forces at points act on bodies, for moments."""

from __future__ import annotations

import numpy as np

from ..core.compat import Array, Mask
from ..core.discretization.facets import shape_functions
from ..core.interface.zone_data import ZoneData


def arms(zone: ZoneData, points: dict[str, Array]) -> Array:
    """Distances over which friction makes a couple, theory (3), (points, d)."""
    arm = points["distance"][:, None] * points["normal"]
    arm[~_have_arms(zone, points)] = 0.0
    return arm if zone.frictional and not zone.tied else np.zeros_like(arm)


def have_feet(zone: ZoneData, points: dict[str, Array]) -> Mask:
    """Tell at which points the pressure acts at the foot, theory (4.22)."""
    of_master = points["contact_normal"] == -points["master_normal"]
    return np.asarray(of_master.all(axis=1) & _have_arms(zone, points))


def _have_arms(zone: ZoneData, points: dict[str, Array]) -> Mask:
    """Tell where open gaps count: multipliers close them in the mean."""
    over_gaps = zone.couples_over_gaps and zone.dual_multiplier is None
    if over_gaps or not len(zone.multiplier_nodes):
        return np.full(len(points["slave"]), True)
    return np.asarray(zone.at_points(zone.whole_offset, points) != 0.0)


def levers(zone: ZoneData, points: dict[str, Array]) -> tuple[Array, Array]:
    """Find where forces at the points act on the slave's body, and how its nodes take
    tractions that turn its normals [theory (2.18)], (points, d) and (points, d, d).

    Equations are about nodes: a facet of a higher degree than the displacement, or an
    arc in place of a straight one, does not have its points there.
    """
    surface, slave, xi = zone.facets.slave_surface, points["slave"], points["xi"]
    n = points["normal"]
    if surface.arcs is None and surface.node_degree == surface.displacement_degree:
        return points["x"], np.eye(surface.gdim) - n[:, :, None] * n[:, None]
    nodes = zone.cpp.slave_positions()[surface.facet_nodes[slave]]
    _, dN = shape_functions(surface.shape, surface.node_degree, xi)
    M, dM = shape_functions(surface.shape, surface.displacement_degree, xi)
    count = M.shape[1]
    off = (surface.nodes[:, :count] - surface.body_nodes)[slave]
    own = nodes[:, :count] - off
    tangents = np.einsum("ina,nad->ndi", dN, nodes)
    of_body = np.einsum("ina,nad->ndi", dM, own)
    turned = of_body @ np.linalg.pinv(tangents)
    return np.einsum("na,nad->nd", M, own), turned
