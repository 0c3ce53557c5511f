"""Slave nodes whose displacement is prescribed, and tractions that nothing determines."""

from __future__ import annotations

from typing import Any

import numpy as np

from mpi4py import MPI

from . import compat
from .errors import raise_everywhere
from .results import CLOSED


def any_held(contact: Any, marker: np.ndarray) -> bool:
    """Whether some slave facet, on any rank, is prescribed throughout. Collective."""
    held = False
    for zone in contact.zones:
        surface = zone.facets.slave_surface
        fixed = marker.reshape(-1, surface.gdim)[surface.dofs].all(axis=1)
        held |= bool(fixed[surface.facet_dofs].all(axis=1).any())
    return contact.layout.comm.allreduce(held, op=MPI.LOR)


def any_partly_held(contact: Any, marker: np.ndarray) -> bool:
    """Whether a component is prescribed at some nodes of a slave facet but not at all
    of them, on any rank. Collective."""
    found = False
    for zone in contact.zones:
        surface = zone.facets.slave_surface
        fixed = marker.reshape(-1, surface.gdim)[surface.dofs][surface.facet_dofs]
        found |= bool((fixed.any(axis=1) & ~fixed.all(axis=1)).any())
    return contact.layout.comm.allreduce(found, op=MPI.LOR)


def refuse_held(contact: Any) -> None:
    """Raise where the multiplier is in no equation. Collective.

    Raises
    ------
    ContactError
        If contact is closed all around a node of the multiplier, between facets whose
        displacement is prescribed on both sides: the row of its unknown is empty.
    """
    W = contact.multiplier.function_space
    known = compat.create_la_vector(W.dofmap.index_map, 1)
    closed = compat.create_la_vector(W.dofmap.index_map, 1)
    for zone in contact.zones:
        points = zone.cpp.points()
        shut = points["status"] >= CLOSED
        free = (zone.cpp.free_points() == 1) | ~shut
        for vector, which in ((known, free), (closed, shut)):
            vector.array[zone.multiplier_table[points["slave"][which]]] = 1.0
    for vector in (known, closed):
        compat.scatter_reverse_add(vector)
    n = W.dofmap.index_map.size_local
    held = np.flatnonzero((known.array[:n] == 0.0) & (closed.array[:n] > 0.0))
    count = contact.layout.comm.allreduce(len(held))
    message = None
    if len(held):
        dim = W.mesh.geometry.dim
        x = np.round(W.tabulate_dof_coordinates()[held[0], :dim], 12)
        place = ", ".join(f"{value:.6g}" for value in x)
        message = (
            f"{count} node(s) of the contact traction, for example the one at ({place}), "
            "are between facets whose displacement is prescribed on both sides: leave "
            "these out of the slave's tag, or use a penalty"
        )
    raise_everywhere(contact.layout.comm, message)
