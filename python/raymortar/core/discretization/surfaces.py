"""Bodies, which are cells that are connected, and surfaces as arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from mpi4py import MPI

import numpy as np
from dolfinx.fem import FunctionSpace

from .. import compat
from ..compat import Array, Indices, Mask
from . import facets as lookup
from .facets import FACET_SHAPE, N_CORNERS, Facets, Global, normals, shape_functions
from .joined import NUMBERS_OF_PART, JoinedSpace, parts_of, places_of
from .ranks import of_all, sums_at

# Undeformed positions (3, n) to points of the true surface (3, n), or whether normals
# tell the surface
Smooth: TypeAlias = "bool | Callable[[Array], Array]"


@dataclass(frozen=True)
class Bodies:
    """The body of each node, the same on any number of ranks."""

    count: int  # on all ranks together
    # Of each local block dof, ghosts last; numbered alike on all ranks, in any order
    dofs: Indices


def bodies_of_facets(bodies: Bodies, surface: Any) -> Indices:
    """Body of each facet of a `surfaces.Surface`, (facets,)."""
    return bodies.dofs[surface.dofs[surface.facet_dofs[:, 0]]]


def connected(rows: Indices, n: int) -> Global:
    """Find the smallest of the entities that each of n entities is connected with."""
    # To import SciPy takes longer than all of this package
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one, other = np.repeat(rows[:, 0], rows.shape[1] - 1), rows[:, 1:].ravel()
    graph = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(n, n))
    _, part = connected_components(graph, directed=False)
    _, first = np.unique(part, return_index=True)
    return first[part]


def find_parts(
    comm: MPI.Comm, index_map: Any, rows: Indices, used: Mask | None = None
) -> tuple[Indices, int]:
    """Find the connected part of each local dof, and their number on all ranks.

    Rows (rows, n) have the block dofs that they tie to each other. Dofs that are not
    used, on every rank that has them, get -1. Collective.
    """
    n = index_map.size_local + index_map.num_ghosts
    used = np.ones(n, dtype=bool) if used is None else used
    parts, part = np.unique(connected(rows, n)[used], return_inverse=True)
    # Number the parts of all ranks, and find those that share a node
    counts = np.array(comm.allgather(len(parts)))
    owners = compat.create_la_vector(index_map)
    owners.array[:] = -1.0
    owners.array[used] = mine = counts[: comm.rank].sum() + part
    compat.scatter_forward(owners)
    ties = np.column_stack([mine, owners.array[used].astype(np.int64)])
    lowest = connected(of_all(comm, np.unique(ties, axis=0))[0], int(counts.sum()))
    roots, joined = np.unique(lowest, return_inverse=True)
    found = np.full(n, -1, dtype=np.int32)
    found[used] = joined[mine]
    return found, len(roots)


def find_bodies(V: FunctionSpace | JoinedSpace) -> Bodies:
    """Find the connected parts of the mesh, or meshes, of a continuous space. Collective."""
    if not isinstance(V, JoinedSpace):
        dofmap = V.dofmap
        dofs, count = find_parts(V.mesh.comm, dofmap.index_map, compat.dofmap_array(V))
        return Bodies(count, dofs)
    # Bodies of several meshes, one after the other
    parts, count = [find_bodies(part) for part in V.parts], 0
    dofs = np.empty(sum(len(one.dofs) for one in parts), dtype=np.int32)
    for one, places in zip(parts, V.index_map.places):
        dofs[places] = one.dofs + count
        count += one.count
    return Bodies(count, dofs)


@dataclass(frozen=True)
class Surface:
    """A union of tagged facets in the reference configuration, one rank's share.

    Attributes
    ----------
    shape
        ``"interval"``, ``"triangle"`` or ``"quadrilateral"``.
    gdim
        Dimension d of the space.
    displacement_degree
        Degree p of the displacement on a facet.
    node_degree
        Degree k = max(p, degree of the geometry) of the positions on a facet.
    dofs
        Local block dofs of the displacement space in use, sorted, (n_dofs,), int32.
    dof_ids
        Their global indices, (n_dofs,), int64.
    facet_dofs
        Displacement dofs of each facet, (n_facets, n_p), int32, indices into ``dofs``.
    X
        Reference positions of the nodes, (n_nodes, d). Length.
    node_ids
        Global identification of the nodes, (n_nodes,), int64.
    facet_nodes
        Nodes of each facet, (n_facets, n_k), int32, indices into ``X``.
    facet_ids
        Global cell index * 8 + local facet, (n_facets,), int64: unique over ranks.
    zone
        Number of the set of facets that each facet comes from, (n_facets,), int32.
    axisymmetric
        Whether the facets stand for the surface that they make in a full turn.
    is_straight
        Whether the cells behind the facets are straight, of degree 1.
    arcs
        Heights of the arcs that curve straight facets, (n_facets,); None: they are not
        curved. Length.

    Notes
    -----
    If k = p, nodes and dofs are the same and in the same order. If k = 2 > p = 1,
    the nodes are those of the geometry, or mid nodes from `curving`.
    """

    shape: str
    gdim: int
    displacement_degree: int
    node_degree: int
    dofs: Indices
    dof_ids: Global
    facet_dofs: Indices
    X: Array
    node_ids: Global
    facet_nodes: Indices
    facet_ids: Global
    zone: Indices
    axisymmetric: bool = False
    is_straight: bool = False
    arcs: Array | None = None

    @property
    def nodes(self) -> Array:
        """Reference positions of the nodes of each facet, (n_facets, n_k, d)."""
        return self.X[self.facet_nodes]

    @property
    def body_nodes(self) -> Array:
        """Undeformed places of the displacement's nodes of each facet in the body, not on
        the arcs that curve it, (n_facets, n_p, d)."""
        count = self.facet_dofs.shape[1]
        if self.arcs is None:
            return self.nodes[:, :count]
        places = lookup.facet_nodes(self.shape, self.displacement_degree)
        chord, _ = lookup.shape_functions(self.shape, 1, places)
        return np.einsum("ka,fad->fkd", chord, self.nodes[:, : chord.shape[1]])


def _compress(table: Indices) -> tuple[Indices, Indices]:
    """Sorted unique entries of a table, and the table as indices into them."""
    used, inverse = np.unique(table, return_inverse=True)
    return used.astype(np.int32), inverse.reshape(table.shape).astype(np.int32)


def build_surface(
    u: Any, facets_list: Sequence[Facets], part: int = 0, axisymmetric: bool = False
) -> Surface:
    """Make the arrays of at least one set of facets, on the mesh of a given number.

    The space of u must have passed `check_space`; no facet may be in two sets.
    """
    V, places = parts_of(u)[part].function_space, places_of(u, part)
    mesh, first = V.mesh, part * NUMBERS_OF_PART
    gdim, p = mesh.geometry.dim, compat.element_info(V).degree
    facets = lookup.join(facets_list)
    dofs, facet_dofs = _compress(lookup.facet_dof_table(V, facets))
    dof_ids, table = compat.local_to_global(V.dofmap.index_map, dofs), facet_dofs
    X, node_ids = V.tabulate_dof_coordinates()[dofs, :gdim], dof_ids
    if compat.geometry_degree(mesh) > p:
        nodes, table = _compress(lookup.facet_node_table(mesh, facets))
        X = lookup.coordinates(mesh)[nodes]
        node_ids = compat.geometry_nodes_global(mesh)[nodes]
    counts = [len(one.facets) for one in facets_list]
    return Surface(
        shape=FACET_SHAPE[compat.cell_name(mesh)],
        gdim=gdim,
        displacement_degree=p,
        node_degree=max(p, compat.geometry_degree(mesh)),
        dofs=dofs if places is None else places[dofs],
        dof_ids=dof_ids + first,
        facet_dofs=facet_dofs,
        X=np.ascontiguousarray(X),
        node_ids=node_ids + first,
        facet_nodes=table,
        facet_ids=lookup.facet_ids(mesh, facets) + first,
        axisymmetric=axisymmetric,
        zone=np.repeat(np.arange(len(counts), dtype=np.int32), counts),
        is_straight=compat.geometry_degree(mesh) == 1,
    )


def corner_ids(surface: Surface) -> Global:
    """Global numbers of the corners of facets, (n_facets, n)."""
    corners = surface.facet_dofs[:, : N_CORNERS[surface.shape]]
    return surface.dof_ids[corners]


# Areas


def rule_normals(
    shape: str, degree: int, nodes: Array, axisymmetric: bool = False
) -> tuple[Array, Array, Array]:
    """Points and weights of a quadrature rule, and normals m of the facets there.

    Nodes are (facets, nodes per facet, d), normals (facets, points, d). The length of m
    is the Jacobian, times the circumference where areas are those of a full turn.
    """
    points, weights = compat.quadrature(shape, 2 * degree + axisymmetric)
    N, gradients = shape_functions(shape, degree, points)
    m = normals(np.einsum("iqa,fad->ifqd", gradients, nodes))
    if axisymmetric:
        # The circumference, 2 pi r [theory (2.12)]
        m = m * 2.0 * np.pi * np.einsum("qa,fa->fq", N, nodes[..., 0])[..., None]
    return points, weights, m


def facet_areas(shape: str, degree: int, nodes: Array) -> Array:
    """Area (length in 2D) of facets given by their nodes, (facets,)."""
    _, weights, m = rule_normals(shape, degree, nodes)
    return np.linalg.norm(m, axis=-1) @ weights


def surface_normals(surface: Surface) -> tuple[Array, Array, Array]:
    """`rule_normals` of the undeformed facets of a surface."""
    degree, turns = surface.node_degree, surface.axisymmetric
    return rule_normals(surface.shape, degree, surface.nodes, turns)


def surface_areas(surface: Surface) -> Array:
    """Area of undeformed facets: in 2D a length, or the area of a full turn."""
    _, weights, m = surface_normals(surface)
    return np.linalg.norm(m, axis=-1) @ weights


def surface_sizes(surface: Surface) -> Array:
    """Area of the facets themselves, in 2D their length, (facets,)."""
    return facet_areas(surface.shape, surface.node_degree, surface.nodes)


def facet_lengths(surface: Surface) -> Array:
    """Length of the sides of facets, by their area, (facets,)."""
    return surface_sizes(surface) ** (1.0 / (surface.gdim - 1))


def vector_areas(
    surface: Surface, index_map: Any, degree: int, table: Indices, counts: Any = 1.0
) -> Array:
    """Sum up int N n dG over the facets of all ranks at local block dofs. Collective.

    N has the given degree, and the block dofs of a table (facets, n) of the index map.
    `counts` is how often each facet counts.
    """
    points, weights, m = surface_normals(surface)
    N, _ = shape_functions(surface.shape, degree, points)
    shares = np.einsum("q,qa,fqd->fad", weights, N, m)
    shares *= np.reshape(counts, (-1, 1, 1))
    return sums_at(index_map, surface.gdim, (table, shares))
