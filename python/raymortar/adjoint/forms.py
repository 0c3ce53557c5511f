"""Derivatives of the user's forms, with test functions that have the adjoint's values."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl.algorithms.analysis import extract_type
from ufl.classes import SpatialCoordinate

from ..core import compat
from ..core.compat import Array


def values_of_adjoint(problem: Any, lam: Any) -> list[Any]:
    """The adjoint as Functions in the spaces of the unknowns. Collective."""
    unknowns, rows = problem.contact.unknowns, lam.array_r
    found = []
    for f, start in zip(unknowns.functions, unknowns.owned_starts):
        g = fem.Function(f.function_space, name="adjoint")
        index_map, bs = compat.unknowns_of(f)
        n = bs * index_map.size_local
        g.x.array[:n] = rows[start : start + n]
        compat.scatter_forward(g.x)
        found.append(g)
    return found


def residuals(problem: Any) -> list[Any]:
    """The forms of all unknowns, None for none."""
    F = problem.forms[0]
    return list(F) if isinstance(F, (list, tuple)) else [F]


def all_forms(problem: Any, functional: Any) -> list[Any]:
    """The forms of a problem and of a functional."""
    own = [form for form in residuals(problem) if form is not None]
    return [*own, *(form for form, _ in functional.forms)]


def actions(problem: Any, adjoint: list[Any]) -> list[Any]:
    """The residuals of the forms with the adjoint in place of test functions."""
    found = []
    for form, g in zip(residuals(problem), adjoint):
        if form is not None and form.arguments():
            found.append(ufl.replace(form, {form.arguments()[0]: g}))
    return found


def has(form: Any, thing: Any) -> bool:
    """Whether a coefficient or a constant is in a form."""
    return any(one is thing for one in (*form.coefficients(), *form.constants()))


def by_function(form: Any, f: Any) -> Array:
    """Derivative of a functional by the dofs of a Function, ghosted array. Collective."""
    dform = ufl.derivative(form, f, ufl.TestFunction(f.function_space))
    return assembled(dform, f)


def by_coordinates(form: Any, X: Any) -> Array:
    """Derivative of a functional by the mesh's nodes, over the dofs of X, a Function of
    the space of coordinates. Collective."""
    mesh, test = X.function_space.mesh, ufl.TestFunction(X.function_space)
    # UFL may not know another object for the coordinates as that of the form
    known = [
        x
        for x in extract_type(form, SpatialCoordinate)
        if x.ufl_domain() == mesh.ufl_domain()
    ]
    dform = ufl.derivative(form, (known or [ufl.SpatialCoordinate(mesh)])[0], test)
    return assembled(dform, X)


def assembled(form: Any, f: Any) -> Array:
    """Assemble a linear form in the space of a Function, ghosts included. Collective."""
    vector = compat.create_la_vector(*compat.unknowns_of(f))
    vector.array[:] = 0.0
    compat.assemble_residual(vector.array, compat.form(form))
    compat.scatter_reverse_add(vector)
    compat.scatter_forward(vector)
    return np.array(vector.array)


def by_constant(form: Any, constant: Any, mesh: Any) -> Array:
    """Derivative of a functional by each entry of a Constant on a mesh. Collective.

    UFL differentiates by Functions: one with the same value everywhere takes its place,
    and varies by one everywhere.
    """
    shape = constant.ufl_shape
    size = int(np.prod(shape, dtype=int))
    f = fem.Function(compat.space(mesh, "DG", 0, shape))
    f.x.array[:] = np.resize(np.ravel(constant.value), len(f.x.array))
    found = by_function(ufl.replace(form, {constant: f}), f)
    index_map, _ = compat.unknowns_of(f)
    own = found[: index_map.size_local * size].reshape(-1, size).sum(axis=0)
    return np.asarray(mesh.comm.allreduce(own)).reshape(shape)
