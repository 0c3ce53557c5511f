"""Gmsh models whose nodes are numbered from 1 on, as DOLFINx needs them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.compat import Array

Numbers = npt.NDArray[np.int64]


def without_holes(model: Any) -> Any:
    """A Gmsh model whose nodes have the numbers from 1 on.

    It is the given one, or stands for it where numbers are left out, as by Gmsh's plugin
    Crack. The model itself keeps its numbers, which the caller may know.
    """
    numbers = np.sort(np.asarray(model.mesh.getNodes()[0], dtype=np.int64))
    if np.array_equal(numbers, np.arange(1, len(numbers) + 1)):
        return model
    return _Model(model, numbers)


class _Mesh:
    """``gmsh.model.mesh`` with the places of nodes among all as their numbers."""

    def __init__(self, mesh: Any, numbers: Numbers) -> None:
        self._mesh, self._numbers = mesh, numbers

    def __getattr__(self, name: str) -> Any:
        return getattr(self._mesh, name)

    def _places(self, nodes: Any) -> Numbers:
        found = np.searchsorted(self._numbers, np.asarray(nodes, dtype=np.int64))
        return np.asarray(found + 1)

    def getNodes(self) -> tuple[Numbers, Array, Array]:
        numbers, points, parameters = self._mesh.getNodes()
        return self._places(numbers), points, parameters

    def getElements(self, dim: int = -1, tag: int = -1) -> tuple[Any, Any, list[Any]]:
        kinds, elements, nodes = self._mesh.getElements(dim, tag)
        return kinds, elements, [self._places(one) for one in nodes]


class _Model:
    """``gmsh.model`` with another mesh."""

    def __init__(self, model: Any, numbers: Numbers) -> None:
        self._model, self.mesh = model, _Mesh(model.mesh, numbers)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)
