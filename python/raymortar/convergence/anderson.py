"""Acceleration of fixed points, on several ranks."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..compat import Array

# Earlier iterates that are combined
MOST = 8
# Singular values below this, relative to the largest, are of no use
LEAST = 1e-10


class Anderson:
    """Anderson's method: steps that combine the residuals of earlier iterates.

    Of linear equations it is GMRES, so it converges where the plain iteration does not
    (Walker & Ni 2011).

    Parameters
    ----------
    comm
        Communicator.
    weights
        Of the squares of the owned values, (owned,).
    """

    def __init__(self, comm: MPI.Comm, weights: Array) -> None:
        self._comm, self._root = comm, np.sqrt(weights)
        self._iterates: list[tuple[Array, Array]] = []
        self.count = 0  # iterates since `start`

    def start(self) -> None:
        """Forget all iterates."""
        self._iterates.clear()
        self.count = 0

    def next(self, x: Array, r: Array) -> Array:
        """Make the next iterate from the present one and its residual. Collective.

        Both are of all local values, owned ones first.
        """
        self.count += 1
        self._iterates = [*self._iterates, (x.copy(), r.copy())][-MOST - 1 :]
        found = x + r
        if len(self._iterates) == 1:
            return found
        dx, dr = (np.diff(one, axis=0) for one in zip(*self._iterates))
        n = len(self._root)
        scaled = dr[:, :n] * self._root
        products = np.column_stack([scaled @ scaled.T, scaled @ (r[:n] * self._root)])
        self._comm.Allreduce(MPI.IN_PLACE, products)
        shares = np.linalg.lstsq(products[:, :-1], products[:, -1], rcond=LEAST)[0]
        accelerated: Array = found - shares @ (dx + dr)
        return accelerated
