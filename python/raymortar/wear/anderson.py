"""Acceleration of fixed points, on several ranks."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Mask

# Earlier iterates that are combined
MOST = 8
# Singular values below this, relative to the largest, are of no use
LEAST = 1e-12
# Growth of the residual from which on earlier iterates are of no use
GROWTH = 2.0


class Anderson:
    """Anderson's method: steps that combine the residuals of earlier iterates.

    For linear equations it is GMRES: it converges where the plain iteration does not
    (Walker & Ni 2011). Weights (owned,) are those of the squares of the owned values.
    """

    def __init__(self, comm: MPI.Comm, weights: Array) -> None:
        self._comm, self._root = comm, np.sqrt(weights)
        self._iterates: list[tuple[Array, Array]] = []
        self.start()

    def start(self) -> None:
        """Forget all iterates."""
        self._iterates.clear()
        self.count = 0  # iterates so far
        self._branch: Mask | None = None
        self._size = np.inf

    def next(self, x: Array, r: Array, branch: Mask) -> Array:
        """Make the next iterate from the present one and its residual. Collective.

        Arrays have all local values, owned ones first. Earlier iterates are forgotten
        where they are on another branch, as with other points open, or were better.
        """
        self.count += 1
        n = len(self._root)
        scaled = r[:n] * self._root
        size = np.sqrt(self._comm.allreduce(scaled @ scaled))
        same = self._branch is not None and np.array_equal(branch, self._branch)
        if not (self._comm.allreduce(same, op=MPI.LAND) and size < GROWTH * self._size):
            self._iterates.clear()
        self._branch, self._size = branch.copy(), size
        self._iterates = [*self._iterates, (x.copy(), r.copy())][-MOST - 1 :]
        found = x + r
        if len(self._iterates) == 1:
            return found
        dx, dr = (np.diff(one, axis=0) for one in zip(*self._iterates))
        differences = dr[:, :n] * self._root
        products = np.column_stack([differences @ differences.T, differences @ scaled])
        self._comm.Allreduce(MPI.IN_PLACE, products)
        shares = np.linalg.lstsq(products[:, :-1], products[:, -1], rcond=LEAST)[0]
        accelerated: Array = found - shares @ (dx + dr)
        return accelerated
