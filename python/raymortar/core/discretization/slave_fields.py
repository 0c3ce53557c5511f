"""Fields on slave facets as nodal values, from numbers, Functions or callables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx.fem import Function

from .. import compat
from ..compat import Array, Mask
from ..errors import ContactError, described, is_real_number, together
from .facets import facet_nodes, shape_functions
from .tagged import ZoneFacets

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
