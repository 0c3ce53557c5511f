"""Memory that a matrix takes, against what there is."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.errors import raise_everywhere
from ..core.interface.zone_data import ZoneData
from ..core.system.coupled import CoupledSystem

# Average number of pairs of facets that share an entry: the number of facets around a
# node. This is exact for two regular lattices of any sizes
_AROUND_A_NODE = {"interval": 2, "triangle": 6, "quadrilateral": 4}


def available_memory() -> int | None:
    """Bytes of available memory on this machine; None if it is unknown."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    found = [line.split() for line in lines if line.startswith("MemAvailable:")]
    return 1024 * int(found[0][1]) if found else None


def contact_entries(zone: ZoneData, components: int) -> int:
    """Estimate the matrix entries of this rank's pairs from below.

    The zone's pattern has its pairs; components are those of the multiplier.
    """
    slave, master = zone.facets.slave_surface, zone.facets.master_surface
    rows = slave.facet_dofs.shape[1] * slave.gdim
    rows += zone.multiplier_table.shape[1] * components
    columns = master.facet_dofs.shape[1] * master.gdim
    return 2 * len(zone.pattern) * rows * columns // _AROUND_A_NODE[slave.shape]


def require_memory(system: CoupledSystem) -> None:
    """Raise if the ranks are about to allocate more than there is. Collective.

    Counted are entries of volume and contact, from below, and columns twice, as the
    pattern is made next to the matrix. The ranks of one machine share its memory.
    """
    comm, volume = system.comm, system.parts[0].volume
    assert volume is not None
    zones = ((z, part.layout.components) for part in system.parts for z in part.zones)
    entries = len(volume.columns) + sum(contact_entries(*zone) for zone in zones)
    index, value = (np.dtype(t).itemsize for t in (PETSc.IntType, PETSc.ScalarType))
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
    size = machine.allreduce(entries * (value + 2 * index))
    ranks = machine.size
    machine.Free()
    available = available_memory()
    message = None
    if available is not None and size > available:
        message = (
            f"the matrix takes at least {size / 1e9:.3g} GB on a machine with "
            f"{ranks} rank(s), of which {available / 1e9:.3g} GB are available, and a "
            "direct solver several times that: take more machines, a coarser mesh, or "
            "an iterative solver"
        )
    raise_everywhere(comm, message, MemoryError)
