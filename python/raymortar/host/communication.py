"""Counts of what ranks send to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from .layout import CoupledRows

if TYPE_CHECKING:
    from ..interface.zone_data import ZoneData


@dataclass(frozen=True)
class Sent:
    """What was sent from one rank to another.

    ``pairing_*``: sent to find partners and to exchange facets, whenever facets have
    moved too far to keep the last ones. ``value_*``: displacements at the dofs of those
    facets, sent at every update. Both are sums since the contact was made.
    ``*_entries``: entries of the contact's matrix and residual in rows of other ranks,
    which PETSc sends at one assembly to ``entry_ranks`` ranks.
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
    """Sums over all ranks, and for each count the largest one of a rank."""

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
