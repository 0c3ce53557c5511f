"""Marks on block dofs, shared by all ranks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace

from .. import compat
from ..compat import Indices

Marks = npt.NDArray[np.bool_]


def marked_everywhere(
    V: FunctionSpace, dofs: Indices, marks: Marks | None = None
) -> Marks:
    """Block dofs (owned, then ghosts) that any rank has marked. Collective.

    Parameters
    ----------
    V
        Space of the dofs.
    dofs
        Local block dofs to mark, (n,). A dof may occur more than once.
    marks
        Which of their components to mark, (n, d); None: the block dofs themselves.

    Returns
    -------
    (block dofs,), or (block dofs, d) where marks are given.
    """
    d = 1 if marks is None else marks.shape[1]
    vector = compat.create_la_vector(V.dofmap.index_map, d)
    vector.array.reshape(-1, d)[dofs] = 1.0 if marks is None else marks
    compat.scatter_reverse_add(vector)
    compat.scatter_forward(vector)
    found: Marks = vector.array > 0.5
    return found if marks is None else found.reshape(-1, d)
