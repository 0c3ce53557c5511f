"""A scalar field on the facets of a zone: its nodes, values and rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from .. import _cpp
from ..core import compat
from ..core.compat import Array, Indices
from ..core.discretization.facets import (
    Facets,
    Global,
    facet_dof_table,
    shape_functions,
)
from ..core.discretization.joined import Displacement, parts_of
from ..core.discretization.unknowns import Unknowns
from ..core.errors import ContactError
from ..core.interface.zone_data import ZoneData

# Shares of the work of friction, by the time, that slave and target take
Heat = tuple[float, float]
NO_HEAT = 0.0, 0.0


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

    def __post_init__(self) -> None:
        info = compat.element_info(self.of.u.function_space)
        # Components and degree of the field
        self.block, self.degree = info.block_size, info.degree

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
        return self.on_facets(self.of.given.x.array[self.of.dofs])


class FixedPoints(NamedTuple):
    """Points whose places on both sides stay: what of them never changes."""

    number: Indices  # index among all points, (n,)
    facet: Indices  # slave facets, (n,)
    master: Indices  # facets of the master that are here, (n,)
    xi: Array
    weight: Array  # area
    N: list[Array]  # shape functions of the field on each side, (n, nodes)

    @property
    def jump(self) -> Array:
        """Shape functions of the field's jump, (n, nodes)."""
        return np.concatenate([self.N[0], *(-N for N in self.N[1:])], axis=1)


class FieldOnZone:
    """A scalar field on both sides of a zone. Collective."""

    def __init__(
        self, zone: ZoneData, u: Any, fields: list[Displacement], tool: float
    ) -> None:
        self.zone, self.tool = zone, tool
        facets = zone.facets
        self.slave = _side(u, fields, facets.slave_part, facets.slave)
        self.master: FieldSide | None = None
        if not facets.bodies:
            self.master = _side(u, fields, facets.master_part, facets.master)
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

    def residual(self, fields: Any, q: Array, heat: Heat = NO_HEAT) -> tuple[Any, ...]:
        """Rows and values of the residual, given the flux and the shares of the work of
        friction that both sides take, by the time."""
        return _cpp.flux_residual(self.zone.cpp, fields, q, *heat)

    def tangent(
        self, fields: Any, q: Array, heat: Heat, slopes: Array, along: Array
    ) -> tuple[Any, ...]:
        """Rows, columns and values of the tangent, given the flux's derivatives too."""
        if not self.moves:
            number = self.points(fields)["point"]
            return self.fixed_tangent(self.fixed_points(number, "weight"), slopes)
        return _cpp.flux_tangent(self.zone.cpp, fields, q, *heat, slopes, along)

    # Points that stay

    def fixed_points(self, number: Any, weight: str) -> FixedPoints:
        """Take some of the points, with an array of their areas by its name."""
        points = self.zone.cpp.points()
        sides = zip(self.zone.sides, (self.slave, self.master), ("xi", "eta"))
        N = [
            shape_functions(surface.shape, side.degree, points[at][number])[0]
            for surface, side, at in sides
            if side is not None
        ]
        names = "slave", "master", "xi", weight
        facet, master, xi, area = (points[name][number] for name in names)
        return FixedPoints(number, facet, master, xi, area, N)

    def rows_at(self, at: FixedPoints) -> Any:
        """Rows of the field's nodes at points, (n, nodes). Collective."""
        rows = [self.slave_rows.reshape(-1, self.slave.width)[at.facet]]
        if self.master is not None:
            of_master = self.master_rows.reshape(-1, self.master.width)
            rows.append(of_master[at.master])
        return np.concatenate(rows, axis=1)

    def fixed_tangent(self, at: FixedPoints, slopes: Array) -> tuple[Any, Any, Array]:
        """Rows, columns and values, given the flux's derivatives by the field, (n, 2)
        or more."""
        by_field = [slopes[:, k : k + 1] * N for k, N in enumerate(at.N)]
        by_all, all_rows = np.concatenate(by_field, axis=1), self.rows_at(at)
        values = np.einsum("q,qa,qb->qab", at.weight, at.jump, by_all)
        columns = np.broadcast_to(all_rows[:, None, :], values.shape)
        rows = np.broadcast_to(all_rows[:, :, None], values.shape)
        return rows.ravel(), columns.ravel(), values.ravel()

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


class TiedField(FieldOnZone):
    """A scalar field on both sides of a tie. Collective."""

    master: FieldSide  # a tie has no rigid tools

    @cached_property
    def fixed(self) -> FixedPoints:
        """Points of the tie with a master, which it finds once."""
        number = np.flatnonzero(self.zone.cpp.points()["status"] > 0)
        return self.fixed_points(number.astype(np.int32), "area")

    def present(self) -> Any:
        """Values at the points on both sides, (n,) each. Collective."""
        at, width = self.fixed, self.master.width
        own = self.master.values.ravel()
        fetched = _cpp.to_master_facets(self.zone.cpp, own, width).reshape(-1, width)
        nodal = self.slave.values[at.facet], fetched[at.master]
        return tuple(np.einsum("qa,qa->q", *pair) for pair in zip(at.N, nodal))

    def points(self, fields: Any) -> dict[str, Array]:
        """Arguments of a law: pressure, gap and slip are zero."""
        at, none = self.fixed, np.zeros(len(self.fixed.number))
        found: dict[str, Any]
        found = {"point": at.number, "facet": at.facet, "xi": at.xi}
        found |= {"slave": fields[0], "target": fields[1], "weight": at.weight}
        return found | dict.fromkeys(("pressure", "gap", "slip", "work"), none)

    def residual(self, fields: Any, q: Array, heat: Heat = NO_HEAT) -> tuple[Any, ...]:
        """Rows and values, see `_cpp.flux_residual`."""
        at = self.fixed
        values = (at.weight * q)[:, None] * at.jump
        return self.rows_at(at).ravel(), values.ravel()

    def tangent(
        self, fields: Any, q: Array, heat: Heat, slopes: Array, along: Array
    ) -> tuple[Any, ...]:
        """Rows, columns and values, see `_cpp.flux_tangent`."""
        return self.fixed_tangent(self.fixed, slopes)


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
