"""Which bodies meet: a slave's and a master's body, however their facets are tagged."""

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
    from .zones import ZoneData


def _membership(
    comm: MPI.Comm, bodies: Sequence[Indices], count: int
) -> npt.NDArray[np.bool_]:
    """Whether a zone has facets of a body on any rank, (zones, bodies). Collective."""
    here = np.zeros((len(bodies), count), dtype=np.int32)
    for zone, of_facets in enumerate(bodies):
        here[zone, of_facets] = 1
    comm.Allreduce(MPI.IN_PLACE, here, op=MPI.MAX)
    return here > 0


def _kinds(member: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.bool_], Indices]:
    """Sets of zones that bodies are in, (kinds, zones), and each body's kind."""
    kinds, kind = np.unique(member.T, axis=0, return_inverse=True)
    return kinds, kind.reshape(-1)


class Interfaces:
    """Pairs of bodies that zones bring together. Collective.

    The side of a pair of bodies is all facets of the one that face the other, in
    whatever zones they are. It is the same for all bodies opposite that are in the same
    zones, their *kind*: there are about as many kinds as zones, and far fewer than pairs.

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
        # What is rigid counts as one more body
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
            From those of the slaves' and the masters' sides, (pairs, quantities), to
            the number, (pairs,).

        Returns
        -------
        (slave's bodies, master's bodies) of each zone.
        """
        of_slaves, slave_kind = _kinds(self._slave_in)
        of_masters, master_kind = _kinds(self._master_in)
        # A slave's side is what faces a kind of masters, and the other way around
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
        # Bodies without such facets are in no zone: of theirs nothing is read
        found = [
            measure([surfaces[z] for z in np.flatnonzero(kind)]) if kind.any() else None
            for kind in kinds
        ]
        none = np.zeros_like(next(part for part in found if part is not None))
        return np.array([none if part is None else part for part in found])

    def rows(self, surface: Surface, bodies: Indices) -> Indices:
        """Place of each facet's body among some sorted bodies."""
        return np.searchsorted(bodies, self.of_facets(surface)).astype(np.int32)
