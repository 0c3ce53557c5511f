"""Polygons of meshes and values of functions around them, gathered on rank 0."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function
from dolfinx.mesh import Mesh

from .. import versions
from ..core import compat
from ..core.compat import Array, Indices
from ..core.discretization.facets import (
    FACET_SHAPE,
    cell_facet_nodes,
    facets_of_mesh,
    shape_functions,
)

# Most parts of an edge of degree 2, and edges of a picture that have two parts or more
PARTS, EDGES = 8, 12_000
# Nodes of a polygon of degree 2 in the order around it; every other one is a corner
_AROUND = {
    "interval": [0, 2, 1],
    "triangle": [0, 5, 1, 3, 2, 4],
    "quadrilateral": [0, 4, 1, 6, 3, 7, 2, 5],
}


def gather(comm: MPI.Comm, array: Array) -> Array | None:
    """Join the rows of all ranks on rank 0; None on other ranks. Collective."""
    parts = comm.gather(array, root=0)
    return None if parts is None else np.concatenate(parts)


def _degree(V: Any) -> int:
    """Degree to which pictures show functions of a space, 1 or 2."""
    return 2 if compat.element_info(V).degree == 2 else 1


def joined(parts: Sequence[Array]) -> Array:
    """Join polygons (n, k, 3) of some and of more points: those with fewer repeat their
    last."""
    order = np.arange(max(part.shape[1] for part in parts))
    return np.concatenate(
        [part[:, np.minimum(order, part.shape[1] - 1)] for part in parts]
    )


def parts_of_edges(mesh: Mesh, *functions: Function) -> int:
    """Find into how many parts edges are split, so that those of degree 2 look curved."""
    degrees = [_degree(f.function_space) for f in functions]
    if max(compat.geometry_degree(mesh), *degrees) == 1:
        return 1
    cells = mesh.topology.index_map(mesh.topology.dim).size_global
    return int(np.clip(EDGES // (4 * cells), 2, PARTS))


def _outline(corners: int, degree: int, parts: int) -> Array:
    """Shape functions at the points around a polygon, (points, nodes around it)."""
    if corners == 2:
        return np.eye(2)
    t = np.arange(parts)[:, None] / parts
    begin, end, *middle = shape_functions("interval", degree, t)[0].T
    table = np.zeros((corners, parts, corners * degree))
    for k in range(corners):
        for j, values in enumerate([begin, *middle, end]):
            table[k, :, (degree * k + j) % (corners * degree)] = values
    return table.reshape(corners * parts, -1)


def _gather_around(
    mesh: Mesh,
    shape: str,
    cells: Indices,
    nodes_of: Callable[[int], Indices],
    functions: tuple[Any, ...],
    parts: int,
) -> list[Any]:
    """Points (n, k, 3) around polygons of a shape and values of functions, on rank 0.

    The nodes of cells around each polygon are those of a degree.
    """
    x, degree = mesh.geometry.x, compat.geometry_degree(mesh)
    sources = [(x, compat.geometry_dofmap(mesh), degree)]
    for f in functions:
        V = f.function_space
        values = f.x.array.reshape(-1, V.dofmap.index_map_bs)
        sources.append((values, compat.dofmap_array(V), _degree(V)))
    found, around = [], _AROUND[shape]
    for values, dofs, degree in sources:
        degree = 1 if parts == 1 or shape == "interval" else degree
        order = around[:: 3 - degree]
        at = values[dofs[cells[:, None], nodes_of(degree)[:, order]]]
        table = _outline(len(around[::2]), degree, parts)
        found.append(gather(mesh.comm, np.einsum("pa,nac->npc", table, at)))
    return found


def gather_cells(
    mesh: Mesh, *functions: Function, parts: int | None = None
) -> list[Any]:
    """Cells of a 2D mesh as polygons, with functions around them. Collective.

    The first function, if any, is the displacement: edges have several parts if it or
    the mesh is of degree 2, unless a number is given. On rank 0 points (n, k, 3) in
    order around the cell, and an array (n, k, components) for each continuous Lagrange
    function; None elsewhere.
    """
    parts = parts_of_edges(mesh, *functions[:1]) if parts is None else parts
    cells = np.arange(versions.owned_cells(mesh), dtype=np.int32)
    shape = compat.cell_name(mesh)
    nodes = np.arange(len(_AROUND[shape]))[None]
    return _gather_around(mesh, shape, cells, lambda degree: nodes, functions, parts)


def gather_boundary(
    mesh: Mesh,
    *functions: Function,
    facets: Indices | None = None,
    parts: int | None = 1,
) -> list[Any]:
    """Exterior facets of a mesh, or given ones of this rank, as `gather_cells`.

    Collective. Edges have a number of parts, with None as many as those of cells. In 2D
    polygons are ends.
    """
    parts = parts_of_edges(mesh, *functions[:1]) if parts is None else parts
    chosen = compat.exterior_facets(mesh) if facets is None else facets
    found = facets_of_mesh(mesh, -1, chosen)
    # The owner of a facet's cell sends the facet: each facet comes once
    own = found.some(found.cells < versions.owned_cells(mesh))
    cell = compat.cell_name(mesh)

    def nodes_of(degree: int) -> Indices:
        return cell_facet_nodes(cell, degree)[own.local_facets]

    shape = FACET_SHAPE[cell]
    return _gather_around(mesh, shape, own.cells, nodes_of, functions, parts)


def gather_bodies(
    gather_some: Callable[..., list[Any]],
    displacements: Sequence[Function],
    fields: Sequence[Function],
) -> list[Any]:
    """Polygons of bodies on one mesh or several, with displacements and fields. Collective.

    `gather_some` is one of the functions above; polygons with fewer points repeat their
    last.
    """
    found = [
        gather_some(u.function_space.mesh, u, f) for u, f in zip(displacements, fields)
    ]
    if displacements[0].function_space.mesh.comm.rank > 0:
        return found[0]
    return [joined(one) for one in zip(*found)]
