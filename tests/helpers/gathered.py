"""Arrays of all ranks on every rank: small systems, handled as if there were one.

Vectors and matrices are in the order of one rank's, all of the displacement and then
all of the multiplier; dofs and points are rank by rank. Everything is collective.
"""

from __future__ import annotations

from functools import lru_cache

from mpi4py import MPI

import numpy as np
from problems import COMM


def concatenated(values):
    """Rows of all ranks."""
    return np.concatenate(COMM.allgather(np.asarray(values)))


def everywhere(holds):
    """Whether something holds on all ranks."""
    return COMM.allreduce(bool(holds), op=MPI.LAND)


def found(values):
    """The different values on any rank, as a set."""
    return set().union(*COMM.allgather(set(np.unique(values).tolist())))


def dictionary(arrays):
    """Arrays of all ranks by their keys, which must be the same everywhere."""
    parts = COMM.allgather(arrays)
    return {key: np.concatenate([part[key] for part in parts]) for key in arrays}


def points(contact, zone=0):
    """`Contact.points` of all ranks. Facets keep the numbers of their rank."""
    return dictionary(contact.points(zone))


def owned(V, values):
    """Values at all ranks' owned block dofs, from local ones with ghosts, (n, ...)."""
    return concatenated(values[: V.dofmap.index_map.size_local])


def size_u(contact):
    """Number of unknowns of the displacement."""
    return COMM.allreduce(contact.layout.n_u)


@lru_cache(maxsize=4)
def _rows(layout):
    starts, ends = layout.ranges[:-1], layout.ranges[1:]
    middle = starts + COMM.allgather(layout.n)
    ranges = [*zip(starts, middle), *zip(middle, ends)]
    return np.concatenate([np.arange(*limits) for limits in ranges])


def rows(contact):
    """Rows of PETSc in the order of one rank's."""
    return _rows(contact.layout)


def vector(contact, x):
    """Entries of a PETSc vector of unknowns."""
    return concatenated(x.array)[rows(contact)]


def set_vector(contact, x, values):
    """Entries of a PETSc vector from those of all ranks."""
    every = np.empty(len(values))
    every[rows(contact)] = values
    x.array[:] = every[slice(*x.getOwnershipRange())]


def dense(A):
    """Entries of an assembled matrix, in PETSc's order."""
    n, m = A.getLocalSize()[0], A.getSize()[1]
    offsets, columns, values = A.getValuesCSR()
    K = np.zeros((n, m))
    K[np.repeat(np.arange(n), np.diff(offsets)), columns] = values
    return concatenated(K)


def assert_same(one, other):
    """Equal: but on several ranks PETSc sorts what comes from others before it adds,
    and takes it as it arrives, so that the last digit is a matter of chance."""
    size = np.abs(other).max(initial=0.0)
    np.testing.assert_allclose(
        one, other, rtol=0.0, atol=0.0 if COMM.size == 1 else 1e-14 * size
    )
