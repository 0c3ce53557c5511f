"""Constraints as a user gives them: which rows are slaves, and of which masters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from scipy.sparse import issparse

from ..core import compat
from ..core.compat import Array
from ..core.errors import ContactError, described, together

Global = npt.NDArray[np.int64]

_NEEDED = ("slaves", "masters", "coefficients", "function_space")


@dataclass(frozen=True)
class Slaves:
    """Entries of slaves that this rank owns: x of a row is the sum of value times x of
    master. Rows are of the coupled system.

    Attributes
    ----------
    rows, masters, values
        A slave has an entry for each of its masters, (entries,).
    """

    rows: Global
    masters: Global
    values: Array

    def joined(self, other: Slaves) -> Slaves:
        """These slaves and others."""
        return Slaves(
            np.concatenate([self.rows, other.rows]),
            np.concatenate([self.masters, other.masters]),
            np.concatenate([self.values, other.values]),
        )


def slaves_of(given: Any, system: Any) -> Slaves:
    """Find the slaves of a `dolfinx_mpc.MultiPointConstraint`, or of a matrix T over the
    displacement's dofs. Collective."""
    if isinstance(given, PETSc.Mat) or issparse(given):
        return _of_matrix(given, system)
    with together(system.comm):
        if not all(hasattr(type(given), name) for name in _NEEDED):
            raise ContactError(
                "constraints must be a dolfinx_mpc.MultiPointConstraint, or a sparse "
                f"matrix T over the displacement's dofs, not {described(given)}"
            )
        if not given.finalized:
            raise ContactError(
                "constraints is not finalized: call its finalize() first"
            )
        V = given.function_space
        k = _function_of(V, system.unknowns)
    index_map, bs = V.dofmap.index_map, V.dofmap.index_map_bs
    slaves = np.asarray(given.slaves, dtype=np.int64)
    slaves = np.unique(slaves[slaves < bs * index_map.size_local])
    coefficients, offsets = given.coefficients()
    links = [np.asarray(given.masters.links(int(s))) for s in slaves]
    counts = np.array([len(one) for one in links], dtype=np.int64)
    masters = np.concatenate([np.empty(0, dtype=np.int64), *links]).astype(np.int64)
    numbers = index_map.local_to_global((masters // bs).astype(np.int32))
    values = [coefficients[offsets[s] : offsets[s + 1]] for s in slaves]
    start = bs * index_map.local_range[0]
    _check_entries(
        system.comm,
        start + np.repeat(slaves, counts),
        masters,
        np.concatenate([np.empty(0), *values]),
    )
    columns = system.layout.coupled_columns(bs * numbers + masters % bs, k)
    first = system.layout.begin + int(system.unknowns.owned_starts[k])
    return Slaves(
        np.repeat(first + slaves, counts),
        columns.astype(np.int64),
        np.concatenate([np.empty(0), *values]),
    )


def _function_of(V: Any, unknowns: Any) -> int:
    """Number of the unknown that a space is of, on this rank."""
    for k, f in enumerate(unknowns.functions):
        W = f.function_space
        if compat.on_mesh(f, V.mesh) and W.ufl_element() == V.ufl_element():
            return k
    names = ", ".join(f.name for f in unknowns.functions)
    raise ContactError(
        f"constraints is of the space of none of the unknowns [{names}]: make it with "
        "that of one of them"
    )


def _check_entries(comm: Any, rows: Global, columns: Global, values: Array) -> None:
    """Raise for entries that are complex or not finite. Collective."""
    with together(comm):
        if np.iscomplexobj(values):
            raise ContactError("constraints has complex entries: give it real ones")
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            k = int(wrong[0])
            raise ContactError(
                f"constraints has the entry {values[k]} in row {rows[k]}, column "
                f"{columns[k]}: give it finite ones"
            )


def _of_matrix(T: Any, system: Any) -> Slaves:
    """Slaves are the rows that are no rows of the identity."""
    layout, unknowns = system.layout, system.unknowns
    index_map, bs = compat.unknowns_of(unknowns.functions[0])
    n, size = bs * index_map.size_local, bs * index_map.size_global
    begin = bs * index_map.local_range[0]
    with together(system.comm):
        if len(unknowns.functions) > 1:
            raise ContactError(
                "constraints as a matrix is for a single unknown: give a "
                "dolfinx_mpc.MultiPointConstraint"
            )
        shape = tuple(T.getSize()) if isinstance(T, PETSc.Mat) else T.shape
        if shape != (size, size):
            raise ContactError(
                f"constraints has the shape {shape}: T must be square, {size} x {size}, "
                "with a row of the identity for each dof that is no slave"
            )
    if isinstance(T, PETSc.Mat):
        offsets, columns, values = T.getValuesCSR()
    else:
        own = T.tocsr()[begin : begin + n]
        offsets, columns, values = own.indptr, own.indices, own.data
    rows = np.repeat(np.arange(n), np.diff(offsets))
    columns, used = np.asarray(columns, dtype=np.int64), values != 0.0
    rows, columns, values = rows[used], columns[used], np.asarray(values)[used]
    _check_entries(system.comm, begin + rows, columns, values)
    counts = np.bincount(rows, minlength=n)
    on_diagonal = columns == begin + rows
    is_one = on_diagonal & (values == 1.0)
    free = np.zeros(n, dtype=bool)
    free[rows[is_one & (counts[rows] == 1)]] = True
    with together(system.comm):
        if np.any(counts == 0):
            at = int(np.flatnonzero(counts == 0)[0]) + begin
            raise ContactError(
                f"row {at} of constraints is empty: prescribe a zero by bcs, and give each "
                "other dof a row"
            )
        own = on_diagonal & ~free[rows]
        if np.any(own):
            k = int(np.flatnonzero(own)[0])
            raise ContactError(
                f"row {begin + rows[k]} of constraints has {values[k]:.6g} on the diagonal, "
                "as if a slave had itself for a master: the row of a slave has its masters "
                "alone, that of any other dof 1 and nothing else"
            )
    mine = ~free[rows]
    found = layout.coupled_columns(columns[mine])
    return Slaves(
        (layout.begin + rows[mine]).astype(np.int64),
        found.astype(np.int64),
        values[mine].astype(np.float64),
    )
