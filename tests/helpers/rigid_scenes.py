"""A block whose top is pressed by a rigid tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import boxes
import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame

from raymortar import Contact, NonlinearProblem, SNESSolver, rigid
from raymortar.core import compat
from raymortar.rigid.turning import rotation_matrix

E, NU = 40.0, 0.3
TOP, BOTTOM = 1, 2
HALF = np.array([0.5, 0.5, 1.0])


def implicit(gdim, depth, radius=0.9):
    """A bowl, as a function of the user's: an ellipsoid."""
    stretch = np.array([1.0, 1.3, 1.0])
    centre = np.array([0.5, 0.45, 1.0 + radius - depth])
    if gdim == 2:
        centre = np.array([0.5, 1.0 + 1.3 * radius - depth, 0.0])

    def away(x):
        return (x - centre[:, None]) / stretch[:, None]

    def phi(x):
        return np.linalg.norm(away(x), axis=0) - radius

    def gradient(x):
        r = away(x)
        return r / np.linalg.norm(r, axis=0) / stretch[:, None]

    def hessian(x):
        r = away(x)
        size = np.linalg.norm(r, axis=0)
        unit = r / size
        flat = np.eye(3)[:, :, None] - unit[:, None] * unit[None, :]
        return flat / size / np.outer(stretch, stretch)[:, :, None]

    return rigid.Implicit(phi, gradient, hessian)


def shapes(gdim, depth=0.05):
    """By name, each reaching `depth` below the top of the unit box."""
    top = 1.0 - depth
    if gdim == 2:
        return {
            "line": rigid.Line((0.5, top), (0.1, -1.0)),
            "circle": rigid.Circle((0.45, top + 0.9), 0.9),
            "bore": rigid.Circle((0.5, top - 2.0), 2.0, hollow=True),
            "wedge": rigid.Wedge((0.47, top), (0.1, 1.0), 1.3),
            "implicit": implicit(2, depth),
        }
    return {
        "plane": rigid.Plane((0.5, 0.5, top), (0.1, 0.05, -1.0)),
        "sphere": rigid.Sphere((0.5, 0.45, top + 0.9), 0.9),
        "cup": rigid.Sphere((0.5, 0.45, top - 2.0), 2.0, hollow=True),
        "cylinder": rigid.Cylinder((0.5, 0.5, top + 0.7), (1.0, 0.3, 0.02), 0.7),
        "cone": rigid.Cone((0.47, 0.5, top), (0.1, 0.05, 1.0), 1.3),
        "torus": rigid.Torus((0.5, 0.5, top + 0.2), (0.05, 0.0, 1.0), 0.35, 0.2),
        "implicit": implicit(3, depth),
    }


def shape_of(cell, name, depth=0.05):
    """The one of `shapes` for a cell."""
    return shapes(2 if cell in ("triangle", "quadrilateral") else 3, depth)[name]


@dataclass
class Pressed:
    """Block, tool and problem."""

    u: Any
    body: Any
    contact: Any
    problem: Any
    solver: Any = None
    base: Any = None  # displacement of the block's bottom


def nearest_along(body, x, ways):
    """Distance of points (n, 3) from a tool along the nearest of several directions,
    (n,). Points may be outside or inside."""
    found = [
        np.abs(body.tool.distances_along(x.copy(), np.tile(way, (len(x), 1))))
        for way in ways
    ]
    return np.nanmin(found, axis=0)


def press(
    cell,
    shape,
    n=3,
    degree=1,
    move=None,
    material="neo-hookean",
    unit=1.0,
    stiffer=1.0,
    **options,
):
    """A block that is held at its bottom, below a tool.

    Parameters
    ----------
    cell, n, degree
        Cells of the unit box, divisions, degree of the displacement.
    shape
        Of `shapes`, or a Body, or a list of them.
    move
        (rotation vector, shift) of the whole scene, or None.
    unit, stiffer
        Length of the block's edges, and factor on its modulus.
    options
        Of Contact.
    """
    gdim = 2 if cell in ("triangle", "quadrilateral") else 3
    mesh = boxes.box(cell, n, move=lambda x: unit * x)
    tags = boxes.tag_sides(mesh, (gdim - 1, unit), (gdim - 1, 0.0))
    if move is not None:
        R, shift = rotation_matrix(np.asarray(move[0], dtype=float)), move[1]
        mesh.geometry.x[:] = mesh.geometry.x @ R.T + shift
    V = compat.vector_space(mesh, degree)
    u = fem.Function(V)
    several = shape if isinstance(shape, list) else [shape]
    given = [s if isinstance(s, rigid.Body) else rigid.Body(s) for s in several]
    contact = Contact(u, tags, [(TOP, one) for one in given], **options)
    stress, _ = MATERIALS[material]
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    P = stress(ufl.grad(u), *lame(stiffer * E, NU))
    F = ufl.inner(P, ufl.grad(ufl.TestFunction(V))) * dx
    bottom = fem.locate_dofs_topological(V, gdim - 1, tags.find(BOTTOM))
    base = fem.Constant(mesh, np.zeros(gdim))
    problem = NonlinearProblem(F, contact, [fem.dirichletbc(base, bottom, V)])
    return Pressed(u, given[0], contact, problem, base=base)


def press_by_mesh(cell, way, n, **options):
    """The same block below one cell whose dofs are all prescribed, on a mesh of its own.

    Its face is larger than the block's, so that no edge of it cuts a slave's facet.
    """
    gdim = 2 if cell in ("triangle", "quadrilateral") else 3
    above = np.eye(gdim)[-1]
    tool = boxes.box(cell, 1, move=lambda x: 3.0 * x - 1.0 + 2.0 * above)
    return press_by(tool, cell, way, n, **options)


def press_by(tool, cell, way, n, degree=1, **options):
    """The block below the mesh of a tool, whose dofs are all prescribed."""
    gdim = len(way)
    meshes = boxes.box(cell, n), tool
    tags = [
        boxes.tag_sides(meshes[0], (gdim - 1, 1.0), (gdim - 1, 0.0)),
        boxes.tag_sides(tool, (gdim - 1, 5.0), (gdim - 1, 4.0), (gdim - 1, 1.0)),
    ]
    functions, forms = [], []
    stress, _ = MATERIALS["neo-hookean"]
    for mesh in meshes:
        V = compat.vector_space(mesh, degree)
        u = fem.Function(V)
        dx = ufl.dx(mesh, metadata={"quadrature_degree": 2 * degree})
        P = stress(ufl.grad(u), *lame(E, NU))
        forms.append(ufl.inner(P, ufl.grad(ufl.TestFunction(V))) * dx)
        functions.append(u)
    contact = Contact(functions, tags, [(TOP, 3)], **options)
    lower, upper = (u.function_space for u in functions)
    bottom = fem.locate_dofs_topological(lower, gdim - 1, tags[0].find(BOTTOM))
    everything = fem.locate_dofs_geometrical(upper, lambda x: np.full(x.shape[1], True))
    bcs = [
        fem.dirichletbc(np.zeros(gdim), bottom, lower),
        fem.dirichletbc(np.asarray(way, dtype=float), everything, upper),
    ]
    problem = NonlinearProblem(forms, contact, bcs, u=functions)
    return Pressed(functions[0], None, contact, problem)


def solved(found):
    """Iterations of a solve."""
    return SNESSolver(found.problem).solve()[0]
