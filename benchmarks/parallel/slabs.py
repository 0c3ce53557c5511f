"""Counts of one number of ranks: what is sent for two slabs in contact.

    mpirun -n RANKS python3 slabs.py FACETS [PARTITION]

PARTITION: `graph` (DOLFINx's, the default) or `columns`. Prints one line of JSON. Nothing
is solved: the upper slab is moved, by little and by an eighth of its length, and the
counters of `Contact.statistics` are read. Entries are counted in both places.
"""

from __future__ import annotations

import json
import sys

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Contact, Coulomb
from raymortar.core import compat
from raymortar.io.partitions import columns

COMM = MPI.COMM_WORLD
PARTITIONS = {"graph": None, "columns": columns((0.0, 0.0, 1.0))}
MATRIX_BYTES, VECTOR_BYTES = 16, 12  # value, row and column; value and row


def slabs(facets, partition):
    """Contact of two slabs of hexahedra, and the nodes of the upper one."""
    n = round(facets**0.5)
    m = round(4 / 3 * n)
    scene = two_blocks(
        COMM,
        3,
        "hexahedron",
        lower_divisions=(m, m, 1),
        upper_divisions=(n, n, 1),
        lower_size=(1.0, 1.0, 0.05),
        upper_size=(0.8, 0.8, 0.05),
        overhang=(-0.05, 0.03),
        partition=PARTITIONS[partition],
    )
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    contact = Contact(
        u,
        scene.facet_tags,
        [(scene.tags["slave"], scene.tags["master"])],
        AugmentedLagrangian(1.0),
        friction=Coulomb(0.3),
    )
    cells = scene.cell_tags.find(scene.bodies["upper"])
    upper = np.unique(compat.dofmap_array(u.function_space)[cells])
    return contact, upper


def move(contact, upper, shift):
    """Pair with the upper slab at a place; what was sent for that."""
    before = contact.statistics.communication
    contact.u.x.array.reshape(-1, 3)[upper] = shift
    contact.update()
    after = contact.statistics.communication
    return before, after


def change(before, after, name):
    """Of the rank that has most and, in all, of all ranks."""
    return [
        getattr(b, name) - getattr(a, name)
        for a, b in ((before.largest, after.largest), (before.total, after.total))
    ]


def measure(facets, partition):
    contact, upper = slabs(facets, partition)
    V = contact.u.function_space
    v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
    mass = ufl.inner(w, v) * ufl.dx(metadata={"quadrature_degree": 1})
    contact.create_matrix(compat.form(mass))
    move(contact, upper, (0.0, 0.0, -1e-4))
    small = move(contact, upper, (1e-4, 0.0, -1e-4))
    here, built = (
        contact.statistics.communication.largest,
        contact.statistics.halo_builds,
    )
    large = move(contact, upper, (0.1, 0.02, -1e-4))
    s = contact.statistics
    assert s.halo_builds > built, "moved too little for new partners"
    slid = s.communication.largest
    mine = [len(z.facets.slave.facets) for z in contact.zones][0]
    fetched = contact.zones[0].cpp.statistics()["master_facets"]
    row = {
        "partition": partition,
        "ranks": COMM.size,
        "slave_facets": s.slave_facets,
        "largest_share": COMM.allreduce(mine, op=MPI.MAX),
        "fetched_facets": COMM.allreduce(fetched, op=MPI.MAX),
        "pairs": s.pairs,
        "matrix_bytes": here.matrix_entries * MATRIX_BYTES,
        "vector_bytes": here.vector_entries * VECTOR_BYTES,
        "assembly_messages": here.entry_ranks,
        "slid_matrix_bytes": slid.matrix_entries * MATRIX_BYTES,
    }
    for name in ("messages", "bytes"):
        row[f"update_{name}"], _ = change(*small, f"value_{name}")
        row[f"renewal_{name}"], _ = change(*large, f"pairing_{name}")
    return row


if __name__ == "__main__":
    result = measure(int(sys.argv[1]), *(sys.argv[2:] or ["graph"]))
    if COMM.rank == 0:
        print(json.dumps(result))
