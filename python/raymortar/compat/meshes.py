"""Meshes: cells, geometry, connectivity, tags, and where their cells go."""

from __future__ import annotations

from typing import Any

import dolfinx
import numpy as np
import numpy.typing as npt
from dolfinx import cpp as _cpp
from dolfinx import geometry

from ..errors import ContactError
from .generation import HAS_UFL_ELEMENTS, Indices, basix_element, table, unwrap


def cell_name(mesh: dolfinx.mesh.Mesh) -> str:
    """Cell type, such as ``"triangle"``; ``"mixed"`` if there are several."""
    types = getattr(mesh.topology, "entity_types", None)
    if types is not None and len(types[mesh.topology.dim]) > 1:
        return "mixed"
    return mesh.topology.cell_type.name


def on_mesh(thing: Any, mesh: dolfinx.mesh.Mesh) -> bool:
    """Whether MeshTags or a Function are of this very mesh, not of a like one."""
    owner = thing.function_space.mesh if hasattr(thing, "function_space") else thing
    owner = owner if hasattr(owner, "topology") else owner.mesh  # MeshTags before 0.7
    return unwrap(owner.topology) is unwrap(mesh.topology)


def points_in_boxes(
    mesh: dolfinx.mesh.Mesh, cells: Indices, x: npt.NDArray[np.float64]
) -> tuple[Indices, Indices]:
    """Points, by row of x, and local cells of some whose boxes they are in.

    Candidates: DOLFINx does not look at the box of a cell that is alone.
    """
    make = getattr(geometry, "bb_tree", None) or geometry.BoundingBoxTree
    name = "compute_collisions_points"  # since 0.7
    find = getattr(geometry, name, None) or geometry.compute_collisions
    padded = np.pad(x, ((0, 0), (0, 3 - x.shape[1])))
    links = find(make(mesh, mesh.topology.dim, entities=cells), padded)
    return np.repeat(np.arange(len(x)), np.diff(links.offsets)), links.array


def geometry_degree(mesh: dolfinx.mesh.Mesh) -> int:
    """Polynomial degree of the cells' geometry."""
    maps = getattr(mesh.geometry, "cmaps", None)
    return (mesh.geometry.cmap if maps is None else maps[0]).degree


def geometry_dofmap(mesh: dolfinx.mesh.Mesh) -> Indices:
    """Geometry nodes of each local cell (ghosts last), shape (n_cells, n)."""
    dofmaps = getattr(mesh.geometry, "dofmaps", None)
    dofmap = mesh.geometry.dofmap if dofmaps is None else dofmaps[0]
    element = basix_element(cell_name(mesh), geometry_degree(mesh))
    return table(dofmap, len(element.points))


def geometry_nodes_global(mesh: dolfinx.mesh.Mesh) -> npt.NDArray[np.int64]:
    """Global index of each local geometry node, ghosts last, shape (n_nodes,)."""
    return local_to_global(mesh.geometry.index_map())


def local_to_global(
    index_map: Any, local: Indices | None = None
) -> npt.NDArray[np.int64]:
    """Global indices of local ones; of all local ones, ghosts last, by default."""
    if local is None:
        count = index_map.size_local + index_map.num_ghosts
        local = np.arange(count, dtype=np.int32)
    local = np.ascontiguousarray(local, dtype=np.int32)
    return np.asarray(index_map.local_to_global(local), dtype=np.int64)


def connectivity(mesh: dolfinx.mesh.Mesh, dim0: int, dim1: int) -> Any:
    """Adjacency list (``array``, ``offsets``) of entities; made if absent. Collective.

    Computes the entities as well, so that their index maps exist afterwards.
    """
    for dim in (dim0, dim1):
        mesh.topology.create_entities(dim)
    mesh.topology.create_connectivity(dim0, dim1)
    return mesh.topology.connectivity(dim0, dim1)


