"""Dirichlet conditions: what they prescribe, and lifting."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from ..errors import ContactError
from .generation import Array
from .spaces import contains

# Of a value, what ranks that share a dof may differ by
ROUNDING = 8.0 * float(np.finfo(float).eps)


def apply_lifting(
    b: Array, a: Any, bcs: Sequence[Any], x0: Array, scale: float
) -> None:
    """b <- b - scale A (g - x0) over the constrained columns of A; ghosted arrays.

    Parameters
    ----------
    b
        Array to change; ghosts are not sent home.
    a
        Compiled bilinear form of A.
    bcs
        Dirichlet conditions on the form's trial space: the values g.
    x0
        Present solution.
    scale
        Factor; -1 for the residual of Newton's method.
    """
    fem.apply_lifting(b, [a], [list(bcs)], [x0], scale)


def set_bc(
    b: Array, bcs: Sequence[Any], x0: Array | None = None, scale: float = 1.0
) -> None:
    """b = scale (g - x0) at the constrained dofs; ghosted arrays, x0 0 by default."""
    if hasattr(fem, "set_bc"):
        fem.set_bc(b, bcs, x0, scale)
        return
    for bc in bcs:
        bc.set(b, x0, scale)


def dirichlet_dofs(
    bcs: Sequence[Any], V: fem.FunctionSpace
) -> tuple[npt.NDArray[np.int8], Array]:
    """Constrained dofs of a space and their values.

    Parameters
    ----------
    bcs
        Dirichlet conditions on V or on components of it.
    V
        Space of the unknown.

    Returns
    -------
    marker, values
        Ghosted arrays: 1 where constrained, and the value g there (0 elsewhere).

    Raises
    ------
    ContactError
        If a condition is on another space: DOLFINx would silently pass over it.
    """
    for i, bc in enumerate(bcs):
        if not hasattr(bc, "dof_indices"):
            raise ContactError(
                f"boundary condition {i} is no Dirichlet condition, but {bc!r}"
            )
        if not has_condition(V, bc):
            raise ContactError(
                f"boundary condition {i} is not on the space of the displacement: "
                "make it with u.function_space or a sub-space of it"
            )
    return prescribed_values(bcs, V.dofmap.index_map, V.dofmap.index_map_bs)


def has_condition(V: fem.FunctionSpace, bc: Any) -> bool:
    """Whether a Dirichlet condition is on a space or a part of it."""
    return contains(V, bc.function_space)


def prescribed_values(
    bcs: Sequence[Any], index_map: Any, bs: int
) -> tuple[npt.NDArray[np.int8], Array]:
    """Ghosted arrays of what conditions on one space prescribe, as `dirichlet_dofs`."""
    values = np.zeros((index_map.size_local + index_map.num_ghosts) * bs)
    marker = np.zeros(len(values), dtype=np.int8)
    for bc in bcs:
        marker[bc.dof_indices()[0]] = 1
    set_bc(values, bcs)
    return marker, values


def dirichlet_increment(bcs: Sequence[Any], x0: Array) -> Array:
    """g - x0 at the constrained dofs, 0 elsewhere and where it is rounding; ghosted."""
    increment = np.zeros_like(x0)
    set_bc(increment, bcs, x0)
    return without_rounding(increment, x0)


def without_rounding(increment: Array, x0: Array) -> Array:
    """An increment of x0, 0 where it is rounding: ranks that share a dof may find its
    value in different cells."""
    found = increment.copy()
    found[np.abs(increment) <= ROUNDING * np.abs(x0)] = 0.0
    return found
