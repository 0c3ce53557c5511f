"""Checks of meshes, displacements, tagged facets and solids of revolution.

All are collective. A solid of revolution has coordinates (r, z) of a half plane, about
the axis r = 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx.fem import Function, FunctionSpace
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices, Mask
from ..errors import ContactError, format_point, raise_everywhere, together
from . import facets as lookup
from .facets import FACET_SHAPE, FACETS_PER_CELL, Facets, coordinates, normals
from .ranks import count_marks, sums_at
from .surfaces import facet_areas

# A facet narrower than this fraction of its cell has no usable normal.
MIN_RELATIVE_WIDTH = 1e-12
# A cell thinner than this fraction of its edges has no volume.
MIN_RELATIVE_VOLUME = 1e-12
# A volume element of the other sign counts as zero below this share of the largest one:
# three vertices on a line give a zero with a rounding error.
MAX_FOLD = 1e-8
# Least cosine between the mean normals of the two faces of a crack at its tip: 10 degrees
CRACK = 0.985
# A radius below this share of the mesh's size counts as zero
ON_AXIS = 1e-12


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
        known = ", ".join(FACET_SHAPE)
        return f"the mesh has {cell} cells; supported are meshes of one of {known}"
    degree = compat.geometry_degree(mesh)
    if degree > 2:
        return f"the geometry of the mesh has degree {degree}; supported are 1 and 2"
    return None


def element_fault(V: FunctionSpace, shape: Any = None, needed: str = "") -> str | None:
    """Return what is wrong with the element of a field, None if nothing is.

    It must be continuous Lagrange of degree 1 or 2. Its values must have the shape, if
    one is given; the message says what needs it.
    """
    info = compat.element_info(V)
    faults = {
        "is mixed or holds values at quadrature points: give the part that is meant, as "
        "w.sub(1)": info.is_mixed,
        f"is of {V.ufl_element()}, not a Lagrange element": not info.is_lagrange,
        "is discontinuous: it must be a continuous Lagrange Function": (
            info.is_discontinuous
        ),
        f"has values of shape {info.value_shape}; {needed}": (
            shape is not None and info.value_shape != shape
        ),
        f"has degree {info.degree}; supported are 1 and 2": info.degree not in (1, 2),
    }
    return next((text for text, is_bad in faults.items() if is_bad), None)


def check_fields(name: str, fields: Any, shape: Any = None, needed: str = "") -> None:
    """Raise unless an argument has Functions of elements that are supported, or parts
    of mixed ones that are. Collective."""
    for f in fields:
        if not isinstance(f, Function):
            raise ContactError(f"{name} must be a Function, not {type(f).__name__}")
        V = f.function_space
        if compat.element_info(V).is_sub_space:
            V, _ = compat.collapsed(V)
        fault = element_fault(V, shape, needed)
        if fault is not None:
            raise ContactError(f"{name}, {f.name}, {fault}")


def _value_fault(u: Function) -> str | None:
    """A message on values of this rank that are not finite; None if all are."""
    values = u.x.array
    if not compat.scalar_type_is_real() or values.dtype != np.float64:
        kind = values.dtype if compat.scalar_type_is_real() else "complex PETSc"
        return f"contact needs real numbers in double precision, not {kind}"
    count = int(np.sum(~np.isfinite(values)))
    return f"the displacement has {count} value(s) not finite" if count > 0 else None


def check_space(u: Function) -> None:
    """Refuse displacements that raymortar cannot handle."""
    V = u.function_space
    shape, message = (V.mesh.geometry.dim,), _mesh_fault(V.mesh)
    if compat.element_info(V).is_sub_space:
        message = (
            message or "the displacement is a view into a larger space: collapse it"
        )
    fault = element_fault(V, shape, f"contact needs vectors of shape {shape}")
    message = message or (f"the displacement {fault}" if fault else _value_fault(u))
    raise_everywhere(V.mesh.comm, message)


def _vertices(mesh: Mesh, facets: Facets) -> Indices:
    """Local vertices of facets, in Basix's order, (facets, vertices)."""
    element = compat.basix_element(compat.cell_name(mesh), 1)
    to_vertices = compat.connectivity_table(mesh, mesh.topology.dim, 0)
    of_facets = np.array(element.facet_vertices)
    found: Indices = to_vertices[facets.cells[:, None], of_facets[facets.local_facets]]
    return found


def shared_vertices(mesh: Mesh, slave: Facets, master: Facets) -> tuple[int, Mask]:
    """Count the vertices that two surfaces share in the mesh. Collective.

    Also mark those of this rank's slave facets, (facets, vertices), in Basix's order.
    """
    vertices, others = (_vertices(mesh, one) for one in (slave, master))
    vertex_map = mesh.topology.index_map(0)
    # The two surfaces may sit on different ranks
    shared = count_marks(vertex_map, vertices) * count_marks(vertex_map, others) > 0
    count = mesh.comm.allreduce(int(shared[: vertex_map.size_local].sum()))
    return count, shared[vertices]


def _face_each_other(mesh: Mesh, slave: Facets, master: Facets) -> Mask:
    """Whether the facets of two surfaces around a vertex of each slave facet look at each
    other, as the faces of a crack do at its tip, (facets, vertices). Collective."""
    vertex_map, d = mesh.topology.index_map(0), mesh.geometry.dim
    means = []
    for one in (slave, master):
        shape = FACET_SHAPE[compat.cell_name(mesh)]
        n = lookup.middle_normals(shape, 1, lookup.facet_corners(mesh, one))
        n = n / np.linalg.norm(n, axis=1, keepdims=True)
        n[lookup.points_inward(mesh, one)] *= -1.0
        vertices = _vertices(mesh, one)
        means.append(sums_at(vertex_map, d, (vertices, n[:, None])))
    cosine = np.einsum("vd,vd->v", *means)
    sizes = np.prod([np.linalg.norm(one, axis=1) for one in means], axis=0)
    found: Mask = (cosine < -CRACK * sizes)[_vertices(mesh, slave)]
    return found


