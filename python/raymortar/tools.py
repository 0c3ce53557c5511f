"""Helpers for programs with contact: spaces, supports, materials, stresses.

Nothing here knows of contact. All of it works in every supported version of DOLFINx.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh

from .core import compat
from .core.compat import scalar_space, vector_space
from .core.errors import ContactError, described, spoken_tag, together
from .versions import (
    AtQuadraturePoints,
    mixed_space,
    quadrature_space,
    set_at_quadrature_points,
)

__all__ = [
    "AtQuadraturePoints",
    "by_body",
    "integral",
    "mixed_space",
    "nodal_field",
    "prescribe",
    "quadrature_space",
    "scalar_space",
    "set_at_quadrature_points",
    "vector_space",
    "von_mises",
]


def prescribe(
    V: Any,
    facets: npt.ArrayLike,
    value: float | npt.ArrayLike | fem.Constant = 0.0,
    component: int | None = None,
) -> Any:
    """Dirichlet condition on facets: for a displacement, a component of it, or a scalar.

    Collective.

    Parameters
    ----------
    V
        Space of the displacement, from `vector_space`, or of a scalar field.
    facets
        Facets of this rank, such as ``facet_tags.find(3)`` or
        ``bodies.find("bottom")``.
    value
        Number, for a whole displacement a vector or one number for each component; or a
        ``Constant``, whose ``value`` the program changes from step to step. Length.
    component
        0, 1 or 2 for x, y or z; None: all components.

    Returns
    -------
    A ``DirichletBC``, for `NonlinearProblem`.

    Raises
    ------
    ContactError
        If the space has no such component, if the value is no number or vector of its
        dimension, if facets are no numbers of facets of this rank, or if no rank has
        any.

    Examples
    --------
    >>> down = fem.Constant(mesh, 0.0)
    >>> bcs = [
    ...     prescribe(V, bodies.find("bottom")),
    ...     prescribe(V, bodies.find("top"), down, component=1),
    ... ]
    """
    mesh = V.mesh
    dim = mesh.geometry.dim
    with together(mesh.comm):
        if component is not None and component not in range(dim):
            raise ContactError(
                f"component must be one of {list(range(dim))} or None, not {component!r}"
            )
        is_vector = component is None and bool(compat.element_info(V).value_shape)
        if is_vector and V.dofmap.bs != dim:
            raise ContactError(
                "V is a part of a mixed space, of which conditions are on components: "
                "call prescribe with component=0, then with the others"
            )
        if not isinstance(value, fem.Constant):
            value = _constant(mesh, value, (dim,) if is_vector else ())
    facet_dim = mesh.topology.dim - 1
    compat.connectivity(mesh, facet_dim, facet_dim + 1)
    with together(mesh.comm):
        numbers = _facet_numbers(mesh, facets)
    if mesh.comm.allreduce(len(numbers)) == 0:
        raise ContactError(
            "facets has none on any rank, so nothing would be prescribed"
        )
    part = V if component is None else V.sub(component)
    dofs = fem.locate_dofs_topological(part, facet_dim, numbers)
    return fem.dirichletbc(value, dofs, part)


def _facet_numbers(mesh: Mesh, facets: Any) -> compat.Indices:
    """Check numbers of facets of this rank."""
    try:
        found = np.asarray(facets)
    except ValueError:  # rows of several lengths
        found = np.empty((0, 0))
    if found.ndim != 1 or (found.size and found.dtype.kind not in "iu"):
        raise ContactError(
            "facets must be numbers of facets of this rank, such as "
            f"facet_tags.find(3) or bodies.find('bottom'), not {described(facets)}"
        )
    index_map = mesh.topology.index_map(mesh.topology.dim - 1)
    count = index_map.size_local + index_map.num_ghosts
    wrong = found[(found < 0) | (found >= count)]
    if wrong.size:
        raise ContactError(
            f"facets has {wrong[0]}, and the facets of this rank are 0 to {count - 1}"
        )
    return found.astype(np.int32)


def _constant(mesh: Mesh, value: Any, shape: tuple[int, ...]) -> fem.Constant:
    """A value as a Constant of the size that a condition needs."""
    wanted = "a number" if shape == () else f"a number or {shape[0]} numbers"
    if isinstance(value, fem.Function):
        raise ContactError(
            f"value must be {wanted}, not {described(value)}: dolfinx.fem.dirichletbc takes "
            "a Function"
        )
    try:
        array = np.asarray(value, dtype=PETSc.ScalarType)
        full = np.array(np.broadcast_to(array, shape))
    except (TypeError, ValueError):
        raise ContactError(f"value must be {wanted}, not {described(value)}") from None
    return fem.Constant(mesh, full if shape else PETSc.ScalarType(full))


def by_body(
    mesh: Mesh,
    cell_tags: Any,
    values: Mapping[int | str, float],
    names: Mapping[str, int | tuple[int, int]] | None = None,
) -> fem.Function:
    """Piecewise constant field, such as Young's modulus of each body. Collective.

    Parameters
    ----------
    mesh
        Mesh of all bodies.
    cell_tags
        Tags of its cells, such as those of `io.read_gmsh`.
    values
        Value by tag, or by name where `names` has it. Every cell needs one.
    names
        Tag, or (dimension, tag), by name: the ``names`` of `io.read_gmsh`.

    Raises
    ------
    ContactError
        For a name that is not known, or for cells without a value.

    Examples
    --------
    >>> values = {"upper": 5.0, "lower": 210e3}
    >>> E = by_body(bodies.mesh, bodies.cell_tags, values, bodies.names)
    """
    field = fem.Function(compat.space(mesh, "DG", 0))
    places = compat.dofmap_array(field.function_space).ravel()
    with together(mesh.comm):
        table = {_tag(key, names): float(value) for key, value in values.items()}
        field.x.array[:] = np.nan
        for tag, value in table.items():
            field.x.array[places[cell_tags.find(tag)]] = value
        bare = int(np.isnan(field.x.array).sum())
        if bare:
            tags = sorted(set(map(int, cell_tags.values)) - set(table))
            known = names or {}
            called = {
                _tag(name, known): name
                for name, group in known.items()
                if not isinstance(group, tuple) or group[0] == mesh.topology.dim
            }
            lacking = [
                spoken_tag(k, called[k]) if k in called else str(k) for k in tags
            ]
            raise ContactError(
                f"values has none for {bare} cell(s) of the mesh: tags without a "
                f"value are [{', '.join(lacking)}]"
            )
    return field


def _tag(key: int | str, names: Mapping[str, Any] | None) -> int:
    """Tag of a body that is named, or is one already."""
    if not isinstance(key, str):
        return int(key)
    known = names or {}
    if key not in known:
        listed = ", ".join(map(repr, known)) or "none: pass names="
        raise ContactError(f"no cells are named {key!r}; known names: {listed}")
    tag = known[key]
    return int(tag[1] if isinstance(tag, tuple) else tag)


def von_mises(sigma: Any) -> Any:
    r"""Equivalent stress :math:`\sqrt{3/2\; s : s}` of a 3 x 3 tensor in UFL.

    In plane strain give the whole tensor: its zz component counts.
    """
    s = sigma - ufl.tr(sigma) / 3 * ufl.Identity(3)
    return ufl.sqrt(1.5 * ufl.inner(s, s))


def integral(form: Any, mesh: Mesh) -> float:
    """Value of a UFL functional over all ranks, such as an energy. Collective."""
    value = fem.assemble_scalar(compat.form(form))
    return float(mesh.comm.allreduce(value, op=MPI.SUM))


def nodal_field(
    f: Any,
    mesh: Mesh,
    name: str,
    degree: int = 1,
    quadrature_degree: int | None = None,
) -> fem.Function:
    """A continuous Function for a UFL scalar f: averages, weighted by the shape
    functions. It needs no solve, and stays within the range of f. Give a quadrature
    degree if UFL estimates that of f far too high. Collective.
    """
    field = fem.Function(compat.scalar_space(mesh, degree), name=name)
    v = ufl.TestFunction(field.function_space)
    rule = {"quadrature_degree": quadrature_degree or 2 * degree}
    dx, found = ufl.dx(mesh, metadata=rule), []
    for form in (f * v * dx, v * dx):
        vector = compat.create_la_vector(field.function_space.dofmap.index_map)
        compat.assemble_residual(vector.array, compat.form(form))
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
        found.append(vector.array)
    field.x.array[:] = found[0] / found[1]
    return field
