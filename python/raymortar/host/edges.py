"""Angles at the edges of the undeformed boundary: where it is sharp, where smooth."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices, Mask
from .facets import Facets, coordinates, exterior_facets, facet_node_table
from .reference_facets import (
    EDGE_CORNERS,
    FACET_SHAPE,
    facet_nodes,
    normals,
    shape_functions,
)

Keys = npt.NDArray[np.int64]

# An edge is sharp from this angle on, but for rounding
SHARP = np.deg2rad(30.0) - 1e-6
# Below this one the normal goes on across an edge: of flat facets, and of bent ones
COPLANAR, BENT = 1e-5, np.deg2rad(2.0)


class Edges:
    """Angles between each boundary facet of a mesh and its neighbours. Collective.

    Facets on other ranks count: those that lack a neighbour here are exchanged.
    """

    def __init__(self, mesh: Mesh) -> None:
        facets = exterior_facets(mesh)
        self._facets = facets.facets
        self._shape = FACET_SHAPE[compat.cell_name(mesh)]
        self._is_bent = compat.geometry_degree(mesh) > 1
        nodes = facet_node_table(mesh, facets)
        ids = compat.geometry_nodes_global(mesh)[nodes]
        corners = np.array(EDGE_CORNERS[self._shape])
        keys = np.sort(ids[:, corners], axis=-1).reshape(-1, corners.shape[1])
        n = self._normals_at_edges(coordinates(mesh)[nodes], mesh)
        sums, counts = _over_ranks(keys, n.reshape(len(keys), -1), mesh.comm)
        half = np.linalg.norm(sums, axis=1) / counts
        angles = 2.0 * np.arccos(np.minimum(half, 1.0))
        self._angles = angles.reshape(len(nodes), len(corners))

    def _normals_at_edges(self, x: Array, mesh: Mesh) -> Array:
        """Unit normals of facets (facets, nodes, d) in the middle of each edge."""
        ends = facet_nodes(self._shape, 1)[np.array(EDGE_CORNERS[self._shape])]
        degree = compat.geometry_degree(mesh)
        _, gradients = shape_functions(self._shape, degree, ends.mean(axis=1))
        m = normals(np.einsum("ieb,fbd->ifed", gradients, x))
        unit: Array = m / np.linalg.norm(m, axis=-1, keepdims=True)
        return unit

    def _of(self, facets: Facets) -> Array:
        """Angles at the edges of some facets, (facets, edges). Radians."""
        found: Array = self._angles[np.searchsorted(self._facets, facets.facets)]
        return found

    def are_sharp(self, facets: Facets) -> Mask:
        """Whether facets end in a sharp edge, (facets,)."""
        sharp: Mask = (self._of(facets) >= SHARP).any(axis=1)
        return sharp

    def are_smooth(self, facets: Facets) -> Mask:
        """Whether the normal goes on across all edges but sharp ones, (facets,)."""
        angles = self._of(facets)
        goes_on = angles < (BENT if self._is_bent else COPLANAR)
        smooth: Mask = (goes_on | (angles >= SHARP)).all(axis=1)
        return smooth


def _sums(keys: Keys, values: Array) -> tuple[Array, Array, Indices]:
    """Sums and counts of the values with the same key, and the row of each value."""
    _, row = np.unique(keys, axis=0, return_inverse=True)
    row = row.reshape(-1).astype(np.int32)
    counts = np.bincount(row)
    sums = np.zeros((len(counts), values.shape[1]))
    np.add.at(sums, row, values)
    return sums, counts.astype(np.float64), row


def _over_ranks(keys: Keys, values: Array, comm: MPI.Comm) -> tuple[Array, Array]:
    """Sum and count of each key's values, for each value. Values that are alone on
    this rank meet those of others. Collective."""
    sums, counts, row = _sums(keys, values)
    sums, counts = sums[row], counts[row]
    alone = np.flatnonzero(counts == 1.0)
    parts = comm.allgather((keys[alone], values[alone]))
    first = sum(len(part) for part, _ in parts[: comm.rank])
    sent = [np.concatenate(arrays) for arrays in zip(*parts)]
    if len(sent[0]):
        everywhere, number, row = _sums(*sent)
        mine = row[first : first + len(alone)]
        sums[alone], counts[alone] = everywhere[mine], number[mine]
    return sums, counts
