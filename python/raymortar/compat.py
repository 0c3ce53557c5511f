"""Every difference between DOLFINx 0.5, 0.9 and 0.11 (and Basix, UFL, petsc4py).

Nothing else in raymortar asks for a version. Where two generations differ by a name
or a type, the code asks for the feature rather than for the number.

Vectors are handled as *ghosted arrays*: the unrolled dofs of a space on this rank,
owned ones first, then ghosts, shape ``((owned + ghosts) * block size,)``.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import basix
import dolfinx
import dolfinx.fem.petsc
import dolfinx.io
import dolfinx.nls.petsc
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import cpp as _cpp
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from . import pvd
from .errors import ContactError, raise_everywhere, together, writing

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int32]

# UFL lost its own element classes when Basix took them over (DOLFINx 0.8).
_HAS_UFL_ELEMENTS = hasattr(ufl, "VectorElement")


def _unwrap(wrapped: Any) -> Any:
    """C++ object behind a Python one; the object itself where it is the C++ one."""
    return getattr(wrapped, "_cpp_object", wrapped)


def _table(adjacency: Any, width: int) -> Indices:
    """Rows of equal length as an array (n, width); 0.5 has adjacency lists."""
    return np.asarray(getattr(adjacency, "array", adjacency)).reshape(-1, width)


def scalar_type_is_real() -> bool:
    """Whether PETSc was built for real numbers."""
    return not np.issubdtype(PETSc.ScalarType, np.complexfloating)


# Reference cells


@dataclass(frozen=True)
class ReferenceElement:
    """Lagrange element on a reference cell, as arrays.

    Attributes
    ----------
    points
        Node of each dof, shape (n_dofs, tdim), reference coordinates.
    facet_dofs
        Dofs in the closure of each local facet.
    facet_vertices
        Cell vertices of each local facet, in Basix order.
    vertices
        Vertices of the reference cell, shape (n_vertices, tdim).
    gradients
        Derivatives of the functions at the points, shape (tdim, n_dofs, n_dofs): by
        direction, point, function.
    """

    points: Array
    facet_dofs: tuple[tuple[int, ...], ...]
    facet_vertices: tuple[tuple[int, ...], ...]
    vertices: Array
    gradients: Array


@functools.lru_cache(maxsize=None)
def basix_element(cell: str, degree: int) -> ReferenceElement:
    """Plain Lagrange element of Basix.

    Parameters
    ----------
    cell
        Name of the cell, such as ``"triangle"``.
    degree
        Polynomial degree, 1 or more.
    """
    cell_type = getattr(basix.CellType, cell)
    element = basix.create_element(
        basix.ElementFamily.P, cell_type, degree, basix.LagrangeVariant.equispaced
    )
    topology = basix.topology(cell_type)
    facet_dim = len(topology) - 2
    return ReferenceElement(
        points=np.array(element.points),
        facet_dofs=tuple(map(tuple, element.entity_closure_dofs[facet_dim])),
        facet_vertices=tuple(map(tuple, topology[facet_dim])),
        vertices=np.array(basix.geometry(cell_type)),
        gradients=np.array(element.tabulate(1, element.points)[1:, :, :, 0]),
    )


def tabulate(cell: str, degree: int, points: Array) -> Array:
    """Shape functions of that element and their gradients, as Basix has them.

    Returns
    -------
    ndarray
        Shape (1 + tdim, n_points, n): values, then derivatives along each axis.
    """
    element = basix.create_element(
        basix.ElementFamily.P,
        getattr(basix.CellType, cell),
        degree,
        basix.LagrangeVariant.equispaced,
    )
    return np.array(element.tabulate(1, points)[:, :, :, 0])


@functools.lru_cache(maxsize=None)
def quadrature(shape_name: str, degree: int) -> tuple[Array, Array]:
    """Quadrature rule on a Basix reference cell.

    Parameters
    ----------
    shape_name
        ``"interval"``, ``"triangle"`` or ``"quadrilateral"``.
    degree
        Degree up to which polynomials are integrated exactly.

    Returns
    -------
    points, weights
        Shapes (n, tdim) and (n,); the weights sum to the cell's reference volume.
        Shared between callers, hence read-only.
    """
    rule = basix.make_quadrature(getattr(basix.CellType, shape_name), degree)
    points, weights = (np.array(part, dtype=np.float64) for part in rule)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


# Meshes


def cell_name(mesh: dolfinx.mesh.Mesh) -> str:
    """Cell type, such as ``"triangle"``; ``"mixed"`` if there are several."""
    types = getattr(mesh.topology, "entity_types", None)
    if types is not None and len(types[mesh.topology.dim]) > 1:
        return "mixed"
    return mesh.topology.cell_type.name


def _coordinate_map(mesh: dolfinx.mesh.Mesh) -> Any:
    """Coordinate element of a mesh with one cell type."""
    maps = getattr(mesh.geometry, "cmaps", None)
    return mesh.geometry.cmap if maps is None else maps[0]


def on_mesh(thing: Any, mesh: dolfinx.mesh.Mesh) -> bool:
    """Whether MeshTags or a Function are of this very mesh, not of a like one."""
    owner = thing.function_space.mesh if hasattr(thing, "function_space") else thing
    owner = owner if hasattr(owner, "topology") else owner.mesh  # MeshTags before 0.7
    return _unwrap(owner.topology) is _unwrap(mesh.topology)


def geometry_degree(mesh: dolfinx.mesh.Mesh) -> int:
    """Polynomial degree of the cells' geometry."""
    return _coordinate_map(mesh).degree


