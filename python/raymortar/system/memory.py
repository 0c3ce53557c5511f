"""Whether the coupled matrix can fit, said before it is allocated."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..errors import raise_everywhere

# Pairs of facets that share an entry, on average: as many as facets around a node, which
# is exact for two lattices, whatever the ratio of their sizes
_AROUND_A_NODE = {"interval": 2, "triangle": 6, "quadrilateral": 4}
_INDEX = np.dtype(PETSc.IntType).itemsize
_VALUE = np.dtype(PETSc.ScalarType).itemsize


def available_memory() -> int | None:
    """Bytes that this machine can still give; None where it does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    found = [line.split() for line in lines if line.startswith("MemAvailable:")]
    return 1024 * int(found[0][1]) if found else None


def contact_entries(zone: Any, components: int) -> int:
    """Entries of the matrix that couple this rank's pairs, at least about.

    Parameters
    ----------
    zone
        Zone whose pattern has its pairs.
    components
        Of the multiplier; 0: none.
    """
    slave, master = zone.facets.slave_surface, zone.facets.master_surface
    rows = slave.facet_dofs.shape[1] * slave.gdim
    rows += zone.multiplier_table.shape[1] * components
    columns = master.facet_dofs.shape[1] * master.gdim
    return 2 * len(zone.pattern) * rows * columns // _AROUND_A_NODE[slave.shape]


def matrix_bytes(volume: Any, contacts: Sequence[Any]) -> int:
    """Bytes of this rank's share of the matrix, at least about.

    Volume and contact entries, twice their columns while the pattern is made.
    """
    entries = len(volume.columns) + sum(
        contact_entries(zone, contact.layout.components)
        for contact in contacts
        for zone in contact.zones
    )
    return entries * (_VALUE + 2 * _INDEX)


def require_memory(comm: MPI.Comm, needed: int) -> None:
    """Raise where what ranks are about to allocate cannot fit. Collective.

    The ranks of one machine share its memory.

    Parameters
    ----------
    comm
        Communicator of the mesh.
    needed
        Bytes, of this rank.

    Raises
    ------
    MemoryError
        On every rank, with the bytes needed and available.
    """
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
    together = machine.allreduce(needed)
    ranks = machine.size
    machine.Free()
    available = available_memory()
    message = None
    if available is not None and together > available:
        message = (
            f"the matrix takes at least {together / 1e9:.3g} GB on a machine with "
            f"{ranks} rank(s), of which {available / 1e9:.3g} GB are available, and a "
            "direct solver several times that: take more machines, a coarser mesh, or "
            "an iterative solver"
        )
    raise_everywhere(comm, message, MemoryError)
