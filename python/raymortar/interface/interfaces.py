"""Which bodies meet, whatever the tags of their facets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from ..compat import Array, Indices
from ..host.bodies import Bodies, bodies_of_facets
from ..host.layout import Layout
from ..host.surfaces import Surface

if TYPE_CHECKING:
    from .zone_data import ZoneData


def _membership(
    comm: MPI.Comm, bodies: Sequence[Indices], count: int
) -> npt.NDArray[np.bool_]:
    """Whether each zone has facets of each body on any rank, (zones, bodies).
    Collective."""
    here = np.zeros((len(bodies), count), dtype=np.int32)
    for zone, of_facets in enumerate(bodies):
        here[zone, of_facets] = 1
    comm.Allreduce(MPI.IN_PLACE, here, op=MPI.MAX)
    return here > 0


def _kinds(member: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.bool_], Indices]:
    """Each set of zones that some body is in, (kinds, zones), and the kind of each
    body."""
    kinds, kind = np.unique(member.T, axis=0, return_inverse=True)
    return kinds, kind.reshape(-1)


class Interfaces:
    """Pairs of bodies that zones bring together. Collective.

    A side of a pair of bodies is all facets of one body that face the other one, in any
    zone. Opposite bodies that are in the same zones are of one *kind*, and have the
    same side. There are about as many kinds as zones, far fewer than pairs.

    Parameters
    ----------
    zones
        Of a contact.
    layout
        Of its unknowns.
    bodies
        Of its displacement's nodes.

    Attributes
    ----------
    slave, master
        Sorted bodies of each zone's sides, the rows and columns of its tables.
    """

    def __init__(
        self, zones: Sequence[ZoneData], layout: Layout, bodies: Bodies
    ) -> None:
        self.zones, self.layout, self.bodies = zones, layout, bodies
        self._slave_in = self._zones_of("slave_surface")
        # All rigid tools together count as one more body
        rigid = [[bool(zone.facets.bodies)] for zone in zones]
        self._master_in = np.hstack([self._zones_of("master_surface"), rigid])
        self.slave = [np.flatnonzero(row) for row in self._slave_in]
        self.master = [np.flatnonzero(row) for row in self._master_in]

    def of_facets(self, surface: Surface) -> Indices:
        """Body of each facet of a surface."""
        return bodies_of_facets(self.bodies, surface)

    def _zones_of(self, side: str) -> npt.NDArray[np.bool_]:
        surfaces = [getattr(zone.facets, side) for zone in self.zones]
        bodies = [self.of_facets(surface) for surface in surfaces]
        return _membership(self.layout.comm, bodies, self.bodies.count)

    def tables(
        self,
        measure: Callable[[Sequence[Surface]], Array],
        pair: Callable[[Array, Array], Array],
    ) -> list[Array]:
        """A number for each pair of bodies, zone by zone. Collective.

        Parameters
        ----------
        measure
            Quantities of a union of surfaces, body by body: (bodies, quantities).
            Called on all ranks alike.
        pair
            Gives the numbers, (pairs,), from the quantities of the slaves' and the
            masters' sides, (pairs, quantities) each.

        Returns
        -------
        (slave's bodies, master's bodies) of each zone.
        """
        of_slaves, slave_kind = _kinds(self._slave_in)
        of_masters, master_kind = _kinds(self._master_in)
        # A slave's side depends on the kind of its masters, and a master's on that of
        # its slaves
        slaves = self._measured(of_masters, "slave_surface", measure)
        masters = self._measured(of_slaves, "master_surface", measure)
        masters = np.pad(masters, [(0, 0), (0, 1), (0, 0)])
        tables = []
        for rows, columns in zip(self.slave, self.master):
            row, column = (
                part.ravel() for part in np.meshgrid(rows, columns, indexing="ij")
            )
            found = pair(
                slaves[master_kind[column], row], masters[slave_kind[row], column]
            )
            tables.append(found.reshape(len(rows), len(columns)))
        return tables

    def _measured(
        self,
        kinds: npt.NDArray[np.bool_],
        side: str,
        measure: Callable[[Sequence[Surface]], Array],
    ) -> Array:
        """`measure` of a side, for each set of zones, (kinds, bodies, quantities)."""
        surfaces = [getattr(zone.facets, side) for zone in self.zones]
        # Bodies without facets are in no zone, so their entries are not read
        found = [
            measure([surfaces[z] for z in np.flatnonzero(kind)]) if kind.any() else None
            for kind in kinds
        ]
        none = np.zeros_like(next(part for part in found if part is not None))
        return np.array([none if part is None else part for part in found])

    def rows(self, surface: Surface, bodies: Indices) -> Indices:
        """Index of each facet's body among sorted bodies."""
        return np.searchsorted(bodies, self.of_facets(surface)).astype(np.int32)