def geometry_dofmap(mesh: dolfinx.mesh.Mesh) -> Indices:
    """Geometry nodes of each local cell (ghosts last), shape (n_cells, n)."""
    dofmaps = getattr(mesh.geometry, "dofmaps", None)
    dofmap = mesh.geometry.dofmap if dofmaps is None else dofmaps[0]
    element = basix_element(cell_name(mesh), geometry_degree(mesh))
    return _table(dofmap, len(element.points))


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


def _mesh_domain(cell: str, degree: int, gdim: int) -> ufl.Mesh:
    """UFL mesh with a Lagrange coordinate element."""
    if _HAS_UFL_ELEMENTS:
        ufl_cell = ufl.Cell(cell, geometric_dimension=gdim)
        return ufl.Mesh(ufl.VectorElement("Lagrange", ufl_cell, degree))
    import basix.ufl

    # Equispaced, as for the meshes that DOLFINx builds or reads itself.
    variant = basix.LagrangeVariant.equispaced
    return ufl.Mesh(basix.ufl.element("Lagrange", cell, degree, variant, shape=(gdim,)))


def _ranks_across_facets(
    cells: npt.NDArray[np.int64], cell: str, ranks: Indices
) -> list[set[int]]:
    """Other ranks that have a cell across a facet, for each of the cells."""
    columns = np.array(basix_element(cell, 1).facet_vertices)
    facets = np.sort(cells[:, columns], axis=2).reshape(-1, columns.shape[1])
    of_cell = np.repeat(np.arange(len(cells)), len(columns))
    order = np.lexsort(facets.T)
    same = np.all(facets[order][1:] == facets[order][:-1], axis=1)
    others: list[set[int]] = [set() for _ in cells]
    for a, b in zip(of_cell[order][:-1][same], of_cell[order][1:][same]):
        for here, there in ((a, b), (b, a)):
            if ranks[here] != ranks[there]:
                others[here].add(int(ranks[there]))
    return others


def _given_partition(cells: npt.NDArray[np.int64], cell: str, ranks: Indices) -> Any:
    """Partitioner that sends each of this rank's cells where it is told."""
    rows = [[rank] for rank in ranks.tolist()]
    if _HAS_UFL_ELEMENTS:
        # It knows the vertices that ranks share from ghosts alone, which it drops later
        others = _ranks_across_facets(cells, cell, ranks)
        rows = [row + sorted(more) for row, more in zip(rows, others)]
    offsets = np.cumsum([0] + [len(row) for row in rows], dtype=np.int32)
    data = np.array([rank for row in rows for rank in row], dtype=np.int32)
    # Its arguments differ between versions, and none of them is needed
    return lambda *_: _cpp.graph.AdjacencyList_int32(data, offsets)


def _partitioner(ghosts: bool) -> Any:
    """DOLFINx's, from 0.9 on with or without a layer of ghost cells."""
    if _HAS_UFL_ELEMENTS:
        return _cpp.mesh.create_cell_partitioner()
    modes = dolfinx.mesh.GhostMode
    mode = modes.shared_facet if ghosts else modes.none
    try:
        return dolfinx.mesh.create_cell_partitioner(mode)
    except TypeError:  # 0.11 also wants the most cells that meet in a facet
        return dolfinx.mesh.create_cell_partitioner(mode, 2)


