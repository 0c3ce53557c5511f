"""Arrays on slave facets, as tables of a checkpoint that no partition changes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import versions
from ..core import compat
from ..core.compat import Array
from ..core.discretization.facets import FACETS_PER_CELL, facet_nodes, shape_functions
from ..core.discretization.joined import parts_of, places_of
from ..core.interface.zone_data import SpringPoints, ZoneData
from ..core.state import Quantity
from .tables import Rows, Table


@dataclass(frozen=True)
class _Slots:
    """Slave facets of this rank by numbers that no partition changes."""

    surface: Any
    number: Rows  # of each facet, (facets,)
    dofs: Any  # its dofs among those of its cell, (facets, n)
    size: int  # dofs of a cell

    def among(self, numbers: Rows) -> tuple[Any, Any]:
        """Tell which rows of a table are of facets of this rank, and which facets."""
        order = np.argsort(self.number)
        place = np.searchsorted(self.number, numbers, sorter=order)
        mine = np.isin(numbers, self.number)
        return mine, order[place[mine]]

    def row(self, of: Any) -> Array:
        """Values at the dofs of the cell, 0 off the facet, of those of facets."""
        values = np.zeros((len(of), self.size, *of.shape[2:]))
        values[np.arange(len(of))[:, None], self.dofs] = of
        # A rank may have no facets, of which -1 finds no number of columns
        return values.reshape(len(of), math.prod(values.shape[1:]))


def is_by_facet(one: Quantity) -> bool:
    """Whether an array has its rows on slave facets."""
    return isinstance(one.by, (ZoneData, SpringPoints))


def written(u: Any, quantities: Iterable[Quantity]) -> Iterator[Table]:
    """Yield the tables of arrays on facets of a displacement. Collective."""
    for one in filter(is_by_facet, quantities):
        held, comm = one.read(), _zone(one).comm
        if comm.allreduce(held is not None) == 0:
            continue
        slots = _slots(u, _zone(one))
        rows = _of_points if isinstance(one.by, SpringPoints) else _of_nodes
        table = rows(slots, held)
        first = sum(comm.allgather(len(table))[: comm.rank])
        numbers = np.arange(len(table)) + first
        yield Table(one.name, comm.allreduce(len(table)), numbers, table)


def found(
    u: Any, quantities: Iterable[Quantity], tables: Mapping[str, Array]
) -> Iterator[tuple[str, Array | None]]:
    """Yield the name of each array that a file has, and the array on this rank: None if
    the file has other facets."""
    for one in filter(is_by_facet, quantities):
        rows = tables.get(one.name)
        if rows is None:
            continue
        slots = _slots(u, _zone(one))
        mine, facet = slots.among(rows[:, 0].astype(np.int64))
        if isinstance(one.by, SpringPoints):
            yield one.name, _points(slots, facet, rows[mine, 1:])
        elif len(np.unique(facet)) < len(slots.number):
            yield one.name, None
        else:
            d = slots.surface.gdim
            values = np.empty((len(facet), slots.size, d))
            values[facet] = rows[mine, 1:].reshape(values.shape)
            yield one.name, np.take_along_axis(values, slots.dofs[:, :, None], axis=1)


def _zone(one: Quantity) -> Any:
    return one.by.zone if isinstance(one.by, SpringPoints) else one.by


def _slots(u: Any, zone: Any) -> _Slots:
    facets, surface = zone.facets.slave, zone.facets.slave_surface
    part = zone.facets.slave_part
    V, places = parts_of(u)[part].function_space, places_of(u, part)
    dofs = compat.dofmap_array(V)[facets.cells]
    dofs = dofs if places is None else places[dofs]
    own = surface.dofs[surface.facet_dofs]
    slots = (own[:, :, None] == dofs[:, None, :]).argmax(axis=2)
    cells = versions.cells_as_given(V.mesh)[facets.cells]
    number = cells * FACETS_PER_CELL + facets.local_facets
    return _Slots(surface, number, slots, dofs.shape[1])


def _of_nodes(slots: _Slots, held: Array | None) -> Array:
    """Number of each facet, and vectors at the dofs of its cell, 0 off the facet."""
    if held is None:
        held = np.zeros((*slots.dofs.shape, slots.surface.gdim))
    return np.column_stack([slots.number, slots.row(held)])


def _of_points(slots: _Slots, rows: Array | None) -> Array:
    """Number of the facet of each point, shape functions there of the dofs of its cell,
    reference coordinates, area and vector."""
    surface, d = slots.surface, slots.surface.gdim
    if rows is None:
        rows = np.zeros((0, 2 * d + 1))
    facet = rows[:, 0].astype(np.int64)
    N, _ = shape_functions(surface.shape, surface.displacement_degree, rows[:, 1:d])
    shares = np.zeros((len(rows), slots.size))
    shares[np.arange(len(rows))[:, None], slots.dofs[facet]] = N
    return np.column_stack([slots.number[facet], shares, rows[:, 1:]])


def _points(slots: _Slots, facet: Any, rows: Array) -> Array:
    """Rows of points as contact has them, by facet."""
    surface, end = slots.surface, slots.size + slots.surface.gdim - 1
    N = np.take_along_axis(rows[:, : slots.size], slots.dofs[facet], axis=1)
    degree, xi = surface.displacement_degree, rows[:, slots.size : end]
    same = N == shape_functions(surface.shape, degree, xi)[0]
    # Another partition may have the corners in another order
    places = N @ facet_nodes(surface.shape, degree)
    xi = np.where(same.all(axis=1)[:, None], xi, places)
    points = np.column_stack([facet, xi, rows[:, end:]])
    return points[np.argsort(facet, kind="stable")]
