"""Checks of meshes, displacements and tagged facets. All are collective."""

from __future__ import annotations

import numpy as np
from dolfinx.fem import Function, FunctionSpace
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices
from ..errors import ContactError, raise_everywhere, together
from .facets import (
    FACETS_PER_CELL,
    Facets,
    cell_corners,
    coordinates,
    facet_corners,
    facet_ids,
    format_point,
    midpoints,
    node_table,
)
from .ranks import count_marks
from .reference_facets import FACET_SHAPE, normals
from .surfaces import facet_areas

# A facet narrower than this fraction of its cell has no usable normal.
MIN_RELATIVE_WIDTH = 1e-12
# A cell thinner than this fraction of its edges has no volume.
MIN_RELATIVE_VOLUME = 1e-12
# A volume element of the other sign counts as zero below this share of the largest one:
# three vertices on a line give a zero with a rounding error.
MAX_FOLD = 1e-8


def _mesh_fault(mesh: Mesh) -> str | None:
    """A message on a mesh that cannot be used; None if it can."""
    gdim, cell = mesh.geometry.dim, compat.cell_name(mesh)
    if gdim not in (2, 3):
        return f"the mesh is in a space of dimension {gdim}; contact needs 2 or 3"
    if mesh.topology.dim != gdim:
        return (
            f"cells of dimension {mesh.topology.dim} in a space of dimension {gdim}: "
            "shells, membranes and beams are not supported"
        )
    if cell not in FACET_SHAPE:
        return (
            f"the mesh has {cell} cells; supported are meshes of one of "
            f"{', '.join(FACET_SHAPE)}"
        )
    if compat.geometry_degree(mesh) > 2:
        return (
            f"the geometry of the mesh has degree {compat.geometry_degree(mesh)}; "
            "supported are 1 and 2"
        )
    return None


def _element_fault(V: FunctionSpace) -> str | None:
    """A message on an element that cannot be used; None if it can."""
    info, gdim = compat.element_info(V), V.mesh.geometry.dim
    if info.is_sub_space:
        return (
            "the displacement is a view into a larger space; contact needs a Function "
            "on a space of its own (collapse the sub-space)"
        )
    if info.is_mixed:
        return (
            "the displacement's element is mixed or holds values at quadrature points; "
            "contact needs a plain Lagrange one"
        )
    if not info.is_lagrange:
        return "the displacement's element is not a Lagrange element"
    if info.is_discontinuous:
        return "the displacement's element is discontinuous"
    if info.value_shape != (gdim,) or info.block_size != gdim:
        return (
            f"the displacement has values of shape {info.value_shape}; contact needs "
            f"vectors of shape {(gdim,)}"
        )
    if info.degree not in (1, 2):
        return f"the displacement has degree {info.degree}; supported are 1 and 2"
    return None


def _value_fault(u: Function) -> str | None:
    """A message on values of this rank that are not finite; None if all are."""
    values = u.x.array
    if not compat.scalar_type_is_real() or values.dtype != np.float64:
        kind = values.dtype if compat.scalar_type_is_real() else "complex PETSc"
        return f"contact needs real numbers in double precision, not {kind}"
    count = int(np.sum(~np.isfinite(values)))
    return f"the displacement has {count} value(s) not finite" if count > 0 else None


def check_space(u: Function) -> None:
    """Refuse displacements that raymortar cannot handle. Collective."""
    V = u.function_space
    message = _mesh_fault(V.mesh) or _element_fault(V) or _value_fault(u)
    raise_everywhere(V.mesh.comm, message)


def _facet_vertices(mesh: Mesh, facets: Facets) -> Indices:
    """Local topology vertices of facets, shape (n_facets, n). Collective."""
    element = compat.basix_element(compat.cell_name(mesh), 1)
    columns = np.array(element.facet_vertices)[facets.local_facets]
    to_vertices = compat.connectivity_table(mesh, mesh.topology.dim, 0)
    return to_vertices[facets.cells[:, None], columns]


