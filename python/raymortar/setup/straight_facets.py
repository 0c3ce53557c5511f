"""Straight facets on curved surfaces and inside flat ones, and arcs that do not turn with
their facets."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
from dolfinx.fem import FunctionSpace

from ..core.compat import Array, Mask, basix_element
from ..core.discretization.facets import N_CORNERS, middle_normals, units
from ..core.discretization.ranks import largest, of_all, sums_at
from ..core.discretization.surfaces import Surface
from ..core.errors import warn
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData, on_sides

# Cosine of the angle between facets of a flat surface
FLAT = np.cos(np.deg2rad(1.0))
# Angles between neighbouring facets of a surface that is meant to be smooth
SMOOTH = np.deg2rad(0.5), np.deg2rad(40.0)
# Largest error of straight facets, as a share of the overlap or clearance. It is about
# the relative error of a press fit's pressure
ALLOWED = 0.1
# Surfaces follow each other if their largest and smallest clearances differ by less
# than this factor
ALIKE = 3.0
# Gaps below this share of the error of straight facets are none
ROUNDING = 1e-6
CURVED = "Take smooth=True, a mesh of degree 2, or for noisy nodes contact.adjust(within=...)"
# Arcs that have not turned by this are low by 3 % of their height
MOST_TURNED = np.deg2rad(15.0)


def largest_sagitta(surface: Surface, comm: MPI.Comm) -> float:
    """Find the largest distance of straight facets from the smooth surface that they
    stand for, at the edges that two facets share. Length. Collective.

    For a chord h on a radius R it is h^2 / (8 R); neighbours meet at an angle h / R.
    """
    m = middle_normals(surface.shape, surface.node_degree, surface.nodes)
    size = np.linalg.norm(m, axis=1, keepdims=True) ** (1.0 / (surface.gdim - 1))
    # Corners of each edge; of an interval its two ends
    edges = np.array(basix_element(surface.shape, 1).facet_vertices)
    keys = np.sort(surface.node_ids[surface.facet_nodes[:, edges]], axis=2)
    data = np.hstack([units(m), size]).repeat(len(edges), axis=0)
    # Facets beside each other may be on two ranks
    keys, data = of_all(comm, keys.reshape(-1, edges.shape[1]), data)
    order = np.lexsort(keys.T)
    same = np.flatnonzero((keys[order[1:]] == keys[order[:-1]]).all(axis=1))
    one, two = data[order[same]], data[order[same + 1]]
    angle = _angles(one[:, :-1], two[:, :-1])
    smooth = (angle > SMOOTH[0]) & (angle < SMOOTH[1])
    found = (angle * 0.5 * (one[:, -1] + two[:, -1]) / 8.0)[smooth]
    return float(found.max(initial=0.0))


def _angles(m: Array, n: Array) -> Array:
    """Angles between unit vectors, (n,)."""
    return np.arccos(np.clip(np.einsum("nd,nd->n", m, n), -1.0, 1.0))


def _distance(gaps: Array) -> float:
    """Overlap or clearance of two surfaces that follow each other; inf if they do not."""
    if not len(gaps):
        return np.inf
    overlap = -gaps[gaps < 0.0]
    if len(overlap) > 0.5 * len(gaps):
        return float(np.median(overlap))
    low, middle, high = np.quantile(np.abs(gaps), [0.1, 0.5, 0.9])
    return float(middle) if high <= ALIKE * low else np.inf


def look_at_straight_facets(surfaces: ContactSurfaces) -> None:
    """Note where straight facets are off by much of the first gap, and warn where an
    interference that was given is so small. Collective."""
    comm = surfaces.comm
    for zone in surfaces.zones:
        sides = [side for side in zone.sides if side.is_straight and side.arcs is None]
        if not sides:
            continue
        points = zone.points()
        (gaps,) = of_all(comm, points["gap"][points["status"] >= OPEN])
        most = max(largest_sagitta(side, comm) for side in sides)
        # Gaps of surfaces that touch are rounding, which differs between partitions
        gaps[np.abs(gaps) < ROUNDING * most] = 0.0
        offset = np.zeros(1) if zone.offset is None else zone.offset
        clearance, overlap = (
            comm.allreduce(some.min(initial=np.inf), op=MPI.MIN)
            for some in (offset[offset > 0.0], -offset[offset < 0.0])
        )
        if most > ALLOWED * overlap:
            warn(
                f"straight facets of {zone.facets.spoken} lie {most:.3e} off the curved "
                f"surfaces, with an interference of {overlap:.3e}. {CURVED}"
            )
        elif most > ALLOWED * min(_distance(gaps), clearance):
            zone.off_curve = most


def warn_of_turned_arcs(surfaces: ContactSurfaces) -> bool:
    """Warn if facets have turned under arcs that stay; whether it did. Collective."""
    for zone in surfaces.zones:
        sides = zip(zone.sides, on_sides(zone, surfaces.u.x.array))
        turned = np.max([_turned(*side) for side in sides], axis=0)
        angle, off = (largest(surfaces.comm, value) for value in turned)
        if angle > MOST_TURNED:
            warn(
                f"facets of {zone.facets.spoken} or its masters have turned by "
                f"{np.rad2deg(angle):.3g} degrees, but their arcs have not, and are off by "
                f"{off:.3e}. Take a mesh and a displacement of degree 2",
            )
            return True
    return False


def _turned(surface: Surface, u: Array) -> tuple[float, float]:
    """Largest angle by which this rank's facets with arcs have turned, and the distance
    that their arcs are off by then, for displacements of the dofs (dofs, d)."""
    if surface.arcs is None or not len(surface.arcs):
        return 0.0, 0.0
    corners = N_CORNERS[surface.shape]
    before = surface.nodes[:, :corners]
    after = before + u[surface.facet_dofs[:, :corners]]
    m, n = (units(middle_normals(surface.shape, 1, x)) for x in (before, after))
    angle = _angles(m, n)
    # Flat facets have no arcs
    bent = surface.arcs > 1e-9 * np.abs(before).max()
    off = 2.0 * np.sin(0.5 * angle) * surface.arcs
    return float(angle[bent].max(initial=0.0)), float(off.max())


# Flat surroundings


def are_inside_flats(zone: ZoneData, V: FunctionSpace) -> Mask:
    """Mark slave facets from which the undeformed surface goes on flat, to all sides.
    Collective.

    The angles of the facets around a node add up to two right ones twice, and so do
    the facets' normals by these angles. At an edge, or at the rim of the tag, they fall
    short.
    """
    if zone.inside_flats is None:
        zone.inside_flats = _find_flats(zone, V)
    return zone.inside_flats


def _find_flats(zone: ZoneData, V: FunctionSpace) -> Mask:
    """Find these facets. Collective."""
    surface = zone.facets.slave_surface
    corners = N_CORNERS[surface.shape]
    cycle = [0, 1, 3, 2] if corners == 4 else list(range(corners))
    table = zone.result_table[:, cycle]
    n = units(middle_normals(surface.shape, surface.node_degree, surface.nodes))
    angles = np.full(table.shape, np.pi)  # in 2D of each end
    if corners > 2:
        x = surface.nodes[:, cycle]
        ahead = units(np.roll(x, -1, axis=1) - x)
        behind = np.roll(ahead, 1, axis=1)
        angles = np.pi - np.arccos(np.clip(np.sum(ahead * behind, axis=-1), -1.0, 1.0))
    shares = angles[..., None] * n[:, None]
    sums = sums_at(V.dofmap.index_map, surface.gdim, (table, shares))[table]
    return np.einsum("fai,fi->fa", sums, n).min(axis=1) > 2.0 * np.pi * FLAT
