"""Meshes and their tags; function spaces and parts of mixed ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import dolfinx
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem, geometry

from ..errors import ContactError
from .generation import HAS_UFL_ELEMENTS, Array, Indices, basix_element, table, unwrap


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

    Candidates: all points where there is one cell alone. DOLFINx's tree of one box reads
    past its end for a point outside it (0.9), or finds every point (0.5).
    """
    if len(cells) == 1:
        return np.arange(len(x)), np.repeat(cells, len(x))
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


# Spaces


def space(
    mesh: dolfinx.mesh.Mesh, family: str, degree: int, shape: Sequence[int] = ()
) -> fem.FunctionSpace:
    """Function space of a family by its UFL name, with values of a given shape."""
    shape = tuple(shape)
    if not HAS_UFL_ELEMENTS:
        return fem.functionspace(mesh, (family, degree, shape or None))
    element = ufl.FiniteElement(family, mesh.ufl_cell(), degree)
    return fem.FunctionSpace(mesh, with_shape(element, shape))


def with_shape(element: Any, shape: tuple[int, ...]) -> Any:
    """Make an element of UFL's own, of scalars, one of values of a given shape."""
    if len(shape) == 1:
        return ufl.VectorElement(element, dim=shape[0])
    return ufl.TensorElement(element, shape=shape) if shape else element


def scalar_space(mesh: dolfinx.mesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Continuous scalar Lagrange space."""
    return space(mesh, "Lagrange", degree)


def vector_space(mesh: dolfinx.mesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Continuous Lagrange space of vectors with gdim components."""
    return space(mesh, "Lagrange", degree, (mesh.geometry.dim,))


@dataclass(frozen=True)
class ElementInfo:
    """Properties of the element of a function space.

    Attributes
    ----------
    is_lagrange
        Lagrange whose dofs are values at points, continuous or not.
    degree
        Polynomial degree; -1 for an element that is not in Basix.
    block_size
        Dofs per node.
    value_shape
        Shape of the values; () for a scalar.
    is_mixed
        Whether it is made of several elements (or none: quadrature elements).
    is_sub_space, is_discontinuous
        Whether it is a view into a larger space, or has its dofs inside cells.
    """

    is_lagrange: bool
    degree: int
    block_size: int
    value_shape: tuple[int, ...]
    is_mixed: bool
    is_sub_space: bool
    is_discontinuous: bool


def element_info(V: fem.FunctionSpace) -> ElementInfo:
    """Describe the element of a function space."""
    try:
        # For a blocked element, the scalar one.
        element = V.element.basix_element
    except RuntimeError:  # mixed and quadrature elements have none
        element = None
    is_mixed = element is None
    owner = V if hasattr(V, "value_shape") else V.element
    return ElementInfo(
        is_lagrange=not is_mixed
        and element.family.name == "P"
        and element.interpolation_is_identity,
        degree=-1 if is_mixed else element.degree,
        block_size=V.dofmap.index_map_bs,
        value_shape=tuple(int(n) for n in owner.value_shape),
        is_mixed=is_mixed,
        is_sub_space=len(V.component()) > 0,
        is_discontinuous=not is_mixed and element.discontinuous,
    )


def element_points(V: fem.FunctionSpace) -> Array:
    """Reference positions of the dofs of a Lagrange element, (n, tdim)."""
    return np.array(V.element.basix_element.points)


def dofmap_array(V: fem.FunctionSpace) -> Indices:
    """Local block dofs of each local cell (ghosts last), shape (n_cells, n)."""
    return table(V.dofmap.list, V.dofmap.dof_layout.num_dofs)


def component(V: fem.FunctionSpace) -> int:
    """Number of the part of a larger space that a view into it is."""
    parts = list(V.component())
    if len(parts) != 1:
        raise ContactError(
            "contact needs a part of a mixed Function, such as w.sub(0), not a part of "
            "such a part"
        )
    return int(parts[0])


def collapsed(V: fem.FunctionSpace) -> tuple[fem.FunctionSpace, npt.NDArray[np.int64]]:
    """Make a space of a view into a larger one, and find its dofs there. Collective.

    They are the indices of its local dofs in the larger one's ghosted arrays, unrolled.
    """
    own, dofs = V.collapse()
    # DOLFINx 0.11 has a list of one array
    return own, np.asarray(dofs, dtype=np.int64).ravel()


def num_parts(V: fem.FunctionSpace) -> int:
    """Number of elements that a mixed one is made of."""
    return int(V.num_sub_spaces)


def dofs_of_part(V: fem.FunctionSpace, i: int) -> npt.NDArray[np.int64]:
    """Dofs of a part of a mixed space in its ghosted arrays, unrolled, ascending."""
    dofmap = V.sub(i).dofmap
    blocks = np.unique(np.asarray(getattr(dofmap.list, "array", dofmap.list)))
    dofs = dofmap.bs * blocks[:, None].astype(np.int64) + np.arange(dofmap.bs)
    return dofs.ravel()


def part_of(argument: Any, i: int | None) -> Any:
    """A part of a Function or an argument of a mixed space; None: all of it."""
    return argument if i is None else ufl.split(argument)[i]


def same_values(f: fem.Function, g: fem.Function) -> bool:
    """Whether two Functions share their vector, as a part does with its whole."""
    return f.x is g.x or unwrap(f.x) is unwrap(g.x)


def unknowns_of(f: fem.Function) -> tuple[Any, int]:
    """Index map and block size of a Function's vector; of a part those of the whole."""
    dofmap = f.function_space.dofmap
    return dofmap.index_map, dofmap.index_map_bs


def is_like(V: Any, W: fem.FunctionSpace) -> bool:
    """Whether a C++ space has the mesh of another one and as many dofs."""
    of, other = unwrap(V), unwrap(W)
    maps = of.dofmap.index_map, other.dofmap.index_map
    sizes = [(one.size_local, one.num_ghosts, one.size_global) for one in maps]
    same_blocks = of.dofmap.index_map_bs == other.dofmap.index_map_bs
    return bool(of.mesh is other.mesh and same_blocks and sizes[0] == sizes[1])


def contains(V: fem.FunctionSpace, W: fem.FunctionSpace) -> bool:
    """Whether a space is another one, or a part of it."""
    return bool(unwrap(V).contains(unwrap(W)))
