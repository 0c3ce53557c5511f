"""What ranks tell each other, counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from .layout import CoupledRows

if TYPE_CHECKING:
    from ..interface.zones import ZoneData


@dataclass(frozen=True)
class Sent:
    """What was sent from rank to rank; what a rank has itself is not counted.

    ``pairing_*``: to find partners and to hand over facets, whenever facets have moved
    too far for the last ones to serve. ``value_*``: displacements at the dofs of those
    facets, at every update. Both since the contact object was made. ``*_entries``: of
    the contact's matrix and residual in rows of other ranks, which PETSc sends at one
    assembly, to ``entry_ranks`` ranks.
    """

    pairing_messages: int = 0
    pairing_bytes: int = 0
    value_messages: int = 0
    value_bytes: int = 0
    matrix_entries: int = 0
    vector_entries: int = 0
    entry_ranks: int = 0


@dataclass(frozen=True)
class Communication:
    """All ranks together, and for each count the rank that has most."""

    total: Sent = Sent()
    largest: Sent = Sent()


def communication(zones: Sequence[ZoneData], layout: CoupledRows) -> Communication:
    """Counts of all zones. Collective."""
    comm, names = layout.comm, [field.name for field in fields(Sent)]
    counts = np.zeros(len(names), dtype=np.int64)
    for zone in zones:
        of_zone = zone.cpp.traffic(layout.ranges, comm.rank)
        counts += [of_zone[name] for name in names]
    total, largest = np.empty_like(counts), np.empty_like(counts)
    comm.Allreduce(counts, total, op=MPI.SUM)
    comm.Allreduce(counts, largest, op=MPI.MAX)
    return Communication(Sent(*total.tolist()), Sent(*largest.tolist()))
