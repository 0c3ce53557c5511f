"""Whether the mesh has been moved since a contact was made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..host.facets import Facets, coordinates, format_point, node_table
from ..host.joined import parts_of
from ..host.tagged import ZoneFacets

# Of the coordinates and displacements, what adding a displacement to the mesh and taking
# it off again, a few times, may leave
MAX_DRIFT = 1e-12


class Reference:
    """Nodes of the mesh on the contact surfaces, and where they were.

    Reference positions, areas, search distances, the halo and the automatic gamma are
    taken from them once. Nodes elsewhere are the volume's forms' alone, which read the
    mesh at each assembly.

    Parameters
    ----------
    u
        Displacement.
    surfaces
        Facets of the slave and master surfaces on this rank.
    """

    def __init__(self, u: Function, surfaces: Sequence[Facets]) -> None:
        self._u, self._mesh = u, u.function_space.mesh
        tables = [node_table(self._mesh, facets).ravel() for facets in surfaces]
        self._nodes = np.unique(np.concatenate(tables))
        self._X = coordinates(self._mesh)[self._nodes]

    def fault(self) -> str | None:
        """What has moved on this rank, if anything."""
        x = coordinates(self._mesh)[self._nodes]
        if np.array_equal(x, self._X):
            return None
        moved = np.abs(x - self._X).max(axis=1)
        size = np.abs(self._X).max() + np.abs(self._u.x.array).max()
        # Written so that NaN has moved
        bad = np.flatnonzero(~(moved <= MAX_DRIFT * size))
        if len(bad) == 0:
            return None
        first = bad[0]
        return (
            f"{len(bad)} node(s) of the contact surfaces have moved in the mesh since "
            f"Contact was made, for example the one from {format_point(self._X[first])} "
            f"to {format_point(x[first])}: make contact, problem and solver anew; "
            "restore(old.state()) takes tractions over"
        )


def references(u: Any, zones: Sequence[ZoneFacets]) -> list[Reference]:
    """Of each mesh that has contact surfaces."""
    found = []
    for k, part in enumerate(parts_of(u)):
        sides = [zone.slave for zone in zones if zone.slave_part == k]
        sides += [m for zone in zones if zone.master_part == k for m in zone.masters]
        if sides:
            found.append(Reference(part, sides))
    return found
