"""One flux's share of residual and tangent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array
from ..core.convergence.balance import EPS
from ..core.discretization.joined import Displacement
from ..core.discretization.layout import CoupledRows
from ..core.discretization.slave_fields import on_facets
from ..core.discretization.unknowns import Unknowns
from ..core.errors import SetUpError, raise_everywhere, together, warn
from ..core.interface.zone_data import ZoneData
from ..core.system.assembly import ContactAssembly
from ..entries import joined
from ..user_laws.arguments import along_facets, further
from .flux_law import FLUX_FIELD, FluxLaw
from .flux_sides import FieldOnZone, TiedField, find_fields
from .tool_part import ToolPart


@dataclass
class FluxPoints:
    """Arguments of a flux's law at the points of a zone with a hit.

    Attributes
    ----------
    side, fields
        The zone with its field, and the present values.
    found
        Arrays by name, see `_cpp.flux_points`.
    at
        Arguments of the law, (5, n).
    given
        Further arguments by name.
    """

    side: FieldOnZone
    fields: Any
    found: dict[str, Array]
    at: Array
    given: dict[str, Any]


class FluxPart:
    """Evaluates a law at the points of a contact, and adds up entries. Collective."""

    stiffness = 0.0  # of unknowns that it brings: none

    def __init__(
        self,
        contact: ContactAssembly,
        fields: list[Displacement],
        law: FluxLaw,
        heat: tuple[float, float],
        tool: float | ToolPart,
    ) -> None:
        self.contact, self.fields = contact, fields
        self._law, self._heat = law, heat
        surfaces = contact.surfaces
        self._comm: MPI.Comm = surfaces.comm
        kind = FieldOnZone if surfaces.tied is None else TiedField
        self.tool = tool if isinstance(tool, ToolPart) else None
        number = 0.0 if isinstance(tool, ToolPart) else tool
        self.sides = [kind(zone, surfaces.u, fields, number) for zone in contact.zones]
        if self.tool is not None:
            self.tool.meet(contact, self.sides)
        self.functions: list[Function] = []
        self._is_checked = False
        self.is_solved_for = False  # by some problem

    @property
    def feels_pressure(self) -> bool:
        """Whether the law sees a pressure, which a tie has not."""
        return self.contact.surfaces.tied is None

    @property
    def name(self) -> str:
        """Name of the field, for messages."""
        return ", ".join(f.given.name for f in self.fields)

    def solve_for(
        self, unknowns: Unknowns, layout: CoupledRows, moves: bool = True
    ) -> None:
        """Find the field among what a problem solves for, and take its rows.
        Collective.
        """
        with together(self._comm):
            find_fields(self.fields, unknowns, "Flux")
        self.is_solved_for = True
        for side in self.sides:
            side.moves = moves
            side.set_rows(layout.rows, unknowns.starts)

    def choose_scale(self, stiffness: Callable[[Any], Array]) -> None:
        """Do nothing: fluxes have no scale of their own."""

    def prepare(self, look_up: Callable[[Any], Array]) -> None:
        """Do nothing: prescribed unknowns change no flux."""

    def pattern(self) -> None:
        """Return no entries: `rows` says which there are."""

    def rows(self, of_zone: Callable[[Any], int]) -> list[Any]:
        """Rows of the field on the facets of each zone, for the room of a matrix."""
        return [side.pattern(of_zone(side.zone)) for side in self.sides]

    # Arguments of the law

    def _points(self, side: FieldOnZone, fields: Any) -> FluxPoints:
        """Collect the arguments of the law."""
        found = side.points(fields)
        dt = self.contact.present.dt
        at = np.stack(
            [found[k] for k in ("slave", "target", "pressure", "gap")]
            + [found["slip"] / dt]
        )
        given = self._given(side.zone, found["facet"], found["xi"])
        return FluxPoints(side, fields, found, at, given)

    def _given(self, zone: ZoneData, facet: Any, xi: Array) -> dict[str, Any]:
        """Further arguments of the law at places on slave facets."""
        wanted = self._law.arguments | ({"x"} if not self._is_checked else set())
        comm = MPI.COMM_SELF  # errors are gathered by those who ask
        fields = self._law.fields if "fields" in wanted else []
        nodal = [on_facets(FLUX_FIELD, one, zone.facets, comm) for one in fields]
        return further(zone, facet, xi, self.contact.present.dt, nodal, wanted)

    def _along(self, points: FluxPoints) -> Array:
        """Differentiate the flux along the facets at unchanged arguments, (n, d - 1)."""
        if not self._law.arguments - {"dt"}:
            return np.empty(0)
        zone, facet, law = points.side.zone, points.found["facet"], self._law
        return along_facets(
            lambda xi: law.values(points.at, self._given(zone, facet, xi)),
            points.found["xi"],
        )

    # Entries

    @property
    def _heat_rates(self) -> tuple[float, float]:
        """Shares of the work of friction that both sides take, by the time."""
        dt = self.contact.present.dt
        return self._heat[0] / dt, self._heat[1] / dt

    def _present(self) -> list[Any]:
        """Present values of the field on all sides. Collective."""
        if self.tool is not None:
            value = self.tool.value
            for side in self.sides:
                side.tool = value
        return [side.present() for side in self.sides]

    def _evaluated(self, check: bool = False) -> list[tuple[FluxPoints, Array]]:
        """Points of the zones, with the present fluxes. Collective."""
        values = self._present()
        if check:
            self._check(values)
        found = []
        with together(self._comm):
            for side, fields in zip(self.sides, values):
                points = self._points(side, fields)
                found.append((points, self._law.values(points.at, points.given)))
        return found

    def _into_tools(self, side: FieldOnZone) -> bool:
        """Whether what leaves a slave surface goes into tools with an unknown."""
        return self.tool is not None and side.master is None

    def residual(self) -> tuple[Any, Any]:
        """Rows and values of the residual, of this rank's points. Collective."""
        found = []
        for points, q in self._evaluated(check=True):
            side, fields = points.side, points.fields
            found.append(side.residual(fields, q, self._heat_rates))
            if self._into_tools(side):
                _, of_slave = side.residual(fields, q, self._opposite_rates)
                found.append(self._of_tool(-of_slave.sum()))
        return joined(found)

    @property
    def _opposite_rates(self) -> tuple[float, float]:
        """Shares by which rows of the slave add up to what leaves the tools, negative:
        their test functions add up to one."""
        return -self._heat_rates[1], 0.0

    def _of_tool(self, *sums: float) -> Any:
        """The row of the tools with one entry for each array of values."""
        assert self.tool is not None
        return (np.array([self.tool.row]), *(np.array([one]) for one in sums))

    def _tangent_of_tools(
        self, points: FluxPoints, q: Array, slopes: Array, along: Array
    ) -> list[Any]:
        """Entries in the row and in the column of the tools: columns of the rows of the
        slave, added up, and what the slave's rows vary with the tools."""
        assert self.tool is not None
        row, side, fields = self.tool.row, points.side, points.fields
        _, columns, values = side.tangent(
            fields, q, self._opposite_rates, slopes, along
        )
        columns, at = np.unique(columns, return_inverse=True)
        sums = -np.bincount(at.ravel(), values, len(columns))
        rows, by_tool = side.residual(fields, slopes[:, 1].copy())
        own = np.array([row])
        return [
            (np.full(len(columns), row), columns, sums),
            (rows, np.full(len(rows), row), by_tool),
            (own, own, np.array([-by_tool.sum()])),
        ]

    def tangent(self, largest: float) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Rows, columns and values of the tangent; and rows of the field, the sizes of
        terms there, and their rounding errors where positions are as large as `largest`.
        Of this rank's points. Collective."""
        dt, entries, sizes = self.contact.present.dt, [], []
        evaluated = self._evaluated(check=True)
        with together(self._comm):
            for points, q in evaluated:
                slopes = self._law.slopes(points.at, points.given)
                sizes.append(self._sizes(points, q, slopes, largest))
                of_tools = self._into_tools(points.side)
                if of_tools:
                    sizes.append(self._of_tool(*(one.sum() for one in sizes[-1][1:])))
                slopes[:, 4] /= dt
                along = self._along(points)
                if of_tools:
                    entries += self._tangent_of_tools(points, q, slopes, along)
                of = points.fields, q, self._heat_rates, slopes, along
                entries.append(points.side.tangent(*of))
        return joined(entries), joined(sizes)

    def _sizes(
        self, points: FluxPoints, q: Array, slopes: Array, largest: float
    ) -> tuple[Any, Any, Any]:
        """Rows of the field, sizes of terms and rounding errors of a zone's points."""
        at, dt = np.abs(points.at), self.contact.present.dt
        at[3], at[4] = largest, largest / dt  # differences of positions
        heat = points.found["pressure"] * largest / dt
        terms = np.abs(q) + np.abs(points.found["work"]) / dt
        errors = EPS * (np.einsum("qk,kq->q", np.abs(slopes), at) + heat)
        rows, first = points.side.residual(points.fields, terms)
        _, second = points.side.residual(points.fields, errors)
        return rows, np.abs(first), np.abs(second)

    def _check(self, values: Sequence[Any]) -> None:
        """Compare the derivatives with differences once, where points are hit.
        Collective."""
        if self._is_checked:
            return
        fault, count, uphill = None, 0, False
        with together(self._comm):
            for side, fields in zip(self.sides, values):
                points = self._points(side, fields)
                count += points.at.shape[1]
                if points.at.shape[1] and fault is None:
                    self._law.values(points.at, points.given)
                    self._law.slopes(points.at, points.given)
                    fault = self._law.fault_of_slopes(points.at, points.given)
                    uphill = self._law.flows_uphill(points.at, points.given)
        raise_everywhere(self._comm, fault, SetUpError)
        if self._comm.allreduce(int(uphill)):
            warn(
                f"Flux.law lets {self.name} flow from low to high, with closed contact "
                "and no slip. q goes from slave to master, positive where T_s > T_m",
                page="fields",
            )
        self._is_checked = self._comm.allreduce(count) > 0

    # Results

    def rates(self) -> tuple[float, float, float]:
        """Sum up the flux and the heat that both sides take from friction. Collective."""
        sums = np.zeros(2)
        for points, q in self._evaluated():
            weight = points.found["weight"]
            sums += [weight @ q, weight @ points.found["work"]]
        through, work = self._comm.allreduce(sums)
        slave, master = self._heat_rates
        return float(through), float(slave * work), float(master * work)

    def points(self, number: int) -> dict[str, Array]:
        """Arrays over this rank's points with a hit of a zone. Collective."""
        points, q = self._evaluated()[number]
        slave, master = self._heat_rates
        found = points.found
        return {
            "point": found["point"],
            "T_s": found["slave"],
            "T_m": found["target"],
            "p": found["pressure"],
            "g": found["gap"],
            "v": points.at[4],
            "q": q,
            "slave_heat": slave * found["work"],
            "master_heat": master * found["work"],
            "weight": found["weight"],
        }
