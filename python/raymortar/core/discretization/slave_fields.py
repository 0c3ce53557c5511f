"""Fields on slave facets, as nodal values, and Functions that terms bring.

Fields are numbers, Functions or callables. A term of the equations may bring a Function
on some facets alone, or one number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..compat import Array, Indices, Mask
from ..errors import ContactError, described, is_real_number, together
from .facets import (
    FACET_SHAPE,
    N_CORNERS,
    Facets,
    coordinates,
    facet_node_table,
    facet_nodes,
    match_points,
    shape_functions,
)
from .joined import Displacement
from .ranks import keep_communicator
from .tagged import ZoneFacets
from .unknowns import Unknowns

# Number, scalar Function on the slave's mesh, or f(x) of undeformed positions
FieldValue: TypeAlias = "float | Function | Callable[[Array], Array]"


@dataclass(frozen=True)
class Quantity:
    """Meaning of a field: its name and what its values must be, for messages."""

    name: str
    demand: str
    allowed: Callable[[Array], Mask]  # whether each finite value is

    def first_fault(self, values: Array) -> float | None:
        """The first value that is not allowed; None if all are."""
        bad = values[~(np.isfinite(values) & self.allowed(values))]
        return float(bad[0]) if len(bad) else None


GAMMA = Quantity("gamma", "must be positive", lambda v: v > 0.0)
OFFSET = Quantity("offset", "must be finite", np.isfinite)
FRICTION_COEFFICIENT = Quantity(
    "friction coefficient mu", "must not be negative", lambda v: v >= 0.0
)
FRICTION_FIELD = Quantity("a field of Friction", "must be finite", np.isfinite)
FLUX_FIELD = Quantity("a field of Flux", "must be finite", np.isfinite)
FRICTION_BOUND = Quantity("friction bound", "must not be negative", lambda v: v >= 0.0)


def is_field(value: Any) -> bool:
    """Whether a value is given for every point: a Function or a callable.

    Other terms of UFL, as a Constant, can be called too, but not with points.
    """
    is_term = isinstance(value, ufl.core.expr.Expr)
    return isinstance(value, Function) or (callable(value) and not is_term)


def check_number(quantity: Quantity, value: Any) -> None:
    """Raise unless a value is a number that is allowed."""
    if not (is_real_number(value) and np.isfinite(value)):
        raise ContactError(
            f"{quantity.name} must be a finite number, a Function or a callable of "
            f"points, not {described(value)}"
        )
    if quantity.first_fault(np.array([float(value)])) is not None:
        raise ContactError(f"{quantity.name} = {value} {quantity.demand}")


def check_function(quantity: Quantity, value: Function, mesh: Any = None) -> None:
    """Raise unless a Function is scalar, and is on the slave's mesh if one is given."""
    components = compat.element_info(value.function_space).value_shape
    if components:
        raise ContactError(
            f"{quantity.name} must be a scalar Function, not one with values of shape "
            f"{components}"
        )
    if mesh is not None and not compat.on_mesh(value, mesh):
        raise ContactError(
            f"{quantity.name} is a Function on another mesh than the slave"
        )


def check_field(quantity: Quantity, value: Any, mesh: Any = None) -> None:
    """Raise unless a value is a Function that fits, a callable or an allowed number."""
    if isinstance(value, Function):
        check_function(quantity, value, mesh)
    elif not is_field(value):
        check_number(quantity, value)


def node_positions(zone: ZoneFacets) -> Array:
    """Undeformed positions of the slave facets' displacement nodes, padded with zeros,
    (facets, nodes, 3). Length."""
    surface = zone.slave_surface
    nodes = facet_nodes(surface.shape, surface.displacement_degree)
    N, _ = shape_functions(surface.shape, surface.node_degree, nodes)
    points = np.einsum("qk,fkd->fqd", N, surface.nodes)
    return np.pad(points, ((0, 0), (0, 0), (0, 3 - surface.gdim)))


def on_facets(
    quantity: Quantity, value: FieldValue, zone: ZoneFacets, comm: MPI.Comm
) -> Array:
    """Values of a field at the slave facets' displacement nodes, (facets, nodes per facet).

    Collective. A Function is evaluated cell by cell, so that a discontinuous one keeps
    its own value on each facet; a callable at all nodes at once, (3, n) to (n,).
    """
    with together(comm):
        values = _values(quantity, value, zone)
        bad = quantity.first_fault(values.ravel())
        if bad is not None:
            raise ContactError(
                f"{quantity.name} is {bad} on {zone.spoken}: it {quantity.demand}"
            )
    return values


