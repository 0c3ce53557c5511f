"""What all of compat asks of the generation that is installed."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

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