def create_mesh(
    comm: MPI.Comm,
    cells: npt.ArrayLike,
    points: npt.ArrayLike,
    cell: str,
    degree: int = 1,
    ghosts: bool = False,
    destinations: npt.ArrayLike | None = None,
) -> dolfinx.mesh.Mesh:
    """Mesh from arrays. Collective.

    Parameters
    ----------
    comm
        Communicator over which to distribute the cells.
    cells
        Nodes of each cell in Basix order, shape (n_cells, n), indices into the
        points of all ranks together; other ranks pass zero rows.
    points
        Coordinates, shape (n_points, gdim). Length.
    cell
        Name of the cell type.
    degree
        Degree of the geometry.
    ghosts
        Whether to keep one layer of ghost cells (cells across a shared facet).
    destinations
        Rank that gets each of the cells, shape (n_cells,), without ghosts; all cells
        must then be passed by one rank. Default: up to DOLFINx's graph partitioner.
    """
    if ghosts and destinations is not None:
        raise ValueError("destinations and ghosts exclude each other")
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    points = np.ascontiguousarray(points, dtype=np.float64)
    domain = _mesh_domain(cell, degree, points.shape[1])
    partitioner = (
        _partitioner(ghosts)
        if destinations is None
        else _given_partition(cells, cell, np.asarray(destinations, dtype=np.int32))
    )
    if not _HAS_UFL_ELEMENTS:
        # By name: 0.10 swapped the order of the points and the element.
        return dolfinx.mesh.create_mesh(
            comm, cells=cells, x=points, e=domain, partitioner=partitioner
        )
    modes = dolfinx.mesh.GhostMode
    return dolfinx.mesh.create_mesh(
        comm,
        _cpp.graph.AdjacencyList_int64(cells),
        points,
        domain,
        ghost_mode=modes.shared_facet if ghosts else modes.none,
        partitioner=partitioner,
    )


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


# Gmsh


@dataclass(frozen=True)
class GmshMesh:
    """What was read from Gmsh.

    Attributes
    ----------
    mesh
        The distributed mesh.
    cell_tags, facet_tags
        Tags of physical groups; ``facet_tags`` is empty if there are none.
    names
        (dimension, tag) of each named physical group.
    """

    mesh: dolfinx.mesh.Mesh
    cell_tags: Any
    facet_tags: Any
    names: dict[str, tuple[int, int]]


def _gmsh_converter() -> Any:
    """``model_to_mesh`` of DOLFINx."""
    try:
        from dolfinx.io import gmsh as converter  # 0.10 and later
    except ImportError:
        from dolfinx.io import gmshio as converter
    return converter.model_to_mesh


def _physical_names(model: Any) -> dict[str, tuple[int, int]]:
    """Named physical groups of the current Gmsh model."""
    groups = [(int(dim), int(tag)) for dim, tag in model.getPhysicalGroups()]
    names = {model.getPhysicalName(*group): group for group in groups}
    return {name: group for name, group in names.items() if name}


def _gmsh_fault(model: Any) -> str | None:
    """Why the current Gmsh model cannot be read, if so."""
    if not hasattr(model, "getPhysicalGroups"):
        return f"source must be gmsh.model or the path of a .msh file, not {model!r}"
    groups = model.getPhysicalGroups()
    if not groups:
        return "the Gmsh model has no physical groups, which is all that is read"
    top = max(dim for dim, _ in groups)
    types = set()
    for dim, tag in groups:
        if dim == top:
            for entity in model.getEntitiesForPhysicalGroup(dim, tag):
                types.update(model.mesh.getElements(dim, entity)[0])
    if len(types) != 1:
        # DOLFINx before 0.10 crashes on these, and contact needs one type anyway.
        names = sorted(model.mesh.getElementProperties(t)[0] for t in types)
        return f"the cells of the Gmsh model must be of one type, not of {names}"
    return None


def _convert_gmsh(model: Any, comm: MPI.Comm, gdim: int, rank: int) -> GmshMesh:
    """Mesh, tags and names of the Gmsh model that lives on one rank. Collective."""
    here = comm.rank == rank
    raise_everywhere(comm, _gmsh_fault(model) if here else None)
    names = comm.bcast(_physical_names(model) if here else None, root=rank)
    # A tuple before 0.10, a named tuple with further tags since.
    mesh, cell_tags, facet_tags = _gmsh_converter()(model, comm, rank, gdim=gdim)[:3]
    if facet_tags is None:
        facet_tags = meshtags(mesh, mesh.topology.dim - 1, [], [])
    return GmshMesh(mesh, cell_tags, facet_tags, names)