def _values(quantity: Quantity, value: Any, zone: ZoneFacets) -> Array:
    """The values of this rank's facets."""
    points = node_positions(zone)
    shape, flat = points.shape[:2], points.reshape(-1, 3)
    if not is_field(value):
        return np.full(shape, float(value))
    if not len(flat):
        return np.empty(shape)
    if isinstance(value, Function):
        cells = np.repeat(zone.slave.cells, shape[1])
        return np.asarray(value.eval(flat, cells), dtype=np.float64).reshape(shape)
    found = np.asarray(value(flat.T.copy()))
    if found.shape not in ((len(flat),), (1, len(flat))) or np.iscomplexobj(found):
        raise ContactError(
            f"{quantity.name} returns values of type {found.dtype} and shape "
            f"{found.shape} for points of shape (3, {len(flat)}): they must be real, of "
            f"shape ({len(flat)},)"
        )
    return found.astype(np.float64).reshape(shape)


def function_on_facets(V: FunctionSpace, facets: Facets, name: str) -> Any:
    """Make a Function of a space's element on facets alone. Collective.

    Its mesh is that of the facets, straight, so it has no other dofs.

    Returns
    -------
    f, table
        The Function, and its local block dofs on each of the facets, in the order of
        `facet_dof_table`, (facets, n).
    """
    info, mesh, comm = compat.element_info(V), V.mesh, V.mesh.comm
    shape = FACET_SHAPE[compat.cell_name(mesh)]
    corners = facet_node_table(mesh, facets)[:, : N_CORNERS[shape]]
    numbers, x = compat.geometry_nodes_global(mesh)[corners], coordinates(mesh)[corners]
    # Corners in the order of Basix
    vertices = compat.basix_element(shape, 1).points
    order = match_points(facet_nodes(shape, 1), vertices)
    surface = _gathered_mesh(comm, numbers[:, order], x[:, order], shape)
    space = compat.space(surface, "Lagrange", info.degree, info.value_shape)
    f = Function(space, name=name)
    N, _ = shape_functions(shape, 1, facet_nodes(shape, info.degree))
    nodes = np.einsum("an,fnd->fad", N, x)
    return f, _dofs_at(f, np.pad(nodes, ((0, 0), (0, 0), (0, 3 - x.shape[2]))))


def _gathered_mesh(comm: MPI.Comm, cells: Any, x: Array, cell: str) -> Any:
    """Mesh of cells with global numbers of their corners, which stay on their ranks.
    Collective."""
    gathered = comm.gather((cells, x), root=0)
    points, ranks = np.empty((0, x.shape[2])), np.empty(0, dtype=np.int32)
    table = np.empty((0, cells.shape[1]), dtype=np.int64)
    if gathered is not None:
        ranks = np.repeat(np.arange(comm.size), [len(one) for one, _ in gathered])
        every = np.concatenate([one for one, _ in gathered])
        _, first, table = np.unique(every, return_index=True, return_inverse=True)
        points = np.concatenate([one for _, one in gathered]).reshape(-1, x.shape[2])
        points, table = points[first], table.reshape(every.shape)
    mesh = compat.create_mesh(comm, table, points, cell, destinations=ranks)
    keep_communicator(mesh)
    return mesh


def _dofs_at(f: Function, x: Array) -> Indices:
    """Find a Function's local block dofs at their positions (..., 3)."""
    if x.size == 0:
        return np.empty(x.shape[:-1], dtype=np.int32)
    from scipy.spatial import cKDTree

    nodes = f.function_space.tabulate_dof_coordinates()
    _, found = cKDTree(nodes).query(x)
    return np.asarray(found, dtype=np.int32)


def single_number(comm: MPI.Comm, name: str) -> Function:
    """Make a Function with one dof in all, on the first rank. Collective."""
    here = int(comm.rank == 0)
    cells, x = np.arange(2)[None][:here], np.arange(2.0)[None, :, None][:here]
    mesh = _gathered_mesh(comm, cells, x, "interval")
    return Function(compat.space(mesh, "DG", 0), name=name)


def find_fields(fields: Sequence[Displacement], unknowns: Unknowns, owner: str) -> None:
    """Note which unknown each field is, or is a part of; raise if it is none."""
    for one in fields:
        place = one.place_among(unknowns.functions)
        if place is None:
            names = ", ".join(f.name for f in unknowns.functions)
            raise ContactError(
                f"the field {one.given.name} that {owner} was given is none of the "
                f"unknowns [{names}], nor a part of one: give the problem its equation "
                "too, F and u as lists"
            )
        one.at = place
