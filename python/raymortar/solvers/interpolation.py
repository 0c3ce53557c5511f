"""Interpolation between displacements of degree 1 and of a higher one on one mesh."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from .. import compat
from ..compat import Array, Mask
from ..host.ranks import marked_everywhere


class LinearInterpolation:
    """Values of continuous functions of degree 1 at the nodes of a higher degree.

    Collective. Nodes are those of Lagrange elements: a node of the higher degree takes
    the shape functions of degree 1 at its place in a cell that has it. Prescribed dofs
    take nothing, and prescribed dofs of vertices give nothing. So the product P^T S P
    is the tangent with the conditions, except for its diagonal.

    Parameters
    ----------
    V
        Vector space of degree 2 or more.
    fixed
        Whether an owned dof of V is prescribed, (n,), unrolled.

    Attributes
    ----------
    W
        Space of degree 1.
    matrix
        P, from the owned dofs of W to those of V.
    fixed
        Whether an owned dof of W is prescribed.
    """

    def __init__(self, V: Any, fixed: Mask) -> None:
        self.W = compat.vector_space(V.mesh, 1)
        self._bs = V.dofmap.index_map_bs
        fine, coarse, values = _weights_by_cell(V, self.W)
        bs, n = self._bs, V.dofmap.index_map.size_local
        on_fine = marked_everywhere(V, np.arange(n), fixed.reshape(n, bs))
        vertices = values == 1.0
        on_coarse = marked_everywhere(self.W, coarse[vertices], on_fine[fine[vertices]])
        self.fixed = on_coarse[: self.W.dofmap.index_map.size_local].ravel()
        free = ~on_fine[fine] & ~on_coarse[coarse]
        self.matrix = self._assembled(V, fine, coarse, values[:, None] * free)

    def _assembled(
        self, V: Any, fine: Array, coarse: Array, values: Array
    ) -> PETSc.Mat:
        """P from its entries by block dofs; of owned ones each row once, in order.

        Entries of prescribed dofs are kept as zeros: all rows of a node have the same
        columns, as relaxation by nodes and the product's diagonal need.
        """
        bs, n = self._bs, V.dofmap.index_map.size_local
        numbers = _numbers(self.W)[coarse]
        counts = np.repeat(np.bincount(fine, minlength=n), bs)
        offsets = np.concatenate([[0], np.cumsum(counts)])
        # Entries of a block dof follow each other: those of component k are the k-th run
        begin = np.concatenate([[0], np.cumsum(np.bincount(fine, minlength=n))])
        place = np.arange(len(fine)) - begin[fine]
        columns = np.empty(offsets[-1], dtype=PETSc.IntType)
        entries = np.empty(offsets[-1])
        for k in range(bs):
            at = offsets[bs * fine + k] + place
            columns[at], entries[at] = bs * numbers + k, values[:, k]
        P = PETSc.Mat().create(V.mesh.comm)
        owned = self.W.dofmap.index_map.size_local
        P.setSizes(((bs * n, None), (bs * owned, None)), bsize=(bs, bs))
        P.setType(PETSc.Mat.Type.AIJ)
        P.setPreallocationCSR((offsets.astype(PETSc.IntType), columns, entries))
        P.assemble()
        return P

    def product(self, S: PETSc.Mat, result: PETSc.Mat | None = None) -> PETSc.Mat:
        """P^T S P, regular at prescribed dofs. Collective.

        Parameters
        ----------
        S
            Matrix over the owned dofs of V.
        result
            Product of a matrix with the same pattern, to be overwritten.
        """
        T = S.PtAP(self.matrix, result)
        diagonal = T.getDiagonal()
        size = diagonal.norm(PETSc.NormType.NORM_INFINITY)
        diagonal.array[self.fixed] = size
        T.setDiagonal(diagonal)
        diagonal.destroy()
        return T

    def destroy(self) -> None:
        """Free the matrix. Collective."""
        self.matrix.destroy()


def _weights_by_cell(V: Any, W: Any) -> tuple[Any, Any, Array]:
    """Entries of the interpolation: owned block dofs of V in order, local block dofs of
    W, and the shape functions that do not vanish. Each dof of V takes one of its
    cells."""
    points = compat.element_points(V)
    N = compat.tabulate(compat.cell_name(V.mesh), 1, points)[0]
    N[np.isclose(N, 0.0)], N[np.isclose(N, 1.0)] = 0.0, 1.0
    table, coarse = compat.dofmap_array(V), compat.dofmap_array(W)
    dofs, first = np.unique(table, return_index=True)
    owned = dofs < V.dofmap.index_map.size_local
    dofs, first = dofs[owned], first[owned]
    cells, nodes = np.divmod(first, table.shape[1])
    row, b = np.nonzero(N[nodes])
    return dofs[row], coarse[cells[row], b], N[nodes[row], b]


def _numbers(W: Any) -> npt.NDArray[np.int64]:
    """Global number of each local block dof."""
    return compat.local_to_global(W.dofmap.index_map)
