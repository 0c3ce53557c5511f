"""Numbering of the coupled unknowns, rank by rank: [forms | multipliers | bodies].

Unknowns of the forms are what the user solves for, the displacement among them. Multipliers
of several contacts follow in the order of the contacts. Rigid bodies that are free are
on the first rank.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function

from ... import _cpp
from .. import compat
from ..compat import Indices
from ..target import Target
from .ranks import marked_everywhere
from .unknowns import Unknowns

Global = npt.NDArray[np.int64]


class CoupledRows:
    """Numbers the rows of the coupled system of some contacts. Collective.

    Attributes
    ----------
    size
        Owned rows of this rank.
    n
        How many of them are of the forms, which come first.
    n_u
        How many of these are displacements.
    ranges
        First row of each rank, then the number of rows, int64.
    rows
        Global row of every local unknown of the forms, see `Unknowns`, int64.
    u_rows
        Global rows of the components of every local block dof of u, (dofs, d), int64.
    bodies
        Rigid bodies that are free.
    body_rows
        Global rows of the unknowns of each of these, int64.
    more_than_forms
        Whether any rank has rows of multipliers or free rigid bodies.
    made_values
        `values` of the present rows, once they have been asked for.
    """

    bodies: tuple[Target, ...]

    def __init__(self, unknowns: Unknowns, layouts: Sequence[Layout]) -> None:
        self.unknowns, self.u = unknowns, unknowns.u
        self.comm: MPI.Comm = unknowns.comm
        self._u_map, self._bs = compat.unknowns_of(self.u)
        self.n_u = self._u_map.size_local * self._bs
        self.layouts = tuple(layouts)
        self.bodies = tuple(dict.fromkeys(b for one in layouts for b in one.bodies))
        self.body_rows: dict[Target, Global] = {}
        self.number()

    @property
    def own_bodies(self) -> tuple[Target, ...]:
        """The free bodies whose rows are on this rank."""
        return self.bodies if self.comm.rank == 0 else ()

    def number(self) -> None:
        """Number all rows, with the present unknowns of the forms. Collective."""
        sizes: list[int] = [layout.owned_size for layout in self.layouts]
        for layout, begin in zip(self.layouts, np.cumsum([0, *sizes])):
            layout.bodies = self.bodies
            layout.place(int(begin), sum(sizes))
        self._number_forms(sum(sizes))

    def _number_forms(self, multipliers: int) -> None:
        """Number the present unknowns of the forms, and leave room for this rank's
        multipliers behind them. Collective."""
        starts = self.unknowns.owned_starts
        self.made_values: _cpp.CoupledValues | None = None
        self.n = int(starts[-1])
        self.size = self.n + multipliers + sum(len(b.freedom) for b in self.own_bodies)
        mine = self.size, self.size - self.n
        sizes = np.array(self.comm.allgather(mine), dtype=np.int64)
        self.more_than_forms = bool(sizes[:, 1].any())
        self._form_ranges = np.cumsum([0, *(sizes[:, 0] - sizes[:, 1])])
        ends = np.cumsum(sizes[:, 0])
        self.ranges = np.concatenate([np.zeros(1, dtype=np.int64), ends])
        self.begin = int(self.ranges[self.comm.rank])
        end = int(self.ranges[1])
        for body in reversed(self.bodies):
            self.body_rows[body] = np.arange(end - len(body.freedom), end)
            end -= len(body.freedom)
        parts = []
        for f, start in zip(self.unknowns.functions, starts):
            index_map, bs = compat.unknowns_of(f)
            owned = np.arange(index_map.size_local)
            first = self._number(index_map, owned, bs, self.begin + int(start))
            parts.append((first[:, None] + np.arange(bs)).ravel())
        self.rows = np.concatenate(parts)
        self.u_rows = self.rows[self.unknowns.u_local].reshape(-1, self._bs)

    @staticmethod
    def _number(index_map: Any, owned: Indices, width: int, begin: int) -> Global:
        """Rows of all local dofs: owned ones are numbered in order, ghosts get the
        owner's row, others -1."""
        rows = compat.create_la_vector(index_map)  # exact up to 2^53
        rows.array[:] = -1.0
        rows.array[owned] = begin + width * np.arange(len(owned))
        compat.scatter_forward(rows)
        return rows.array.astype(np.int64)

    @property
    def size_global(self) -> int:
        """Number of unknowns on all ranks. Collective."""
        return self.comm.allreduce(self.size)

    def create_vector(self) -> PETSc.Vec:
        """Zero vector over the coupled rows."""
        return PETSc.Vec().createMPI((self.size, None), comm=self.comm)

    def create_form_vector(self) -> PETSc.Vec:
        """Zero vector over the rows of the forms, with DOLFINx's layout and ghosts: of
        several unknowns that of its block vectors. Collective."""
        starts = self.unknowns.owned_starts
        sizes = [len(f.x.array) for f in self.unknowns.functions]
        of_each = np.split(self.rows, np.cumsum(sizes)[:-1])
        ghosts = np.concatenate(
            [rows[owned:] for rows, owned in zip(of_each, np.diff(starts))]
        )
        rank = np.searchsorted(self.ranges, ghosts, side="right") - 1
        ghosts += self._form_ranges[rank] - self.ranges[rank]
        bs = self._bs if self.unknowns.is_plain else 1
        blocks = (ghosts[::bs] // bs).astype(PETSc.IntType)
        return PETSc.Vec().createGhost(blocks, (self.n, None), bs, comm=self.comm)

    def create_matrix(self) -> PETSc.Mat:
        """Empty AIJ matrix whose local-to-global map covers the unknowns of the forms."""
        A = PETSc.Mat().create(self.comm)
        A.setSizes(((self.size, None), (self.size, None)))
        A.setType(PETSc.Mat.Type.AIJ)
        # Multigrid needs to know which rows belong to one node. Rows of multipliers and
        # rigid bodies fit into no block
        plain = not self.more_than_forms and self.unknowns.is_plain
        bs = self._bs if plain else 1
        A.setBlockSize(bs)
        blocks = (self.rows[::bs] // bs).astype(PETSc.IntType)
        lgmap = PETSc.LGMap().create(blocks, bsize=bs, comm=self.comm)
        A.setLGMap(lgmap, lgmap)
        return A

    @property
    def values(self) -> _cpp.CoupledValues:
        """Moves values between Functions and vectors of unknowns."""
        if self.made_values is None:
            functions = self.unknowns.functions
            self.made_values = _cpp.CoupledValues(
                self.comm.py2f(),
                [f.x.array for f in functions],
                np.diff(self.unknowns.owned_starts).tolist(),
                self.rows,
                [layout.multiplier_values() for layout in self.layouts],
                [_cpp.BodyValues(b.cpp, self.body_rows[b]) for b in self.bodies],
            )
        return self.made_values

    def to_vector(self, x: PETSc.Vec, scales: float | Sequence[float]) -> None:
        """Copy Functions to the solver's unknowns; divide each multiplier by its
        scale."""
        self.values.to_vector(x.handle, np.atleast_1d(scales).tolist())

    def from_vector(self, x: PETSc.Vec, scales: float | Sequence[float]) -> None:
        """Copy the solver's unknowns to the functions, ghosts included. Collective."""
        self.values.from_vector(x.handle, np.atleast_1d(scales).tolist())
        self.unknowns.pull()

    def coupled_columns(self, columns: npt.ArrayLike, k: int = 0) -> Indices:
        """Coupled columns for global columns of DOLFINx's matrix of the k-th
        Function. Collective."""
        index_map, bs = compat.unknowns_of(self.unknowns.functions[k])
        first = self.begin + int(self.unknowns.owned_starts[k])
        here = np.array([bs * index_map.local_range[0], first])
        starts, firsts = np.array(self.comm.allgather(here)).T
        columns = np.asarray(columns, dtype=np.int64)
        # A rank without dofs shares its start with the next one: take the last
        rank = np.searchsorted(starts, columns, side="right") - 1
        return (columns - starts[rank] + firsts[rank]).astype(np.int32)


class Layout(CoupledRows):
    """Rows of the coupled system of one contact, alone or among others. Collective.

    Attributes
    ----------
    owned_multipliers
        Owned block dofs of the multiplier that are unknowns, in the order of their rows.
    owned_size
        Number of their rows.
    multiplier_rows
        Global row of the first component of every local block dof of the multiplier;
        -1 off the slave surface.
    """

    def __init__(
        self,
        unknowns: Unknowns,
        multiplier: Function | None,
        multiplier_dofs: Indices,
        bodies: Sequence[Target] = (),
    ) -> None:
        self.bodies = tuple(bodies)
        self.multiplier = multiplier
        self.owned_multipliers = np.empty(0, dtype=np.int32)
        self.components = 0
        if multiplier is not None:
            W = multiplier.function_space
            marked = marked_everywhere(W, multiplier_dofs)
            owned = W.dofmap.index_map.size_local
            self.owned_multipliers = np.flatnonzero(marked[:owned]).astype(np.int32)
            self.components = W.dofmap.index_map_bs
        self.owned_size: int = len(self.owned_multipliers) * self.components
        super().__init__(unknowns, [self])

    def number(self) -> None:
        """Number the rows of a contact alone. Collective."""
        self.place(0, self.owned_size)

    def place(self, before: int, multipliers: int) -> None:
        """Number the rows of all unknowns of the forms. Collective.

        Parameters
        ----------
        before
            This rank's rows of multipliers of other contacts before those of this one.
        multipliers
            This rank's rows of the multipliers of all contacts.
        """
        self._number_forms(multipliers)
        self.multiplier_rows = np.empty(0, dtype=np.int64)
        if self.multiplier is not None:
            W_map = self.multiplier.function_space.dofmap.index_map
            self.multiplier_rows = self._number(
                W_map,
                self.owned_multipliers,
                self.components,
                self.begin + self.n + before,
            )

    def multiplier_values(self) -> _cpp.MultiplierValues:
        """Values and rows of the multiplier; none with a penalty."""
        if self.multiplier is None:
            return _cpp.MultiplierValues()
        return _cpp.MultiplierValues(
            self.multiplier.x.array,
            self.owned_multipliers,
            self.multiplier_rows,
            self.components,
        )