def check_pair(mesh: Mesh, slave: Facets, master: Facets) -> None:
    """Refuse a slave and a master surface that share vertices in the mesh. Collective."""
    vertices, vertex_map = _facet_vertices(mesh, slave), mesh.topology.index_map(0)
    # The two surfaces may sit on different ranks
    shared = count_marks(vertex_map, vertices) > 0
    shared &= count_marks(vertex_map, _facet_vertices(mesh, master)) > 0
    count = mesh.comm.allreduce(int(shared[: vertex_map.size_local].sum()))
    with together(mesh.comm):
        if np.any(shared[vertices]):
            # In Basix's order of the facet's vertices too
            example = facet_corners(mesh, slave)[shared[vertices]][0]
            raise ContactError(
                f"the slave surface (tag {slave.tag}) and the master surface (tag "
                f"{master.tag}) share {count} vertex(es), for example at "
                f"{format_point(example)}: they must be apart in the mesh. Give bodies "
                "nodes of their own; on one body leave out of a tag the facets between "
                "the surfaces"
            )


def _extent(points: Array) -> Array:
    """Diagonal of the bounding box of each set of points (n, n_points, d)."""
    return np.linalg.norm(points.max(axis=1) - points.min(axis=1), axis=-1)


def check_areas(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets without area, or at coordinates that are not finite. Collective.

    The width of a facet (its length in 2D, else its area over its diameter) is
    compared with the diameter of its cell: an edge is never short against itself.
    """
    degree, shape = compat.geometry_degree(mesh), FACET_SHAPE[compat.cell_name(mesh)]
    area = facet_areas(shape, degree, coordinates(mesh)[node_table(mesh, facets)])
    smallest = MIN_RELATIVE_WIDTH * _extent(cell_corners(mesh, facets))
    if mesh.geometry.dim == 3:
        smallest = smallest * _extent(facet_corners(mesh, facets))
    finite = np.isfinite(area) & np.isfinite(smallest)
    # Written so that NaN is bad.
    bad = np.flatnonzero(~((area > smallest) & np.isfinite(area)))
    with together(mesh.comm):
        if len(bad) > 0:
            fault = "no area" if finite[bad[0]] else "coordinates not finite"
            raise ContactError(
                f"{len(bad)} facet(s) with tag {facets.tag} have {fault}, the first on "
                f"{_where(mesh, facets, bad[0])}"
            )


def _where(mesh: Mesh, facets: Facets, k: int) -> str:
    """Name the cell and the midpoint of a facet."""
    cell = facet_ids(mesh, facets)[k] // FACETS_PER_CELL
    return f"cell {cell} at {format_point(midpoints(mesh, facets)[k])}"


def _cell_jacobians(mesh: Mesh, cells: Indices) -> tuple[Array, Array]:
    """Determinants of the Jacobian at the nodes of cells, (n_cells, n), and bounds.

    The bound is the product of the columns' lengths: the determinant has it if they are
    orthogonal.
    """
    element = compat.basix_element(compat.cell_name(mesh), compat.geometry_degree(mesh))
    X = coordinates(mesh)[compat.geometry_dofmap(mesh)[cells]]
    with np.errstate(invalid="ignore"):  # the result shows what is not finite
        columns = np.array([gradients @ X for gradients in element.gradients])
        # The last column along the normal of the others
        determinant = np.sum(normals(columns[:-1]) * columns[-1], axis=-1)
        return determinant, np.prod(np.linalg.norm(columns, axis=-1), axis=0)


def check_cells(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets of cells that are folded or have no volume. Collective.

    The volume element may have either sign, which depends on the numbering of the
    cell's vertices, but one sign within a cell. It is checked at the nodes. It may
    vanish at some of them: at a vertex with an angle of 180 degrees, or at a node moved
    to the quarter of an edge.
    """
    determinant, bound = _cell_jacobians(mesh, facets.cells)
    size = np.abs(determinant).max(axis=1)
    fold = np.minimum(determinant.max(axis=1), -determinant.min(axis=1))
    faults = {
        "coordinates not finite": ~np.isfinite(size),
        "no volume": size <= MIN_RELATIVE_VOLUME * bound.max(axis=1),
        "a fold: their Jacobian changes sign": fold > MAX_FOLD * size,
    }
    with together(mesh.comm):
        for fault, bad in faults.items():
            if bad.any():
                raise ContactError(
                    f"{int(bad.sum())} facet(s) with tag {facets.tag} are on cells with "
                    f"{fault}, the first on "
                    f"{_where(mesh, facets, int(bad.argmax()))}"
                )
