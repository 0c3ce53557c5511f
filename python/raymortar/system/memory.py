"""Check that the coupled matrix fits into memory, before it is allocated."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..errors import raise_everywhere
from ..interface.stiffness import VolumePattern
from ..interface.zones import ZoneData

# Average number of pairs of facets that share an entry: the number of facets around a
# node. This is exact for two regular lattices of any sizes
_AROUND_A_NODE = {"interval": 2, "triangle": 6, "quadrilateral": 4}
_INDEX = np.dtype(PETSc.IntType).itemsize
_VALUE = np.dtype(PETSc.ScalarType).itemsize


def available_memory() -> int | None:
    """Bytes of available memory on this machine; None if it is unknown."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    found = [line.split() for line in lines if line.startswith("MemAvailable:")]
    return 1024 * int(found[0][1]) if found else None


def contact_entries(zone: ZoneData, components: int) -> int:
    """Approximate lower bound of the matrix entries that couple this rank's pairs.

    Parameters
    ----------
    zone
        Zone whose pattern has its pairs.
    components
        Components of the multiplier; 0 without one.
    """
    slave, master = zone.facets.slave_surface, zone.facets.master_surface
    rows = slave.facet_dofs.shape[1] * slave.gdim
    rows += zone.multiplier_table.shape[1] * components
    columns = master.facet_dofs.shape[1] * master.gdim
    return 2 * len(zone.pattern) * rows * columns // _AROUND_A_NODE[slave.shape]


def matrix_bytes(volume: VolumePattern, zones: Sequence[tuple[ZoneData, int]]) -> int:
    """Approximate lower bound of the bytes of this rank's part of the matrix.

    Counted are entries of volume and contact, and columns twice, as the pattern is made
    next to the matrix.

    Parameters
    ----------
    volume
        Pattern of the volume.
    zones
        Each zone and the components of its multiplier.
    """
    entries = len(volume.columns) + sum(contact_entries(*zone) for zone in zones)
    return entries * (_VALUE + 2 * _INDEX)


def require_memory(comm: MPI.Comm, needed: int) -> None:
    """Raise if the ranks are about to allocate more than there is. Collective.

    The ranks of one machine share its memory.

    Parameters
    ----------
    comm
        Communicator of the mesh.
    needed
        Bytes that this rank needs.

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
