"""Pairs of bodies that meet, and coefficients: one for all pairs, or one for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from ..compat import Array, Indices, Mask
from ..discretization.layout import Layout
from ..discretization.slave_fields import GAMMA, check_function, on_facets
from ..discretization.surfaces import Bodies, Surface, bodies_of_facets
from ..errors import ContactError, require_agreement, together
from ..options.methods import check_coefficient
from .zone_data import Masters, ZoneData

# Values that differ by less count as equal: equal bodies differ by rounding errors
SAME = 1e-9

Measure = Callable[[Sequence[Surface]], Array]


class Interfaces:
    """Pairs of bodies that zones bring together. Collective.

    A side of a pair of bodies is all facets of one body that face the other one, in any
    zone. Opposite bodies that are in the same zones are of one *kind*, and have the
    same side. There are about as many kinds as zones, far fewer than pairs.

    Attributes
    ----------
    zones, layout, bodies
        Of a contact.
    slave, master
        Sorted bodies of each zone's sides, the rows and columns of its tables.
    """

    def __init__(
        self, zones: Sequence[ZoneData], layout: Layout, bodies: Bodies
    ) -> None:
        self.zones, self.layout, self.bodies = zones, layout, bodies
        self._slaves = [zone.facets.slave_surface for zone in zones]
        self._masters = [zone.facets.master_surface for zone in zones]
        self._slave_in = self._membership(self._slaves)
        # All rigid tools together count as one more body
        rigid = [[bool(zone.facets.bodies)] for zone in zones]
        self._master_in = np.hstack([self._membership(self._masters), rigid])
        self.slave = [np.flatnonzero(row) for row in self._slave_in]
        self.master = [np.flatnonzero(row) for row in self._master_in]

    def of_facets(self, surface: Surface) -> Indices:
        """Body of each facet of a surface."""
        return bodies_of_facets(self.bodies, surface)

    def _membership(self, surfaces: Sequence[Surface]) -> Mask:
        """Mark the bodies of which surfaces have facets on any rank, (zones, bodies)."""
        here = np.zeros((len(surfaces), self.bodies.count), dtype=np.int32)
        for row, surface in zip(here, surfaces):
            row[self.of_facets(surface)] = 1
        self.layout.comm.Allreduce(MPI.IN_PLACE, here, op=MPI.MAX)
        return here > 0

    def tables(
        self, measure: Measure, pair: Callable[[Array, Array], Array]
    ) -> list[Array]:
        """Make a table of (slave's bodies, master's bodies) for each zone. Collective.

        The measure gives quantities of a union of surfaces, (bodies, quantities), and is
        called on all ranks alike; `pair` takes those of the slaves' and of the masters'
        sides, (pairs, quantities) each, to the numbers of pairs.
        """
        # A slave's side depends on the kind of its masters, and a master's on that of
        # its slaves
        slaves, master_kind = _by_kind(self._master_in, self._slaves, measure)
        masters, slave_kind = _by_kind(self._slave_in, self._masters, measure)
        masters = np.pad(masters, [(0, 0), (0, 1), (0, 0)])
        tables = []
        for rows, columns in zip(self.slave, self.master):
            row, column = np.repeat(rows, len(columns)), np.tile(columns, len(rows))
            found = pair(
                slaves[master_kind[column], row], masters[slave_kind[row], column]
            )
            tables.append(found.reshape(len(rows), len(columns)))
        return tables


def _by_kind(
    member: Mask, opposite: Sequence[Surface], measure: Measure
) -> tuple[Array, Indices]:
    """Measure what each kind of body meets, (kinds, bodies, quantities).

    Also find the kind of each body, given which zones it is in, (zones, bodies).
    """
    kinds, kind = np.unique(member.T, axis=0, return_inverse=True)
    # Bodies without facets are in no zone, so their entries are not read
    found = {
        k: measure([opposite[zone] for zone in np.flatnonzero(zones)])
        for k, zones in enumerate(kinds)
        if zones.any()
    }
    none = np.zeros_like(next(iter(found.values())))
    return np.array([found.get(k, none) for k in range(len(kinds))]), kind.reshape(-1)


def single(tables: Sequence[Array]) -> float | None:
    """The value of all pairs if there is one, else None."""
    values = np.concatenate([table.ravel() for table in tables])
    low, high = float(values.min()), float(values.max())
    return low if high <= (1.0 + SAME) * low else None


class PairCoefficients(Mapping[tuple[int | str, Masters], tuple[float, ...]]):
    """Coefficients that differ between pairs of bodies.

    Maps a slave tag and its master tags to the values of their pairs of bodies,
    ascending. ``0.1 * coefficients`` is one that ``Contact.set_gamma`` takes.
    """

    def __init__(self, interfaces: Interfaces, tables: Sequence[Array]) -> None:
        self.interfaces, self.tables = interfaces, list(tables)
        self._values = {
            (zone.facets.slave_tag, zone.facets.master_tags): tuple(
                np.unique(table).tolist()
            )
            for zone, table in zip(interfaces.zones, tables)
        }

    def __getitem__(self, tags: tuple[int | str, Masters]) -> tuple[float, ...]:
        return self._values[tags]

    def __iter__(self) -> Iterator[tuple[int | str, Masters]]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __mul__(self, factor: float) -> PairCoefficients:
        return PairCoefficients(self.interfaces, [factor * t for t in self.tables])

    __rmul__ = __mul__

    def __format__(self, spec: str) -> str:
        parts = []
        for (slave, masters), values in self.items():
            listed = ", ".join(format(value, spec) for value in values)
            parts.append(f"{slave} on {'/'.join(map(str, masters))}: {listed}")
        return "; ".join(parts)

    def __repr__(self) -> str:
        return f"PairCoefficients({self})"


def one_or_each(
    interfaces: Interfaces, tables: Sequence[Array]
) -> float | PairCoefficients:
    """A number if all pairs have the same value."""
    one = single(tables)
    return PairCoefficients(interfaces, tables) if one is None else one


def spread(
    gamma: float | Function | PairCoefficients, interfaces: Interfaces, mesh: Any
) -> tuple[list[tuple[Array, _cpp.PairFactors]], float]:
    """Convert a coefficient, after checks, into the values that zones take. Collective.

    These are values at the displacement dofs of slave facets, (facets, dofs per facet),
    and factors on these by pair of bodies, empty if there is one value for all. Also
    their mean over all slave facets, a scale that all zones share, as two zones may
    share a multiplier node. Tractions per length.
    """
    zones, comm = interfaces.zones, interfaces.layout.comm
    with together(comm):
        _check(gamma, interfaces, mesh)
    if isinstance(gamma, PairCoefficients):
        bodies = interfaces.slave, interfaces.master
        found = [_by_pair(interfaces, *of) for of in zip(zones, *bodies, gamma.tables)]
    else:
        require_agreement(comm, gamma=gamma)
        nodal = [on_facets(GAMMA, gamma, zone.facets, comm) for zone in zones]
        found = [(values, _cpp.PairFactors()) for values in nodal]
    total, count = np.sum([(values.sum(), values.size) for values, _ in found], axis=0)
    return found, float(comm.allreduce(total) / comm.allreduce(count))


def _check(gamma: Any, interfaces: Interfaces, mesh: Any) -> None:
    """Raise for a coefficient that does not fit this contact."""
    if isinstance(gamma, PairCoefficients):
        if gamma.interfaces is not interfaces:
            raise ContactError("gamma has the coefficients of another Contact")
        for value in np.concatenate([table.ravel() for table in gamma.tables]):
            check_coefficient(float(value))
        return
    if gamma is None:
        raise ContactError("set_gamma needs a number or a Function, not None")
    check_coefficient(gamma)
    if isinstance(gamma, Function):
        check_function(GAMMA, gamma, mesh)


def _by_pair(
    interfaces: Interfaces,
    zone: ZoneData,
    slaves: Indices,
    masters: Indices,
    table: Array,
) -> tuple[Array, _cpp.PairFactors]:
    """Give each slave facet the largest value of its pairs, and each pair its share."""
    surface, largest = zone.facets.slave_surface, table.max(axis=1, keepdims=True)
    row = np.searchsorted(slaves, interfaces.of_facets(surface))
    factors = _cpp.PairFactors(
        slaves=slaves.astype(np.int32),
        masters=masters.astype(np.int32),
        factors=table / largest,
    )
    return np.repeat(largest[row], surface.facet_dofs.shape[1], axis=1), factors