def _open_in_gmsh(gmsh: Any, path: Path) -> str | None:
    """Open a file; what is wrong with it, if anything."""
    try:
        gmsh.open(str(path))
    except Exception as error:  # Gmsh raises nothing narrower
        return f"{path} is not a whole Gmsh file: {error}"
    return None


def _read_gmsh_file(path: Path, comm: MPI.Comm, gdim: int, rank: int) -> GmshMesh:
    """Open a file on one rank and convert it. Collective.

    DOLFINx 0.5.2 has such a function too, which returns an undefined name.
    """
    missing = comm.rank == rank and not path.is_file()
    raise_everywhere(comm, f"there is no Gmsh file {path}" if missing else None)
    if comm.rank != rank:
        raise_everywhere(comm, None)  # unless the reading rank has a reason to
        return _convert_gmsh(None, comm, gdim, rank)
    import gmsh

    # Gmsh 4.8 cannot tell, and then a session of the caller's ends here too.
    ours = not getattr(gmsh, "isInitialized", bool)()
    if ours:
        gmsh.initialize(["", "-v", "1"])
    try:
        raise_everywhere(comm, _open_in_gmsh(gmsh, path))
        return _convert_gmsh(gmsh.model, comm, gdim, rank)
    finally:
        if ours:
            gmsh.finalize()


def read_gmsh(source: Any, comm: MPI.Comm, gdim: int = 3, rank: int = 0) -> GmshMesh:
    """Mesh and tags from a Gmsh model or file. Collective.

    Parameters
    ----------
    source
        ``gmsh.model``, or the path of a ``.msh`` file; looked at on ``rank`` only.
    comm
        Communicator over which to distribute the mesh.
    gdim
        Dimension of the space, 2 or 3.
    rank
        The rank that holds the model or reads the file.

    Raises
    ------
    ContactError
        If the file does not exist or is damaged, there are no physical groups, or the
        cells are of several types.
    """
    # All ranks take the same branch, whatever was passed on the others.
    is_file = comm.bcast(isinstance(source, (str, Path)), root=rank)
    if is_file:
        path = Path(source) if comm.rank == rank else Path()
        return _read_gmsh_file(path, comm, gdim, rank)
    return _convert_gmsh(source, comm, gdim, rank)


# Function spaces


def space(
    mesh: dolfinx.mesh.Mesh, family: str, degree: int, shape: Sequence[int] = ()
) -> fem.FunctionSpace:
    """Function space of a family by its UFL name, with values of a given shape."""
    shape = tuple(shape)
    if not _HAS_UFL_ELEMENTS:
        return fem.functionspace(mesh, (family, degree, shape or None))
    element = ufl.FiniteElement(family, mesh.ufl_cell(), degree)
    if len(shape) == 1:
        element = ufl.VectorElement(element, dim=shape[0])
    elif shape:
        element = ufl.TensorElement(element, shape=shape)
    return fem.FunctionSpace(mesh, element)


