"""Numbering of the coupled unknowns, rank by rank: [displacement | multiplier]."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function, FunctionSpace

from mpi4py import MPI
from petsc4py import PETSc

from . import compat
from .compat import Array, Indices

Global = npt.NDArray[np.int64]


def _spread(index_map: Any, owned: npt.ArrayLike) -> Array:
    """Owners' values on owned and ghost entries; numbers up to 2^53 stay exact."""
    vector = compat.create_la_vector(index_map, 1)
    vector.array[: index_map.size_local] = owned
    compat.scatter_forward(vector)
    return vector.array.copy()


def marked_everywhere(V: FunctionSpace, dofs: Indices) -> npt.NDArray[np.bool_]:
    """Block dofs (owned, then ghosts) that any rank has in `dofs`. Collective."""
    vector = compat.create_la_vector(V.dofmap.index_map, 1)
    vector.array[dofs] = 1.0
    compat.scatter_reverse_add(vector)
    compat.scatter_forward(vector)
    return vector.array > 0.5


class Layout:
    """Rows of the coupled system on every rank.

    Parameters
    ----------
    u
        Displacement.
    multiplier
        Multiplier, or None.
    multiplier_dofs
        Local block dofs of the multiplier's space on this rank's slave facets. Only
        dofs of slave surfaces become unknowns.

    Attributes
    ----------
    size
        Owned rows of this rank.
    ranges
        First row of each rank, then the number of rows, int64.
    owned_multipliers
        Owned block dofs of the multiplier that are unknowns, in the order of their rows.
    u_rows
        Global row of the first component of every local block dof of u, int64.
    multiplier_rows
        The same for the multiplier; -1 off the slave surface.
    """

    def __init__(
        self, u: Function, multiplier: Function | None, multiplier_dofs: Indices
    ) -> None:
        self.u, self.multiplier = u, multiplier
        V = u.function_space
        self.comm: MPI.Comm = V.mesh.comm
        self._u_map, self._bs = V.dofmap.index_map, V.dofmap.index_map_bs
        self.n_u = self._u_map.size_local * self._bs
        self.owned_multipliers = np.empty(0, dtype=np.int32)
        self.components = 0
        if multiplier is not None:
            W = multiplier.function_space
            marked = marked_everywhere(W, multiplier_dofs)
            owned = W.dofmap.index_map.size_local
            self.owned_multipliers = np.flatnonzero(marked[:owned]).astype(np.int32)
            self.components = W.dofmap.index_map_bs
        self.size = self.n_u + len(self.owned_multipliers) * self.components
        ends = np.cumsum(self.comm.allgather(self.size), dtype=np.int64)
        self.ranges = np.concatenate([np.zeros(1, dtype=np.int64), ends])
        self.begin = int(self.ranges[self.comm.rank])
        self.u_rows = self._number(
            self._u_map, np.arange(self._u_map.size_local), self._bs, self.begin
        )
        self.multiplier_rows = np.empty(0, dtype=np.int64)
        if multiplier is not None:
            W_map = multiplier.function_space.dofmap.index_map
            self.multiplier_rows = self._number(
                W_map, self.owned_multipliers, self.components, self.begin + self.n_u
            )

    @staticmethod
    def _number(index_map: Any, owned: Indices, width: int, begin: int) -> Global:
        """Rows of the owned dofs in order, -1 for the rest, sent to the ghosts."""
        rows = np.full(index_map.size_local, -1.0)
        rows[owned] = begin + width * np.arange(len(owned))
        return _spread(index_map, rows).astype(np.int64)

    @property
    def size_global(self) -> int:
        """Number of unknowns on all ranks. Collective."""
        return self.comm.allreduce(self.size)

    def create_vector(self) -> PETSc.Vec:
        """Zero vector over the coupled rows."""
        return PETSc.Vec().createMPI((self.size, None), comm=self.comm)

    def create_matrix(self) -> PETSc.Mat:
        """Empty AIJ matrix whose local-to-global map covers the displacement."""
        A = PETSc.Mat().create(self.comm)
        A.setSizes(((self.size, None), (self.size, None)))
        A.setType(PETSc.Mat.Type.AIJ)
        # Multigrid wants to know which rows are of one node; rows of multipliers fit
        # into no block
        bs = self._bs if self.multiplier is None else 1
        A.setBlockSize(bs)
        rows = self.u_rows[:, None] + np.arange(0, self._bs, bs)
        blocks = (rows.ravel() // bs).astype(PETSc.IntType)
        lgmap = PETSc.LGMap().create(blocks, bsize=bs, comm=self.comm)
        A.setLGMap(lgmap, lgmap)
        return A

    def coupled_columns(self, columns: npt.ArrayLike) -> Indices:
        """From global columns of DOLFINx's matrix of u to the coupled numbering."""
        starts = np.array(self.comm.allgather(self._u_map.local_range[0]))
        columns = np.asarray(columns, dtype=np.int64)
        # A rank without dofs shares its start with the next one: take the last
        rank = np.searchsorted(self._bs * starts, columns, side="right") - 1
        return (columns - self._bs * starts[rank] + self.ranges[rank]).astype(np.int32)

    def to_vector(self, x: PETSc.Vec, scale: float) -> None:
        """Functions to the solver's unknowns; the multiplier is divided by scale."""
        array = x.getArray()
        array[: self.n_u] = self.u.x.array[: self.n_u]
        if self.multiplier is not None:
            values = self.multiplier.x.array.reshape(-1, self.components)
            array[self.n_u :] = values[self.owned_multipliers].ravel() / scale

    def from_vector(self, x: PETSc.Vec, scale: float) -> None:
        """Solver's unknowns to the functions, ghosts included. Collective."""
        array = x.getArray(readonly=True)
        self.u.x.array[: self.n_u] = array[: self.n_u]
        compat.scatter_forward(self.u.x)
        if self.multiplier is not None:
            values = self.multiplier.x.array.reshape(-1, self.components)
            values[self.owned_multipliers] = scale * array[self.n_u :].reshape(
                -1, self.components
            )
            compat.scatter_forward(self.multiplier.x)
