"""Boxes around points of all ranks."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..compat import Array


def ends_of(x: Array, comm: MPI.Comm) -> Array:
    """Least and largest coordinates of points (n, d) of all ranks, (2, d). Collective."""
    ends = np.stack([x.min(axis=0, initial=np.inf), -x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
    return np.stack([ends[0], -ends[1]])
