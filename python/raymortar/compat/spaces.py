"""Function spaces, their elements, and parts of mixed ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import dolfinx
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from ..errors import ContactError
from .generation import HAS_UFL_ELEMENTS, Array, Indices, table, unwrap
from .meshes import cell_name


def space(
    mesh: dolfinx.mesh.Mesh, family: str, degree: int, shape: Sequence[int] = ()
) -> fem.FunctionSpace:
    """Function space of a family by its UFL name, with values of a given shape."""
    shape = tuple(shape)
    if not HAS_UFL_ELEMENTS:
        return fem.functionspace(mesh, (family, degree, shape or None))
    element = ufl.FiniteElement(family, mesh.ufl_cell(), degree)
    if len(shape) == 1:
        element = ufl.VectorElement(element, dim=shape[0])
    elif shape:
        element = ufl.TensorElement(element, shape=shape)
    return fem.FunctionSpace(mesh, element)


def scalar_space(mesh: dolfinx.mesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Continuous scalar Lagrange space."""
    return space(mesh, "Lagrange", degree)


def vector_space(mesh: dolfinx.mesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Continuous Lagrange space of vectors with gdim components."""
    return space(mesh, "Lagrange", degree, (mesh.geometry.dim,))


@dataclass(frozen=True)
class ElementInfo:
    """Properties of the element of a function space.

    Attributes
    ----------
    is_lagrange
        Lagrange whose dofs are values at points, continuous or not.
    degree
        Polynomial degree; -1 for an element that is not in Basix.
    block_size
        Dofs per node.
    value_shape
        Shape of the values; () for a scalar.
    is_mixed
        Whether it is made of several elements (or none: quadrature elements).
    is_sub_space, is_discontinuous
        Whether it is a view into a larger space, or has its dofs inside cells.
    """

    is_lagrange: bool
    degree: int
    block_size: int
    value_shape: tuple[int, ...]
    is_mixed: bool
    is_sub_space: bool
    is_discontinuous: bool


def element_info(V: fem.FunctionSpace) -> ElementInfo:
    """Describe the element of a function space."""
    try:
        # For a blocked element, the scalar one.
        element = V.element.basix_element
    except RuntimeError:  # mixed and quadrature elements have none
        element = None
    is_mixed = element is None
    owner = V if hasattr(V, "value_shape") else V.element
    return ElementInfo(
        is_lagrange=not is_mixed
        and element.family.name == "P"
        and element.interpolation_is_identity,
        degree=-1 if is_mixed else element.degree,
        block_size=V.dofmap.index_map_bs,
        value_shape=tuple(int(n) for n in owner.value_shape),
        is_mixed=is_mixed,
        is_sub_space=len(V.component()) > 0,
        is_discontinuous=not is_mixed and element.discontinuous,
    )


def element_points(V: fem.FunctionSpace) -> Array:
    """Reference positions of the dofs of a Lagrange element, (n, tdim)."""
    return np.array(V.element.basix_element.points)


def dofmap_array(V: fem.FunctionSpace) -> Indices:
    """Local block dofs of each local cell (ghosts last), shape (n_cells, n)."""
    return table(V.dofmap.list, V.dofmap.dof_layout.num_dofs)


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


def component(V: fem.FunctionSpace) -> int:
    """Number of the part of a larger space that a view into it is."""
    parts = list(V.component())
    if len(parts) != 1:
        raise ContactError(
            "contact needs a part of a mixed Function, such as w.sub(0), not a part of "
            "such a part"
        )
    return int(parts[0])


def collapsed(V: fem.FunctionSpace) -> tuple[fem.FunctionSpace, npt.NDArray[np.int64]]:
    """Make a space of a view into a larger one, and find its dofs there. Collective.

    They are the indices of its local dofs in the larger one's ghosted arrays, unrolled.
    """
    own, dofs = V.collapse()
    # DOLFINx 0.11 has a list of one array
    return own, np.asarray(dofs, dtype=np.int64).ravel()


def num_parts(V: fem.FunctionSpace) -> int:
    """Number of elements that a mixed one is made of."""
    return int(V.num_sub_spaces)


def dofs_of_part(V: fem.FunctionSpace, i: int) -> npt.NDArray[np.int64]:
    """Dofs of a part of a mixed space in its ghosted arrays, unrolled, ascending."""
    dofmap = V.sub(i).dofmap
    blocks = np.unique(np.asarray(getattr(dofmap.list, "array", dofmap.list)))
    dofs = dofmap.bs * blocks[:, None].astype(np.int64) + np.arange(dofmap.bs)
    return dofs.ravel()


def part_of(argument: Any, i: int | None) -> Any:
    """A part of a Function or an argument of a mixed space; None: all of it."""
    return argument if i is None else ufl.split(argument)[i]


def same_values(f: fem.Function, g: fem.Function) -> bool:
    """Whether two Functions share their vector, as a part does with its whole."""
    return f.x is g.x or unwrap(f.x) is unwrap(g.x)


def unknowns_of(f: fem.Function) -> tuple[Any, int]:
    """Index map and block size of a Function's vector; of a part those of the whole."""
    dofmap = f.function_space.dofmap
    return dofmap.index_map, dofmap.index_map_bs


def contains(V: fem.FunctionSpace, W: fem.FunctionSpace) -> bool:
    """Whether a space is another one, or a part of it."""
    return bool(unwrap(V).contains(unwrap(W)))
