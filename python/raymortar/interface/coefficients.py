"""Augmentation and penalty coefficients: one for all, or one for each pair of bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx.fem import Function

from .. import _cpp
from ..compat import Array, Indices
from ..errors import ContactError, require_agreement, together
from ..host.slave_fields import GAMMA, check_function, on_facets
from ..options.methods import check_coefficient
from .contact_surfaces import ContactSurfaces
from .interfaces import Interfaces
from .zone_data import ZoneData
from .zones import Masters

# Values that differ by less count as equal: equal bodies differ by rounding errors
SAME = 1e-9


def single(tables: Sequence[Array]) -> float | None:
    """The value of all pairs if there is one, else None."""
    values = np.concatenate([table.ravel() for table in tables])
    low, high = float(values.min()), float(values.max())
    return low if high <= (1.0 + SAME) * low else None


class PairCoefficients(Mapping[tuple[int, Masters], tuple[float, ...]]):
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

    def check(self, interfaces: Interfaces) -> None:
        """Raise unless they are positive, and of these pairs of bodies."""
        if self.interfaces is not interfaces:
            raise ContactError("gamma has the coefficients of another Contact")
        for value in np.concatenate([table.ravel() for table in self.tables]):
            check_coefficient(float(value))

    def __getitem__(self, tags: tuple[int, Masters]) -> tuple[float, ...]:
        return self._values[tags]

    def __iter__(self) -> Iterator[tuple[int, Masters]]:
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


@dataclass(frozen=True)
class ZoneCoefficients:
    """A coefficient as a zone takes it.

    Attributes
    ----------
    of_facets
        Values at the displacement dofs of its slave facets, (facets, dofs per facet).
    slaves, masters
        Sorted bodies of its two surfaces, if pairs of bodies have different values.
    factors
        Factors on the values of slave facets, by pair of bodies, (slaves, masters).
    """

    of_facets: Array
    slaves: Indices | None = None
    masters: Indices | None = None
    factors: Array | None = None

    def of_pairs(self) -> _cpp.PairFactors:
        """Factors by pair of bodies, empty if one value holds for all."""
        if self.slaves is None or self.masters is None or self.factors is None:
            return _cpp.PairFactors()
        return _cpp.PairFactors(
            slaves=self.slaves, masters=self.masters, factors=self.factors
        )


def spread(
    gamma: float | Function | PairCoefficients, surfaces: ContactSurfaces
) -> tuple[list[ZoneCoefficients], float]:
    """A coefficient as the zones take it, after checks. Collective.

    Returns
    -------
    zones
        Coefficients of each zone. Traction per length.
    scale
        Mean over all slave facets. All zones share it, as two zones may share a
        multiplier node.

    Raises
    ------
    ContactError
        If it is not positive, differs between ranks or is of another mesh or contact.
    """
    zones, comm = surfaces.zones, surfaces.comm
    with together(comm):
        _check(gamma, surfaces)
    if isinstance(gamma, PairCoefficients):
        found = _by_pair(gamma, zones)
    else:
        require_agreement(comm, gamma=gamma)
        found = [
            ZoneCoefficients(on_facets(GAMMA, gamma, zone.facets, comm))
            for zone in zones
        ]
    total = comm.allreduce(sum(float(one.of_facets.sum()) for one in found))
    return found, total / comm.allreduce(sum(one.of_facets.size for one in found))


def _check(gamma: Any, surfaces: ContactSurfaces) -> None:
    """Raise for a coefficient that does not fit this contact."""
    if isinstance(gamma, PairCoefficients):
        gamma.check(surfaces.interfaces)
        return
    if gamma is None:
        raise ContactError("set_gamma needs a number or a Function, not None")
    check_coefficient(gamma)
    if isinstance(gamma, Function):
        check_function(GAMMA, gamma, surfaces.slave_u.function_space.mesh)


def _by_pair(
    gamma: PairCoefficients, zones: Sequence[ZoneData]
) -> list[ZoneCoefficients]:
    """Each slave facet gets the largest value of its pairs, and each pair its share of
    that."""
    pairs, found = gamma.interfaces, []
    for zone, slaves, masters, table in zip(
        zones, pairs.slave, pairs.master, gamma.tables
    ):
        surface = zone.facets.slave_surface
        largest = table.max(axis=1)
        of_facets = largest[pairs.rows(surface, slaves)]
        found.append(
            ZoneCoefficients(
                np.repeat(of_facets[:, None], surface.facet_dofs.shape[1], axis=1),
                slaves.astype(np.int32),
                masters.astype(np.int32),
                table / largest[:, None],
            )
        )
    return found
