"""What slave facets faced at the accepted step, and how far they have moved from it."""

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

import numpy as np

from ..compat import Array, Indices
from ..host.reference_facets import normals, shape_functions
from ..host.surfaces import Surface
from .zone_data import Faced, ZoneData


@dataclass(frozen=True)
class Path:
    """Where the points of `Faced` are now, relative to what they faced.

    Attributes
    ----------
    x
        Present positions of the slave points, (n, d). Length.
    gap
        Present distance of the master's point along the slave's normal, (n,). Length.
    slide
        Distance across the normal, (n,). Length.
    thickness
        Thickness of the master behind its facet, (n,). Length.
    """

    x: Array
    gap: Array
    slide: Array
    thickness: Array


def nearest_hits(zone: ZoneData) -> Faced:
    """What each slave facet faces at the last update."""
    found = zone.cpp.faced()
    return Faced(**{**found, "closed": found["closed"] > 0})


def positions(surface: Surface, facets: Indices, at: Array, u: Array) -> Array:
    """Deformed position of a point of each facet, (n, d). Length.

    Parameters
    ----------
    facets, at
        Local facets (n,) and reference coordinates (n, d - 1).
    u
        Displacement of this rank's dofs, (dofs, d).
    """
    N, _ = shape_functions(surface.shape, surface.node_degree, at)
    M, _ = shape_functions(surface.shape, surface.displacement_degree, at)
    X, U = _nodal(surface, facets, u)
    return np.einsum("na,nad->nd", N, X) + np.einsum("na,nad->nd", M, U)


def unit_normals(surface: Surface, facets: Indices, at: Array, u: Array) -> Array:
    """Deformed outward normals at the same points, (n, d)."""
    _, dN = shape_functions(surface.shape, surface.node_degree, at)
    _, dM = shape_functions(surface.shape, surface.displacement_degree, at)
    X, U = _nodal(surface, facets, u)
    tangents = np.einsum("ina,nad->ind", dN, X) + np.einsum("ina,nad->ind", dM, U)
    m = normals(tangents)
    return m / np.linalg.norm(m, axis=-1, keepdims=True)


def _nodal(surface: Surface, facets: Indices, u: Array) -> tuple[Array, Array]:
    """Reference positions and displacements of the facets' nodes, (n, nodes, d)."""
    dofs = surface.dofs[surface.facet_dofs[facets]]
    return surface.X[surface.facet_nodes[facets]], u[dofs]


def path(zone: ZoneData, faced: Faced, u: Array, comm: MPI.Comm) -> Path:
    """Present positions of points and of what they faced. Collective.

    Parameters
    ----------
    u
        Displacement of this rank's dofs, (dofs, d).
    """
    surface = zone.facets.slave_surface
    x = positions(surface, faced.facet, faced.xi, u)
    n = unit_normals(surface, faced.facet, faced.xi, u)
    opposite, thickness = _answers(zone, faced, u, comm)
    way = opposite - x
    gap = np.einsum("nd,nd->n", way, n)
    slide = np.linalg.norm(way - gap[:, None] * n, axis=1)
    return Path(x, gap, slide, thickness)


def _answers(
    zone: ZoneData, faced: Faced, u: Array, comm: MPI.Comm
) -> tuple[Array, Array]:
    """Positions of the masters' points and the thickness behind them. The ranks that
    own the facets give them. Collective."""
    surface = zone.facets.master_surface
    asked = comm.allgather((faced.master, faced.eta))
    ids = np.concatenate([part[0] for part in asked])
    eta = np.concatenate([part[1] for part in asked])
    answers = np.zeros((len(ids), surface.gdim + 1))
    known, order = np.sort(surface.facet_ids), np.argsort(surface.facet_ids)
    here = np.flatnonzero(np.isin(ids, known))
    local = order[np.searchsorted(known, ids[here])].astype(np.int32)
    answers[here, :-1] = positions(surface, local, eta[here], u)
    answers[here, -1] = np.minimum(zone.thickness[1][local], np.finfo(float).max)
    comm.Allreduce(MPI.IN_PLACE, answers)
    start = sum(len(part[0]) for part in asked[: comm.rank])
    mine = answers[start : start + len(faced.facet)]
    return mine[:, :-1], mine[:, -1]
