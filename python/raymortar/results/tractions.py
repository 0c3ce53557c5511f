"""Tractions at points, as results show them, and at the nodes of a law; where they act
on the bodies, for moments."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array, Mask
from ..core.discretization.facets import dot, interpolate, shape_functions
from ..core.interface.point_results import nodes, pressures
from ..core.interface.zone_data import ZoneData


def seen_points(zone: ZoneData) -> dict[str, Array]:
    """Return `points` with tractions to show, whose integrals are the same.

    Dual functions jump and change sign. The nodal values times the test functions do
    not [theory (4.35)]. ``dual`` has the tractions by dual functions, which do work.
    """
    points = zone.points()
    if zone.dual_multiplier is None:
        return points
    hit = points["status"] > 0  # of `Status`: its ray meets a master
    values = zone.dual_multiplier.x.array.reshape(-1, zone.facets.slave_surface.gdim)
    t = between_nodes(zone, values[zone.multiplier_nodes], points, hit)
    points["dual"] = points["traction"].copy()
    points["traction"][hit] = t
    points["pressure"][hit] = -dot(t, points["contact_normal"][hit])
    return points


def between_nodes(
    zone: ZoneData, values: Array, points: dict[str, Array], of: Mask
) -> Array:
    """Values at some points of those of a law's nodes, (nodes, n), by the test
    functions of gaps at nodes [theory (4.35)]."""
    places = np.searchsorted(zone.multiplier_nodes, zone.multiplier_table)
    nodal = values[places[points["slave"][of]]]
    shape, degree = zone.facets.slave_surface.shape, zone.multiplier_degree
    if shape == "interval" and degree == 2:  # Bernstein polynomials, by their values
        nodal[:, 2] = 0.25 * (nodal[:, 0] + nodal[:, 1]) + 0.5 * nodal[:, 2]
    return np.asarray(interpolate(shape, degree, nodal, points["xi"][of]))


def along_normal(points: dict[str, Array], vectors: Array) -> Array:
    """Project vectors (n, d) at the points on the normals of the law's frame."""
    n = points["contact_normal"]
    return np.einsum("qi,qi->q", vectors, n)[:, None] * n


def traction_part(points: dict[str, Array], part: str) -> Array:
    """Take the total, normal or tangential tractions at the points, (n, d)."""
    traction = points["traction"]
    if part == "total":
        return traction
    normal = along_normal(points, traction)
    return normal if part == "normal" else traction - normal


def tractions(zone: ZoneData, multiplier: Function) -> dict[str, Any]:
    """Add each node's traction and the normal of its law's frame, (nodes, d), to `nodes`."""
    found = nodes(zone)
    normal, components = found["normal"], multiplier.function_space.dofmap.index_map_bs
    lam = multiplier.x.array.reshape(-1, components)[zone.multiplier_nodes]
    traction = lam if components > 1 else lam * normal
    return found | {"traction": traction, "contact_normal": normal}


def largest_pressure(zone: ZoneData, points: dict[str, Array], of: Any) -> float:
    """Find the largest pressure at some points, of dual multipliers at the nodes of their
    facets."""
    values = points["pressure"][of]
    if zone.dual_multiplier is not None:
        around = np.unique(zone.multiplier_table[points["slave"][of]])
        at_nodes = pressures(tractions(zone, zone.dual_multiplier))
        values = at_nodes[np.searchsorted(zone.multiplier_nodes, around)]
    return float(values.max(initial=0.0))


# Places where they act


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
