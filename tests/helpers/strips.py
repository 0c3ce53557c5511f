"""Strips of quadrilaterals with sharp corners, from arrays."""

from __future__ import annotations

import boxes
import numpy as np
import ufl
from dolfinx import mesh as dmesh
from materials import MATERIALS, lame

from raymortar.core import compat


def strip(nx, ny, length, height, move=lambda x: x):
    """A mesh of nx by ny cells on [0, length] x [0, height], moved. Collective."""
    i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    x = np.column_stack([length * i.ravel() / nx, height * j.ravel() / ny])
    first = ((ny + 1) * np.arange(nx)[:, None] + np.arange(ny)).reshape(-1, 1)
    cells = first + np.array([0, ny + 1, 1, ny + 2])
    return boxes.build("quadrilateral", (cells, move(x)))


def tag_where(mesh, *markers):
    """Tags 1, 2, ... on the boundary facets whose points fulfil each function."""
    parts = [dmesh.locate_entities_boundary(mesh, 1, marker) for marker in markers]
    values = np.concatenate([np.full(len(p), k) for k, p in enumerate(parts, 1)])
    return compat.meshtags(mesh, 1, np.concatenate(parts), values.astype(np.int32))


def neo_hookean(u, E):
    """Residual of the stress, nu = 0.3, degree 1."""
    stress, _ = MATERIALS["neo-hookean"]
    mesh = u.function_space.mesh
    dx = ufl.dx(mesh, metadata={"quadrature_degree": 2})
    P = stress(ufl.grad(u), *lame(E, 0.3))
    return ufl.inner(P, ufl.grad(ufl.TestFunction(u.function_space))) * dx
