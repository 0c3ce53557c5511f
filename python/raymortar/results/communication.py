"""Counts of messages between ranks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

from mpi4py import MPI

import numpy as np


@dataclass(frozen=True)
class Sent:
    """Counts of messages from one rank to another.

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


def communication(
    traffic: Sequence[Mapping[str, int]], comm: MPI.Comm
) -> Communication:
    """Add up counts of this rank's zones, and those of all ranks. Collective."""
    counts = np.array([astuple(Sent()), *(astuple(Sent(**one)) for one in traffic)])
    ranks = np.array(comm.allgather(counts.sum(axis=0)))
    return Communication(
        *(Sent(*found.tolist()) for found in (ranks.sum(axis=0), ranks.max(axis=0)))
    )