def scalar_space(mesh: dolfinx.mesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Continuous scalar Lagrange space."""
    return space(mesh, "Lagrange", degree)


def vector_space(mesh: dolfinx.mesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Continuous Lagrange space of vectors with gdim components."""
    return space(mesh, "Lagrange", degree, (mesh.geometry.dim,))


@dataclass(frozen=True)
class ElementInfo:
    """What raymortar asks of the element of a function space.

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


def _value_shape(V: fem.FunctionSpace) -> tuple[int, ...]:
    """Shape of the values of a space's functions."""
    owner = V if hasattr(V, "value_shape") else V.element
    return tuple(int(n) for n in owner.value_shape)


def element_info(V: fem.FunctionSpace) -> ElementInfo:
    """Describe the element of a function space."""
    try:
        # For a blocked element, the scalar one.
        element = V.element.basix_element
    except RuntimeError:  # mixed and quadrature elements have none
        element = None
    block_size = V.dofmap.index_map_bs
    is_mixed = element is None
    return ElementInfo(
        is_lagrange=not is_mixed
        and element.family.name == "P"
        and element.interpolation_is_identity,
        degree=-1 if is_mixed else element.degree,
        block_size=block_size,
        value_shape=_value_shape(V),
        is_mixed=is_mixed,
        is_sub_space=len(V.component()) > 0,
        is_discontinuous=not is_mixed and element.discontinuous,
    )


def element_points(V: fem.FunctionSpace) -> Array:
    """Reference positions of the dofs of a Lagrange element, (n, tdim)."""
    return np.array(V.element.basix_element.points)


def dofmap_array(V: fem.FunctionSpace) -> Indices:
    """Local block dofs of each local cell (ghosts last), shape (n_cells, n)."""
    return _table(V.dofmap.list, V.dofmap.dof_layout.num_dofs)


# Parts of mixed spaces


def mixed_space(
    mesh: dolfinx.mesh.Mesh, *parts: tuple[str, int, tuple[int, ...]]
) -> fem.FunctionSpace:
    """Mixed space of several elements.

    Parameters
    ----------
    mesh
        Mesh.
    parts
        Family, degree and shape of the values of each, as of `space`.
    """
    if _HAS_UFL_ELEMENTS:
        elements = [space(mesh, *part).ufl_element() for part in parts]
        return fem.FunctionSpace(mesh, ufl.MixedElement(elements))
    import basix.ufl

    elements = [
        basix.ufl.element(family, cell_name(mesh), degree, shape=shape or None)
        for family, degree, shape in parts
    ]
    return fem.functionspace(mesh, basix.ufl.mixed_element(elements))


def component(V: fem.FunctionSpace) -> int:
    """Which part of a larger space a view into it is.

    Raises
    ------
    ContactError
        If it is a part of a part.
    """
    parts = list(V.component())
    if len(parts) != 1:
        raise ContactError(
            "contact needs a part of a mixed Function, such as w.sub(0), not a part of "
            "such a part"
        )
    return int(parts[0])


def collapsed(V: fem.FunctionSpace) -> tuple[fem.FunctionSpace, npt.NDArray[np.int64]]:
    """A view into a larger space as a space of its own, and the place of each of its
    local dofs in the larger one's ghosted arrays, unrolled. Collective."""
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
    return f.x is g.x or _unwrap(f.x) is _unwrap(g.x)


def unknowns_of(f: fem.Function) -> tuple[Any, int]:
    """Index map and block size of a Function's vector; of a part those of the whole."""
    dofmap = f.function_space.dofmap
    return dofmap.index_map, dofmap.index_map_bs


def contains(V: fem.FunctionSpace, W: fem.FunctionSpace) -> bool:
    """Whether a space is another one, or a part of it."""
    return bool(_unwrap(V).contains(_unwrap(W)))


# Vectors


def create_la_vector(index_map: Any, bs: int = 1) -> Any:
    """Zero ``dolfinx.la`` vector of doubles over an index map with a block size."""
    if hasattr(index_map, "create_vector"):  # of several meshes
        return index_map.create_vector(bs)
    return dolfinx.la.vector(index_map, bs, dtype=np.float64)


def scatter_forward(vector: Any) -> None:
    """Send the owners' values to the ghosts. Collective."""
    vector.scatter_forward()


def scatter_reverse_add(vector: Any) -> None:
    """Add the ghosts' values to their owners'. Collective.

    Ghosts keep theirs: follow with :func:`scatter_forward` where they are read.
    """
    modes = getattr(dolfinx.la, "InsertMode", None) or dolfinx.la.ScatterMode
    vector.scatter_reverse(modes.add)


# Forms and boundary conditions


# Options of the form compiler and of just-in-time compilation, before DOLFINx 0.6
_FORM_OPTIONS = {"form_compiler_options": "form_compiler_params"}
_FORM_OPTIONS["jit_options"] = "jit_params"


def form(
    ufl_form: Any,
    form_compiler_options: Mapping[str, Any] | None = None,
    jit_options: Mapping[str, Any] | None = None,
) -> Any:
    """Compile a form, or lists of them with None for what is zero. Collective (the
    first rank compiles).

    Parameters
    ----------
    form_compiler_options, jit_options
        As of ``dolfinx.fem.form``; None: none.
    """
    if isinstance(ufl_form, (list, tuple)):
        return [form(one, form_compiler_options, jit_options) for one in ufl_form]
    if ufl_form is None:
        return None
    names = inspect.signature(fem.form).parameters
    options = {}
    for name, given in zip(_FORM_OPTIONS, (form_compiler_options, jit_options)):
        if given is not None:
            options[name if name in names else _FORM_OPTIONS[name]] = dict(given)
    return fem.form(ufl_form, **options)


def is_same_space(V: Any, W: fem.FunctionSpace) -> bool:
    """Whether two spaces are one: in a like one DOLFINx passes over W's conditions."""
    return V is W or _unwrap(V) == _unwrap(W)


def compiled_rank(form: Any) -> int | None:
    """Rank of a compiled form; None for anything else."""
    spaces = getattr(_unwrap(form), "function_spaces", None)
    return None if spaces is None else len(spaces)


def test_space(form: Any) -> Any:
    """C++ space of a compiled form's test function."""
    return _unwrap(form).function_spaces[0]


def assemble_residual(b: Array, L: Any) -> None:
    """Add a compiled linear form into a ghosted array; ghosts are not sent home."""
    fem.assemble_vector(b, L)


def apply_lifting(
    b: Array, a: Any, bcs: Sequence[Any], x0: Array, scale: float
) -> None:
    """b <- b - scale A (g - x0) over the constrained columns of A; ghosted arrays.

    Parameters
    ----------
    b
        Array to change; ghosts are not sent home.
    a
        Compiled bilinear form of A.
    bcs
        Dirichlet conditions on the form's trial space: the values g.
    x0
        Present solution.
    scale
        Factor; -1 for the residual of Newton's method.
    """
    fem.apply_lifting(b, [a], [list(bcs)], [x0], scale)


def set_bc(
    b: Array, bcs: Sequence[Any], x0: Array | None = None, scale: float = 1.0
) -> None:
    """b = scale (g - x0) at the constrained dofs; ghosted arrays, x0 0 by default."""
    for bc in bcs:
        if hasattr(bc, "set"):
            bc.set(b, x0, scale)
        else:
            fem.set_bc(b, [bc], x0, scale)


def dirichlet_dofs(
    bcs: Sequence[Any], V: fem.FunctionSpace
) -> tuple[npt.NDArray[np.int8], Array]:
    """Constrained dofs of a space and their values.

    Parameters
    ----------
    bcs
        Dirichlet conditions on V or on components of it.
    V
        Space of the unknown.

    Returns
    -------
    marker, values
        Ghosted arrays: 1 where constrained, and the value g there (0 elsewhere).

    Raises
    ------
    ContactError
        If a condition is on another space: DOLFINx would silently pass over it.
    """
    for i, bc in enumerate(bcs):
        if not hasattr(bc, "dof_indices"):
            raise ContactError(
                f"boundary condition {i} is no Dirichlet condition, but {bc!r}"
            )
        if not has_condition(V, bc):
            raise ContactError(
                f"boundary condition {i} is not on the space of the displacement: "
                "make it with u.function_space or a sub-space of it"
            )
    return prescribed_values(bcs, V.dofmap.index_map, V.dofmap.index_map_bs)


def has_condition(V: fem.FunctionSpace, bc: Any) -> bool:
    """Whether a Dirichlet condition is on a space or a part of it."""
    return contains(V, bc.function_space)


def prescribed_values(
    bcs: Sequence[Any], index_map: Any, bs: int
) -> tuple[npt.NDArray[np.int8], Array]:
    """Ghosted arrays of what conditions on one space prescribe, as `dirichlet_dofs`."""
    values = np.zeros((index_map.size_local + index_map.num_ghosts) * bs)
    marker = np.zeros(len(values), dtype=np.int8)
    for bc in bcs:
        marker[bc.dof_indices()[0]] = 1
    set_bc(values, bcs)
    return marker, values


def dirichlet_increment(bcs: Sequence[Any], x0: Array) -> Array:
    """g - x0 at the constrained dofs, 0 elsewhere and where it is rounding; ghosted."""
    increment = np.zeros_like(x0)
    set_bc(increment, bcs, x0)
    return without_rounding(increment, x0)


def without_rounding(increment: Array, x0: Array) -> Array:
    """An increment of x0, 0 where it is rounding: ranks that share a dof may find its
    value in different cells."""
    rounding = 8.0 * np.finfo(float).eps * np.abs(x0)
    return np.where(np.abs(increment) <= rounding, 0.0, increment)


def assemble_jacobian(A: PETSc.Mat, a: Any, bcs: Sequence[Any]) -> None:
    """Add a compiled bilinear form into the displacement block of a matrix.

    Constrained rows and columns are left out, and their owned diagonal set to 1.
    Collective, but the final assembly is the caller's; in between, values may be
    inserted or added.

    Parameters
    ----------
    A
        Coupled matrix. Its local-to-global map starts with the ghosted dofs of the
        form's space, unrolled; what follows them is not touched.
    a
        Compiled bilinear form with the same test and trial space.
    bcs
        Dirichlet conditions on that space.
    """
    a, bcs = _unwrap(a), [_unwrap(bc) for bc in bcs]
    constants, coefficients = _cpp.fem.pack_constants(a), _cpp.fem.pack_coefficients(a)
    # Unrolled: the multiplier's rows leave the matrix no common block size.
    _cpp.fem.petsc.assemble_matrix(A, a, constants, coefficients, bcs, True)
    # PETSc refuses to mix adding and inserting without a flush between them.
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)
    _cpp.fem.petsc.insert_diagonal(A, a.function_spaces[0], bcs, 1.0)
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)


