"""Types, versions and vectors that all of compat uses."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import dolfinx
import numpy as np
import numpy.typing as npt
import ufl

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int32]
Mask = npt.NDArray[np.bool_]

# UFL lost its own element classes when Basix took them over (DOLFINx 0.8).
HAS_UFL_ELEMENTS = hasattr(ufl, "VectorElement")


def unwrap(wrapped: Any) -> Any:
    """C++ object behind a Python one; the object itself where it is the C++ one."""
    return getattr(wrapped, "_cpp_object", wrapped)


def table(adjacency: Any, width: int) -> Indices:
    """Rows of equal length as an array (n, width); 0.5 has adjacency lists."""
    return np.asarray(getattr(adjacency, "array", adjacency)).reshape(-1, width)


def scalar_type_is_real() -> bool:
    """Whether PETSc was built for real numbers."""
    return not np.issubdtype(PETSc.ScalarType, np.complexfloating)


def create_la_vector(index_map: Any, bs: int = 1) -> Any:
    """Zero ``dolfinx.la`` vector of doubles over an index map with a block size."""
    if hasattr(index_map, "create_vector"):  # of several meshes
        return index_map.create_vector(bs)
    return dolfinx.la.vector(index_map, bs, dtype=np.float64)


def scatter_forward(vector: Any) -> None:
    """Send the owners' values to the ghosts. Collective."""
    vector.scatter_forward()


def scatter_reverse_add(vector: Any) -> None:
    """Add the ghosts' values to their owners'. Collective.

    Ghosts keep theirs: follow with :func:`scatter_forward` where they are read.
    """
    modes = getattr(dolfinx.la, "InsertMode", None) or dolfinx.la.ScatterMode
    vector.scatter_reverse(modes.add)