def check_pair(
    mesh: Mesh, slave: Facets, master: Facets, may_be_crack: bool = False
) -> bool:
    """Refuse a slave and a master surface that share vertices in the mesh, other than as
    faces of a crack share its tip; return whether they do so. Collective."""
    count, marks = shared_vertices(mesh, slave, master)
    if count and may_be_crack:
        marks &= ~_face_each_other(mesh, slave, master)
    with together(mesh.comm):
        if np.any(marks):
            # In Basix's order of the facet's vertices too
            example = lookup.facet_corners(mesh, slave)[marks][0]
            slave_tag, master_tag = (
                f"({one.spoken})" if one.name is None else one.spoken
                for one in (slave, master)
            )
            raise ContactError(
                f"the slave surface {slave_tag} and the master surface {master_tag} "
                f"share {count} vertex(es), for example at "
                f"{format_point(example, coordinates(mesh))}: they must be apart in "
                "the mesh. Give bodies nodes of their own; on one body leave out of a tag "
                "the facets between the surfaces, or take method=Penalty()"
            )
    return count > 0


def _extent(points: Array) -> Array:
    """Diagonal of the bounding box of each set of points (n, n_points, d)."""
    return np.linalg.norm(np.ptp(points, axis=1), axis=-1)


def check_areas(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets without area, or at coordinates that are not finite.

    The width of a facet (its length in 2D, else its area over its diameter) is
    compared with the diameter of its cell: an edge is never short against itself.
    """
    degree, shape = compat.geometry_degree(mesh), FACET_SHAPE[compat.cell_name(mesh)]
    nodes = coordinates(mesh)[lookup.node_table(mesh, facets)]
    area = facet_areas(shape, degree, nodes)
    smallest = MIN_RELATIVE_WIDTH * _extent(lookup.cell_corners(mesh, facets))
    if mesh.geometry.dim == 3:
        smallest = smallest * _extent(lookup.facet_corners(mesh, facets))
    finite = np.isfinite(area) & np.isfinite(smallest)
    # Written so that NaN is bad
    small = finite & ~(area > smallest)
    faults = {"have coordinates not finite": ~finite, "have no area": small}
    _refuse(mesh, facets, faults)


def _refuse(mesh: Mesh, facets: Facets, faults: dict[str, Mask]) -> None:
    """Raise for the first fault that some facets have, with the place of one."""
    with together(mesh.comm):
        for fault, bad in faults.items():
            if bad.any():
                k = int(bad.argmax())
                at = lookup.midpoints(mesh, facets)[k]
                cell = lookup.facet_ids(mesh, facets)[k] // FACETS_PER_CELL
                raise ContactError(
                    f"{int(bad.sum())} facet(s) with {facets.spoken} {fault}, the first "
                    f"on cell {cell} at {format_point(at, coordinates(mesh))}"
                )


def check_cells(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets of cells that are folded or have no volume.

    The volume element may have either sign, which depends on the numbering of the
    cell's vertices, but one sign within a cell. It is checked at the nodes. It may
    vanish at some of them: at a vertex with an angle of 180 degrees, or at a node moved
    to the quarter of an edge.
    """
    element = compat.basix_element(compat.cell_name(mesh), compat.geometry_degree(mesh))
    X = coordinates(mesh)[compat.geometry_dofmap(mesh)[facets.cells]]
    with np.errstate(invalid="ignore"):  # the result shows what is not finite
        columns = np.array([gradients @ X for gradients in element.gradients])
        # The last column along the normal of the others
        determinant = np.sum(normals(columns[:-1]) * columns[-1], axis=-1)
        # The determinant is as large if the columns are orthogonal
        bound = np.prod(np.linalg.norm(columns, axis=-1), axis=0)
    size = np.abs(determinant).max(axis=1)
    fold = np.minimum(determinant.max(axis=1), -determinant.min(axis=1))
    faults = {
        "coordinates not finite": ~np.isfinite(size),
        "no volume": size <= MIN_RELATIVE_VOLUME * bound.max(axis=1),
        "a fold: their Jacobian changes sign": fold > MAX_FOLD * size,
    }
    _refuse(mesh, facets, {f"are on cells with {k}": bad for k, bad in faults.items()})


# Solids of revolution


def weight(mesh: Mesh) -> Any:
    """2 pi r of the undeformed mesh, for UFL forms. Length."""
    return 2.0 * np.pi * ufl.SpatialCoordinate(mesh)[0]


def size_of(X: Array) -> float:
    """Largest magnitude of a coordinate on this rank."""
    return float(np.abs(X).max(initial=0.0))


def on_axis(mesh: Mesh, facets: Facets) -> tuple[Mask, Array]:
    """Find the facets on the axis, and the nodes of all."""
    X = coordinates(mesh)
    nodes = X[lookup.node_table(mesh, facets)]
    return (nodes[:, :, 0] <= ON_AXIS * size_of(X)).all(axis=1), nodes


def off_axis(mesh: Mesh, facets: Facets) -> Facets:
    """Leave out facets on the axis."""
    return facets.some(~on_axis(mesh, facets)[0])
