"""Mixed spaces, fields at quadrature points, and values of UFL expressions there."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem

from ..core.compat import (
    HAS_UFL_ELEMENTS,
    Array,
    cell_name,
    dofmap_array,
    quadrature,
    space,
)
from ..core.compat.meshes import with_shape


def mixed_space(
    mesh: dolfinx.mesh.Mesh, *parts: tuple[str, int, tuple[int, ...]]
) -> fem.FunctionSpace:
    """Mixed space of several elements.

    Parameters
    ----------
    mesh
        Mesh.
    parts
        Family, degree and shape of the values of each, as of `space`.
    """
    if HAS_UFL_ELEMENTS:
        elements = [space(mesh, *part).ufl_element() for part in parts]
        return fem.FunctionSpace(mesh, ufl.MixedElement(elements))
    import basix.ufl

    elements = [
        basix.ufl.element(family, cell_name(mesh), degree, shape=shape or None)
        for family, degree, shape in parts
    ]
    return fem.functionspace(mesh, basix.ufl.mixed_element(elements))


def quadrature_space(
    mesh: dolfinx.mesh.Mesh, degree: int, shape: Sequence[int] = ()
) -> fem.FunctionSpace:
    """Space of values at the quadrature points of cells.

    Forms take its Functions where their measure has ``metadata={"quadrature_degree":
    degree, "quadrature_scheme": "default"}``.

    Parameters
    ----------
    mesh
        Mesh.
    degree
        Degree of the polynomials that the rule integrates exactly.
    shape
        Shape of the values: (), (n,) or (m, n).
    """
    shape = tuple(shape)
    if HAS_UFL_ELEMENTS:
        element: Any = ufl.FiniteElement(
            "Quadrature", mesh.ufl_cell(), degree, quad_scheme="default"
        )
        return fem.FunctionSpace(mesh, with_shape(element, shape))
    import basix.ufl

    element = basix.ufl.quadrature_element(
        cell_name(mesh), value_shape=shape, scheme="default", degree=degree
    )
    return fem.functionspace(mesh, element)


class AtQuadraturePoints:
    """Values of a UFL expression at the quadrature points of this rank's cells.

    Parameters
    ----------
    expression
        UFL expression without test or trial function.
    mesh, degree
        Mesh and degree of the rule, as of `quadrature_space`.

    Examples
    --------
    >>> strain = AtQuadraturePoints(ufl.sym(ufl.grad(u)), mesh, degree=2)
    >>> values = strain()  # (cells, points, d * d)
    """

    def __init__(self, expression: Any, mesh: dolfinx.mesh.Mesh, degree: int) -> None:
        points, _ = quadrature(cell_name(mesh), degree)
        self._found = fem.Expression(expression, points)
        cells = mesh.topology.index_map(mesh.topology.dim)
        # Ghosts too, whose cells some integrals over facets read
        n = cells.size_local + cells.num_ghosts
        size = int(np.prod(expression.ufl_shape))
        self._shape = n, len(points), size
        self._cells = np.arange(n, dtype=np.int32)
        parameters = list(inspect.signature(self._found.eval).parameters)
        self._on = (mesh,) if parameters[0] == "mesh" else ()  # since DOLFINx 0.6

    def __call__(self) -> Array:
        """Evaluate at the present values, (cells, points, components). Ghost cells
        come last."""
        values = self._found.eval(*self._on, self._cells)
        return np.asarray(values, dtype=np.float64).reshape(self._shape)


def set_at_quadrature_points(f: fem.Function, values: Array) -> None:
    """Set a Function on a `quadrature_space` to (cells, points, components) values."""
    V = f.function_space
    table, bs = dofmap_array(V), V.dofmap.index_map_bs
    f.x.array.reshape(-1, bs)[table] = values.reshape(*table.shape, bs)
