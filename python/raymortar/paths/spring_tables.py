"""What friction springs hold, as tables of a checkpoint that no partition changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import compat
from ..compat import Array
from ..discretization.facets import FACETS_PER_CELL, facet_nodes, shape_functions
from ..discretization.joined import parts_of, places_of
from .tables import Rows, Table


@dataclass(frozen=True)
class Springs:
    """What the springs of a zone hold, see `ZoneData`."""

    nodal: Array | None = None
    points: Array | None = None


@dataclass(frozen=True)
class _Slots:
    """Slave facets of this rank by numbers that no partition changes."""

    number: Rows  # of each facet, (facets,)
    dofs: Any  # its dofs among those of its cell, (facets, n)
    size: int  # dofs of a cell
    order: Any  # facets by their numbers

    def among(self, numbers: Rows) -> tuple[Any, Any]:
        """Tell which facets of this rank have given numbers, and whether any has."""
        place = np.searchsorted(self.number[self.order], numbers)
        has = place < len(self.order)
        facet = (
            self.order[np.minimum(place, len(self.order) - 1)] if has.any() else place
        )
        has[has] = self.number[facet[has]] == numbers[has]
        return facet, has


def _slots(contact: Any, zone: Any) -> _Slots:
    facets, surface = zone.facets.slave, zone.facets.slave_surface
    part, u = zone.facets.slave_part, contact.u
    V, places = parts_of(u)[part].function_space, places_of(u, part)
    dofs = compat.dofmap_array(V)[facets.cells]
    dofs = dofs if places is None else places[dofs]
    own = surface.dofs[surface.facet_dofs]
    slots = (own[:, :, None] == dofs[:, None, :]).argmax(axis=2)
    cells = compat.cells_as_given(V.mesh)[facets.cells]
    number = cells * FACETS_PER_CELL + facets.local_facets
    return _Slots(number, slots, dofs.shape[1], np.argsort(number))


def written(contact: Any, state: Any) -> Iterator[Table]:
    """Yield what the springs of a state hold at nodes and at points. Collective."""
    kept = [
        Springs(*one)
        for part in state.parts
        for one in zip(part.traction_old, part.spring_points)
    ]
    comm = contact.layout.comm
    for k, (zone, springs) in enumerate(zip(contact.zones, kept)):
        if comm.allreduce(springs.nodal is not None) == 0:
            continue
        slots = _slots(contact, zone)
        rows = _nodal_rows(zone, slots, springs.nodal), _rows_of_points(
            zone, slots, springs.points
        )
        for name, table in zip((f"springs {k}", f"springs {k} points"), rows):
            first = sum(comm.allgather(len(table))[: comm.rank])
            count = comm.allreduce(len(table))
            yield Table(name, count, np.arange(len(table)) + first, table)


def _nodal_rows(zone: Any, slots: _Slots, held: Array | None) -> Array:
    """Number of each facet, and vectors at the dofs of its cell, 0 off the facet."""
    count = len(slots.number)
    values = np.zeros((count, slots.size, zone.facets.slave_surface.gdim))
    if held is not None:
        values[np.arange(count)[:, None], slots.dofs] = held
    width = slots.size * values.shape[2]
    return np.column_stack([slots.number, values.reshape(count, width)])


def _rows_of_points(zone: Any, slots: _Slots, rows: Array | None) -> Array:
    """Number of the facet, shape functions of the dofs of its cell at the point, 0 off
    the facet, area and vector."""
    surface = zone.facets.slave_surface
    d = surface.gdim
    if rows is None:
        rows = np.zeros((0, 2 * d + 1))
    facet = rows[:, 0].astype(np.int64)
    shares = np.zeros((len(rows), slots.size))
    if len(rows):
        degree = surface.displacement_degree
        N, _ = shape_functions(surface.shape, degree, rows[:, 1:d])
        shares[np.arange(len(rows))[:, None], slots.dofs[facet]] = N
    return np.column_stack([slots.number[facet], shares, rows[:, d:]])


def of_other_facets(contact: Any, held: Mapping[str, Array]) -> int | None:
    """Number of a zone whose facets are not all in a file, if there is one."""
    for k, zone in enumerate(contact.zones):
        rows = held.get(f"springs {k}")
        if rows is not None:
            number = _slots(contact, zone).number
            if not np.isin(number, rows[:, 0].astype(np.int64)).all():
                return k
    return None


def found_springs(contact: Any, held: Mapping[str, Array]) -> Iterator[Springs]:
    """Yield what the springs of each zone hold on this rank, by the tables of a file."""
    for k, zone in enumerate(contact.zones):
        rows = held.get(f"springs {k}")
        if rows is None:
            yield Springs()
            continue
        slots = _slots(contact, zone)
        surface = zone.facets.slave_surface
        facet, mine = slots.among(rows[:, 0].astype(np.int64))
        values = np.zeros((len(slots.number), slots.size, surface.gdim))
        values[facet[mine]] = rows[mine, 1:].reshape(-1, *values.shape[1:])
        nodal = values[np.arange(len(values))[:, None], slots.dofs]
        yield Springs(nodal, _points(surface, slots, held[f"springs {k} points"]))


def _points(surface: Any, slots: _Slots, rows: Array) -> Array:
    facet, mine = slots.among(rows[:, 0].astype(np.int64))
    facet, rows, size = facet[mine], rows[mine], slots.size
    N = np.take_along_axis(rows[:, 1 : 1 + size], slots.dofs[facet], axis=1)
    xi = N @ facet_nodes(surface.shape, surface.displacement_degree)
    found = np.column_stack([facet, xi, rows[:, 1 + size :]])
    return found[np.argsort(facet, kind="stable")]