def assemble_blocks(
    A: PETSc.Mat,
    a: Sequence[Sequence[Any]],
    bcs: Sequence[Any],
    starts: npt.NDArray[np.int64],
    fixed: Indices,
) -> None:
    """Add compiled bilinear forms of several unknowns into a matrix.

    As `assemble_jacobian`, which does the same for one.

    Parameters
    ----------
    A
        Coupled matrix. Its local-to-global map has the ghosted dofs of all unknowns,
        one after the other, unrolled.
    a
        Forms by test and trial space; None: zero.
    bcs
        Dirichlet conditions on any of the spaces.
    starts
        First local dof of each unknown, then their number.
    fixed
        Rows of the constrained owned dofs, global.
    """
    bcs = [_unwrap(bc) for bc in bcs]
    sets = [
        PETSc.IS().createGeneral(np.arange(*ends, dtype=PETSc.IntType), PETSc.COMM_SELF)
        for ends in zip(starts, starts[1:])
    ]
    for rows, forms in zip(sets, a):
        for columns, one in zip(sets, forms):
            if one is None:
                continue
            part, one = A.getLocalSubMatrix(rows, columns), _unwrap(one)
            packed = _cpp.fem.pack_constants(one), _cpp.fem.pack_coefficients(one)
            _cpp.fem.petsc.assemble_matrix(part, one, *packed, bcs, True)
            A.restoreLocalSubMatrix(rows, columns, part)
    for one in sets:
        one.destroy()
    # PETSc refuses to mix adding and inserting without a flush between them.
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)
    for row in fixed:
        A.setValue(row, row, 1.0, PETSc.InsertMode.INSERT_VALUES)
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)


