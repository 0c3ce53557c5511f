"""A scalar field on the facets of a zone: its nodes, values and rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import _cpp, compat
from ..compat import Array, Indices
from ..discretization.facets import Facets, Global, facet_dof_table
from ..discretization.joined import Displacement, parts_of
from ..discretization.reference_facets import shape_functions
from .zone_data import ZoneData


@dataclass
class FieldSide:
    """The field on the facets of one side, which are this rank's.

    Attributes
    ----------
    of
        The field on the mesh of this side.
    table
        Its local block dofs on each facet, turned outward, (facets, n).
    """

    of: Displacement
    table: Indices

    @property
    def block(self) -> int:
        """Number of components."""
        return int(compat.element_info(self.of.u.function_space).block_size)

    @property
    def degree(self) -> int:
        """Degree of the field."""
        return int(compat.element_info(self.of.u.function_space).degree)

    @property
    def width(self) -> int:
        """Number of values on a facet."""
        return int(self.table.shape[1]) * self.block

    def on_facets(self, of_dofs: Array) -> Any:
        """Entries of an array over the local dofs, (facets, width)."""
        blocks = of_dofs.reshape(-1, self.block)
        return blocks[self.table].reshape(len(self.table), self.width)

    @property
    def values(self) -> Array:
        """Present values, (facets, width)."""
        found: Array = self.on_facets(self.of.given.x.array[self.of.dofs])
        return found


class FixedPoints(NamedTuple):
    """Points whose places on both sides stay: rows and shape functions of the field
    there, (n, nodes) of the slave and of what is hit if it has any, and area (n,)."""

    rows: list[Any]
    N: list[Array]
    weight: Array

    @property
    def jump(self) -> Array:
        """Shape functions of the field's jump, (n, nodes)."""
        return np.concatenate([self.N[0], *(-N for N in self.N[1:])], axis=1)

    @property
    def all_rows(self) -> Any:
        """Rows of all nodes, (n, nodes)."""
        return np.concatenate(self.rows, axis=1)

    def residual(self, q: Array) -> tuple[Any, Array]:
        """Rows and values of a flux from the slave to what is hit."""
        values = (self.weight * q)[:, None] * self.jump
        return self.all_rows.ravel(), values.ravel()

    def tangent(self, slopes: Array) -> tuple[Any, Any, Array]:
        """Rows, columns and values, given the flux's derivatives by the field, (n, 2)
        or more."""
        by_field = [slopes[:, k : k + 1] * N for k, N in enumerate(self.N)]
        values = np.einsum(
            "q,qa,qb->qab", self.weight, self.jump, np.concatenate(by_field, axis=1)
        )
        columns = np.broadcast_to(self.all_rows[:, None, :], values.shape)
        rows = np.broadcast_to(self.all_rows[:, :, None], values.shape)
        return rows.ravel(), columns.ravel(), values.ravel()


class FieldOnZone:
    """A scalar field on both sides of a zone. Collective.

    Parameters
    ----------
    zone
        The zone.
    u
        Displacement of the contact.
    fields
        The field on each mesh.
    tool
        Its value on rigid tools.
    """

    def __init__(
        self, zone: ZoneData, u: Any, fields: list[Displacement], tool: float
    ) -> None:
        self.zone, self.tool = zone, tool
        facets = zone.facets
        self.slave = _side(u, fields, facets.slave_part, facets.slave)
        self.master = (
            None
            if facets.bodies
            else _side(u, fields, facets.master_part, facets.master)
        )
        self.moves = True  # whether the displacement is an unknown
        self.slave_rows: Global = np.empty(0, dtype=np.int64)
        self.own_master_rows: Global = self.slave_rows
        self._master_rows: tuple[int, Global] | None = None

    def set_rows(self, rows: Global, starts: Any) -> None:
        """Take the coupled rows of all local unknowns, and the first local unknown of
        each Function."""
        found = [
            (
                np.empty(0, dtype=np.int64)
                if side is None
                else side.on_facets(rows[side.of.dofs + starts[side.of.at]]).ravel()
            )
            for side in (self.slave, self.master)
        ]
        self.slave_rows, self.own_master_rows = found
        self._master_rows = None

    @property
    def master_rows(self) -> Global:
        """Rows on the master facets that are here now. Collective."""
        builds = int(self.zone.cpp.statistics()["halo_builds"])
        if self._master_rows is None or self._master_rows[0] != builds:
            width = 0 if self.master is None else self.master.width
            fetched = _cpp.rows_of_master_facets(
                self.zone.cpp, self.own_master_rows, width
            )
            self._master_rows = builds, fetched
        return self._master_rows[1]

    def present(self) -> Any:
        """Present values and rows, for the methods below. Collective."""
        slave, master, values = self.slave, self.master, np.empty(0)
        if master is not None:
            own = master.values.ravel()
            values = _cpp.to_master_facets(self.zone.cpp, own, master.width)
        return _cpp.FluxFields(
            slave=slave.values.ravel(),
            master=values,
            slave_rows=self.slave_rows,
            master_rows=self.master_rows,
            slave_degree=slave.degree,
            master_degree=slave.degree if master is None else master.degree,
            tool=self.tool,
        )

    def points(self, fields: Any) -> dict[str, Array]:
        """Arguments of the law at the points with a hit, by name."""
        return _cpp.flux_points(self.zone.cpp, fields)

    def residual(
        self, fields: Any, q: Array, slave_heat: float, target_heat: float
    ) -> tuple[Any, ...]:
        """Rows and values of the residual, given the flux and the shares of the work of
        friction that both sides take, by the time."""
        return _cpp.flux_residual(self.zone.cpp, fields, q, slave_heat, target_heat)

    def tangent(
        self,
        fields: Any,
        q: Array,
        slave_heat: float,
        target_heat: float,
        slopes: Array,
        along: Array,
    ) -> tuple[Any, ...]:
        """Rows, columns and values of the tangent, given the flux's derivatives too."""
        if not self.moves:
            return self._points_that_stay(fields).tangent(slopes)
        return _cpp.flux_tangent(
            self.zone.cpp, fields, q, slave_heat, target_heat, slopes, along
        )

    def _points_that_stay(self, fields: Any) -> FixedPoints:
        """The points with a hit, where only the field is unknown."""
        points, (slave, master) = self.zone.cpp.points(), self.zone.sides
        number = self.points(fields)["point"]
        facet, weight = points["slave"][number], points["weight"][number]
        rows = [self.slave_rows.reshape(-1, self.slave.width)[facet]]
        N = [shape_functions(slave.shape, self.slave.degree, points["xi"][number])[0]]
        if self.master is not None:
            eta = points["eta"][number]
            N.append(shape_functions(master.shape, self.master.degree, eta)[0])
            of_master = self.master_rows.reshape(-1, self.master.width)
            rows.append(of_master[points["master"][number]])
        return FixedPoints(rows, N, weight)

    def pattern(self, number: int) -> _cpp.FieldRows:
        """The rows, for the room that a matrix needs; number is the zone's. Collective."""
        return _cpp.FieldRows(
            zone=number,
            slave=self.slave_rows,
            master=self.master_rows,
            per_slave=self.slave.width,
            per_master=0 if self.master is None else self.master.width,
        )


def _side(u: Any, fields: list[Displacement], part: int, facets: Facets) -> FieldSide:
    """Find the field on the mesh of a side, and its dofs."""
    mesh = parts_of(u)[part].function_space.mesh
    (of,) = (one for one in fields if compat.on_mesh(one.u, mesh))
    return FieldSide(of, facet_dof_table(of.u.function_space, facets))
