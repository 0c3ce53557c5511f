"""The displacement as a user gives it, mesh by mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function

from .. import compat
from ..errors import ContactError

Places = npt.NDArray[np.int64]


class Displacement:
    """A displacement on one mesh.

    Parameters
    ----------
    given
        A Function on a space of its own, or a part of a mixed one such as ``w.sub(0)``.

    Attributes
    ----------
    u
        The displacement on its own space: the user's Function, or a copy of the part.
    component
        Number of the part of a mixed Function. None if it is no part.
    at
        Number of the host's Function that has it.
    """

    def __init__(self, given: Function, at: int) -> None:
        self.given, self.u, self.at = given, given, at
        self.component: int | None = None
        self._dofs: Places | None = None
        V = given.function_space
        if compat.element_info(V).is_sub_space:
            own, self._dofs = compat.collapsed(V)
            self.u = Function(own, name=given.name)
            self.component = compat.component(V)
            self.pull()

    @property
    def size_owned(self) -> int:
        """Number of owned dofs."""
        index_map, bs = compat.unknowns_of(self.u)
        return int(index_map.size_local * bs)

    @property
    def dofs(self) -> Places:
        """Index of each local dof in the array of the Function that has it."""
        n = len(self.u.x.array)
        return np.arange(n) if self._dofs is None else self._dofs

    def pull(self) -> None:
        """Update the copy."""
        if self._dofs is not None:
            self.u.x.array[:] = self.given.x.array[self._dofs]


def check_given(functions: Sequence[Any]) -> None:
    """Raise unless displacements are Functions, each on its own mesh."""
    for f in functions:
        if not isinstance(f, Function):
            raise ContactError(f"u must be a Function, not {type(f).__name__}")
    if not functions:
        raise ContactError("u must be a Function, or a list of one for each mesh")
    for i, f in enumerate(functions):
        mesh = f.function_space.mesh
        for g in functions[:i]:
            if compat.on_mesh(g, mesh):
                raise ContactError(
                    f"the displacements {g.name} and {f.name} are on one mesh: one "
                    "Function serves all of its bodies"
                )
            if g.function_space.mesh.geometry.dim != mesh.geometry.dim:
                raise ContactError(
                    f"the displacements {g.name} and {f.name} are on meshes of "
                    "different dimension"
                )