def connectivity_table(mesh: dolfinx.mesh.Mesh, dim0: int, dim1: int) -> Indices:
    """Connectivity with equally many links each, shape (n, n_links). Collective."""
    links = connectivity(mesh, dim0, dim1)
    sizes = np.diff(links.offsets)
    return links.array.reshape(-1, sizes[0] if len(sizes) else 1)


def exterior_facets(mesh: dolfinx.mesh.Mesh) -> Indices:
    """Sorted local indices of the exterior facets owned by this rank. Collective.

    The owner of an exterior facet always owns its cell too.
    """
    connectivity(mesh, mesh.topology.dim - 1, mesh.topology.dim)
    # The Python topology (>= 0.9) wraps the class that 0.5 exposes directly.
    return np.asarray(dolfinx.mesh.exterior_facet_indices(mesh.topology))


def meshtags(
    mesh: dolfinx.mesh.Mesh, dim: int, entities: npt.ArrayLike, values: npt.ArrayLike
) -> Any:
    """Tags (int32) of local entities of one dimension, given in any order.

    Parameters
    ----------
    mesh, dim
        Mesh, and dimension of the entities.
    entities
        Local indices, each once, shape (n,).
    values
        Tag of each, shape (n,), or one for all.
    """
    entities = np.asarray(entities, dtype=np.int32)
    values = np.broadcast_to(np.asarray(values, dtype=np.int32), entities.shape)
    order = np.argsort(entities)
    return dolfinx.mesh.meshtags(mesh, dim, entities[order], values[order])


def _ranks_across_facets(
    cells: npt.NDArray[np.int64], cell: str, ranks: Indices
) -> list[set[int]]:
    """Other ranks that have a cell across a facet, for each of the cells."""
    columns = np.array(basix_element(cell, 1).facet_vertices)
    facets = np.sort(cells[:, columns], axis=2).reshape(-1, columns.shape[1])
    of_cell = np.repeat(np.arange(len(cells)), len(columns))
    order = np.lexsort(facets.T)
    same = np.all(facets[order][1:] == facets[order][:-1], axis=1)
    pairs = np.column_stack([of_cell[order][:-1][same], of_cell[order][1:][same]])
    others: list[set[int]] = [set() for _ in cells]
    for a, b in pairs[ranks[pairs[:, 0]] != ranks[pairs[:, 1]]]:
        others[a].add(int(ranks[b]))
        others[b].add(int(ranks[a]))
    return others


def as_destinations(ranks: npt.ArrayLike, count: int, size: int) -> Indices:
    """Check the ranks of so many cells: whole numbers from 0 to ``size - 1``."""
    found = np.asarray(ranks)
    if found.shape != (count,) or not np.issubdtype(found.dtype, np.integer):
        raise ContactError(
            f"partition must give the rank of each of the {count} cells, whole numbers "
            f"of shape ({count},), not {found.dtype} of shape {found.shape}"
        )
    wrong = np.flatnonzero((found < 0) | (found >= size))
    if len(wrong):
        raise ContactError(
            f"partition gives cell {wrong[0]} to rank {found[wrong[0]]}, of {size} ranks"
        )
    return found.astype(np.int32)


def given_partition(cells: npt.NDArray[np.int64], cell: str, ranks: Indices) -> Any:
    """Partitioner that sends each of this rank's cells to a given rank.

    Cells have their nodes in Basix order, (n_cells, n). The name of the cell type may be
    anything where there are no cells.
    """
    rows = [[rank] for rank in ranks.tolist()]
    if HAS_UFL_ELEMENTS and rows:
        # It knows the vertices that ranks share from ghosts alone, which it drops later
        others = _ranks_across_facets(cells, cell, ranks)
        rows = [row + sorted(more) for row, more in zip(rows, others)]
    offsets = np.cumsum([0] + [len(row) for row in rows], dtype=np.int32)
    data = np.array([rank for row in rows for rank in row], dtype=np.int32)
    # Its arguments differ between versions, and none of them is needed
    return lambda *_: _cpp.graph.AdjacencyList_int32(data, offsets)
