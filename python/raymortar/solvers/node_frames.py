"""Directions in which the law at a slave node determines its displacement."""

from __future__ import annotations

import numpy as np

from ..compat import Array
from ..discretization.joined import Places

# Share of a multiplier that its row leaves to forces, below which the row determines the
# displacement: 0 in closed contact, 1 in open contact, between them across the slip
DETERMINED = 0.5


class NodeFrames:
    """Splits the rows of slave nodes into those that determine displacements, and forces.

    Attributes
    ----------
    axes
        Orthonormal directions of the displacement, (nodes, m, m): row i is near the axis
        i, so that multigrid may take component by component.
    determined
        Which of these the law determines, (nodes, m).
    rows
        Combinations of the node's rows for each direction, (nodes, m, m): of the law,
        such that a translation answers with 1, or forces along it.
    forces
        Combinations that give the part of the multiplier which rows of forces tell.
    """

    def __init__(self, shares: Array, answers: Array) -> None:
        """Take each node's derivatives of its rows, (nodes, m, m): by the forces on it,
        and by a translation of the slave surface."""
        n, m, _ = shares.shape
        self.axes, self.rows, self.forces = (np.empty((n, m, m)) for _ in range(3))
        self.determined = np.zeros((n, m), dtype=bool)
        left, sizes, right = np.linalg.svd(shares)
        count = (sizes < DETERMINED).sum(axis=1)
        for k in range(m + 1):
            at = np.flatnonzero(count == k)
            self._take(at, m - k, left[at], sizes[at], right[at], answers[at])

    def _take(
        self,
        at: Places,
        f: int,
        left: Array,
        sizes: Array,
        right: Array,
        answers: Array,
    ) -> None:
        """Take nodes with f rows of forces."""
        rows = _t(left)
        law = rows[:, f:]
        forces = _t(right[:, :f]) @ (rows[:, :f] / sizes[:, :f, None])
        by_law = np.linalg.svd(law @ answers)[2]
        k = law.shape[1]
        order = np.argsort(-(by_law[:, :k] ** 2).sum(axis=1), axis=1, kind="stable")
        axes = np.empty_like(left)
        for own, place in (
            (by_law[:, :k], order[:, :k]),
            (by_law[:, k:], order[:, k:]),
        ):
            near = np.take_along_axis(_t(own), place[:, :, None], axis=1)
            np.put_along_axis(axes, place[:, :, None], _rotation(near) @ own, axis=1)
        found = axes @ forces
        if k:
            mine = np.take_along_axis(axes, order[:, :k, None], axis=1)
            scaled = np.linalg.solve(law @ answers @ _t(mine), law)
            np.put_along_axis(found, order[:, :k, None], scaled, axis=1)
            self.determined[at[:, None], order[:, :k]] = True
        self.axes[at], self.rows[at], self.forces[at] = axes, found, forces


def _t(matrices: Array) -> Array:
    return matrices.transpose(0, 2, 1)


def _rotation(matrices: Array) -> Array:
    """Find the orthogonal matrices that are nearest to some."""
    left, _, right = np.linalg.svd(matrices)
    return left @ right