# Solver


def destroy_garbage(comm: MPI.Comm) -> None:
    """Free the PETSc objects that no Python variable of any rank names. Collective.

    From petsc4py 3.18 on they are only put aside, as ranks may drop them at different
    times, and a solver's functions keep all that they refer to.
    """
    clean = getattr(PETSc, "garbage_cleanup", None)
    if clean is not None and not PETSc.Sys.isFinalized():
        clean(comm)


def newton_solver_class() -> type | None:
    """C++ Newton solver of DOLFINx; ``None`` where it has been removed."""
    return getattr(_cpp.nls.petsc, "NewtonSolver", None)


def make_newton_solver(comm: MPI.Comm) -> Any:
    """DOLFINx's C++ Newton solver, the same interface in all versions.

    It has ``setF(fn(x, b), b)``, ``setJ(fn(x, A), A)``, ``set_form(fn(x))``,
    ``set_update(fn(solver, dx, x))``, ``krylov_solver``, ``rtol``, ``atol``,
    ``max_it``, ``convergence_criterion`` (``"residual"`` or ``"incremental"``),
    ``relaxation_parameter``, ``report``, ``error_on_nonconvergence`` and
    ``solve(x) -> (iterations, converged)`` on ``PETSc.Vec``.

    Raises
    ------
    NotImplementedError
        If this DOLFINx no longer has it.
    """
    solver_class = newton_solver_class()
    if solver_class is None:
        raise NotImplementedError(
            f"DOLFINx {dolfinx.__version__} has no Newton solver: use SNES"
        )
    return solver_class(comm)


# Output


def of_degree(function: fem.Function, degree: int) -> fem.Function:
    """The function, interpolated to continuous Lagrange of a degree if it is not that."""
    V = function.function_space
    info = element_info(V)
    if info.is_lagrange and not info.is_discontinuous and info.degree == degree:
        return function
    interpolated = fem.Function(space(V.mesh, "Lagrange", degree, info.value_shape))
    interpolated.interpolate(function)
    interpolated.name = function.name
    return interpolated


