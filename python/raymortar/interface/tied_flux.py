"""Fluxes through a tie, whose points stay where they are on both bodies."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from .. import _cpp
from ..compat import Array, Indices
from ..discretization.reference_facets import shape_functions
from .flux_sides import FieldOnZone, FieldSide, FixedPoints


class TiedPoints(NamedTuple):
    """Points of a tie with a master: what of them never changes."""

    facet: Indices  # slave facets, (n,)
    master: Indices  # facets of the master that are here, (n,)
    xi: Array
    number: Indices  # index among all points
    weight: Array  # undeformed area
    slave: Array  # shape functions of the field, (n, nodes)
    target: Array


class TiedField(FieldOnZone):
    """A scalar field on both sides of a tie. Collective.

    A flux depends on nothing but the field, so its tangent has no other columns.
    """

    master: FieldSide  # a tie has no rigid tools

    @cached_property
    def fixed(self) -> TiedPoints:
        """Points of the tie, which it finds once."""
        points, (slave, master) = self.zone.cpp.points(), self.zone.sides
        number = np.flatnonzero(points["status"] > 0).astype(np.int32)
        xi, eta = points["xi"][number], points["eta"][number]
        N_s, _ = shape_functions(slave.shape, self.slave.degree, xi)
        N_m, _ = shape_functions(master.shape, self.master.degree, eta)
        of_points = points["slave"][number], points["master"][number]
        return TiedPoints(*of_points, xi, number, points["area"][number], N_s, N_m)

    def present(self) -> Any:
        """Values at the points on both sides, (n,) each. Collective."""
        at, width = self.fixed, self.master.width
        own = self.master.values.ravel()
        fetched = _cpp.to_master_facets(self.zone.cpp, own, width).reshape(-1, width)
        return (
            np.einsum("qa,qa->q", at.slave, self.slave.values[at.facet]),
            np.einsum("qa,qa->q", at.target, fetched[at.master]),
        )

    def points(self, fields: Any) -> dict[str, Array]:
        """Arguments of a law: pressure, gap and slip are zero."""
        at, none = self.fixed, np.zeros(len(self.fixed.number))
        found: dict[str, Any]
        found = {"point": at.number, "facet": at.facet, "xi": at.xi}
        found |= {"slave": fields[0], "target": fields[1], "weight": at.weight}
        return found | dict.fromkeys(("pressure", "gap", "slip", "work"), none)

    @property
    def at_points(self) -> FixedPoints:
        """Rows and shape functions at the points. Collective."""
        at = self.fixed
        slave = self.slave_rows.reshape(-1, self.slave.width)[at.facet]
        master = self.master_rows.reshape(-1, self.master.width)[at.master]
        return FixedPoints([slave, master], [at.slave, at.target], at.weight)

    def residual(
        self, fields: Any, q: Array, slave_heat: float, target_heat: float
    ) -> tuple[Any, ...]:
        """Rows and values, see `_cpp.flux_residual`."""
        return self.at_points.residual(q)

    def tangent(
        self,
        fields: Any,
        q: Array,
        slave_heat: float,
        target_heat: float,
        slopes: Array,
        along: Array,
    ) -> tuple[Any, ...]:
        """Rows, columns and values, see `_cpp.flux_tangent`."""
        return self.at_points.tangent(slopes)