def of_one_degree(functions: Sequence[fem.Function]) -> list[fem.Function]:
    """Functions interpolated to the highest degree among them, 1 at least.

    What DOLFINx's writers of VTK and VTX files ask for: one element for all. Exact for
    continuous Lagrange functions.
    """
    degrees = (element_info(f.function_space).degree for f in functions)
    degree = max(1, *degrees)
    return [of_degree(f, degree) for f in functions]


def _functions_fault(functions: Any, least: int = 0) -> str | None:
    """Why these cannot be written, if so."""
    listed = isinstance(functions, (list, tuple)) and len(functions) >= least
    if not listed or not all(isinstance(f, fem.Function) for f in functions):
        return f"functions must be a list of Functions, not {functions!r}"
    return None


def write_xdmf(
    filename: str | Path,
    mesh: dolfinx.mesh.Mesh,
    functions: Sequence[fem.Function],
    t: float = 0.0,
    append: bool = False,
) -> None:
    """Write functions on a mesh to an XDMF file for ParaView. Collective.

    XDMF holds values at the mesh's own nodes, or one per cell: functions of another
    degree are interpolated.

    Parameters
    ----------
    filename
        Path of the ``.xdmf`` file; the values go beside it (``.h5``).
    mesh
        Mesh of all functions.
    functions
        Functions with different names.
    t
        Time, or load factor.
    append
        Add a step to the file instead of starting it anew.

    Raises
    ------
    ContactError
        If the file cannot be written.
    """
    raise_everywhere(mesh.comm, _functions_fault(functions))
    mode = "a" if append else "w"
    with writing(mesh.comm, filename, RuntimeError):
        with dolfinx.io.XDMFFile(mesh.comm, str(filename), mode) as file:
            if not append:
                file.write_mesh(mesh)
            for function in functions:
                cellwise = element_info(function.function_space).degree == 0
                degree = geometry_degree(mesh)
                written = function if cellwise else of_degree(function, degree)
                file.write_function(written, t)


def write_vtk(
    filename: str | Path,
    mesh: dolfinx.mesh.Mesh,
    functions: Sequence[fem.Function],
    t: float = 0.0,
    append: bool = False,
    part: int = 0,
) -> None:
    """Write functions on a mesh to VTK files for ParaView. Collective.

    Unlike XDMF at the nodes of degree 2 too; all are interpolated to the highest degree
    among them.

    Parameters
    ----------
    filename
        Path of the ``.pvd`` file; the ``.vtu`` files of the ranks go beside it.
    mesh
        Mesh of all functions.
    functions
        Functions with different names.
    t
        Time, or load factor.
    append
        Add a step to the file instead of starting it anew.
    part
        Number among what is shown at one time, such as bodies on meshes of their own.

    Raises
    ------
    ContactError
        If the file cannot be written, or read where it is added to.
    """
    raise_everywhere(mesh.comm, _functions_fault(functions, 1))
    path = Path(filename)
    # DOLFINx would say nothing where there is no such folder
    found = path.parent.is_dir()
    problem = None if found else f"{path} cannot be written: there is no such folder"
    raise_everywhere(mesh.comm, problem)
    before: list[pvd.Entry] = []
    with together(mesh.comm):
        if append and mesh.comm.rank == 0:
            before = pvd.read(path)
    # DOLFINx begins each file anew, with files of the same names beside it
    step = mesh.comm.bcast(len(before), root=0)
    own = path.with_name(f"{path.stem}_{step:04d}_.pvd") if step else path
    with writing(mesh.comm, path, RuntimeError, OSError):
        _write_one_step(own, mesh, of_one_degree(functions), t)
        if mesh.comm.rank == 0 and (step or part):
            (entry,) = pvd.read(own)
            if own != path:
                own.unlink()
            pvd.write(path, [*before, replace(entry, part=part)])


def _write_one_step(
    path: Path, mesh: dolfinx.mesh.Mesh, functions: Sequence[fem.Function], t: float
) -> None:
    """DOLFINx's files of one step; its object writes once more when it ends, which is
    on return. Collective."""
    with dolfinx.io.VTKFile(mesh.comm, str(path), "w") as file:
        file.write_function(functions, t)
