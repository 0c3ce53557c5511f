"""A block that stands on a corner, pressed on something flat and slid along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import boxes
import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from strips import tag_where

from raymortar import Contact, LoadSteps, NewtonSolver, NonlinearProblem, rigid
from raymortar.core import compat
from raymortar.rigid.turning import rotation_matrix

BOTTOM, TOP, FLOOR = 1, 2, 3
# Of the block, in terms of its modulus and size
PRESSED, SLID, STEPS = 0.02, 0.05, 8


@dataclass
class Corner:
    """Block, contact and problem; `top` is the displacement of the block's top."""

    u: Any
    contact: Any
    problem: Any
    top: Any
    size: float

    def path(self, points, steps=STEPS):
        """Take the top through some places, (m, d) in sizes of the block, after the
        present one; gives the tool's force at each step, (m * steps, d)."""
        forces = []
        for point in points:
            start, end = self.top.value.copy(), self.size * np.asarray(point)

            def apply(t):
                self.top.value[:] = start + t * (end - start)

            solver = NewtonSolver(self.problem)
            for _ in LoadSteps(solver, apply, steps=steps, progress=False):
                forces.append(self.contact.resultant(0).force.copy())
        return np.array(forces)

    def pressed(self, way, pressed=PRESSED):
        """Forces while the block is pressed, then slid along the first axis; the
        latter ones, tangential over normal, (STEPS, d - 1)."""
        d = len(self.top.value)
        down = -pressed * np.eye(d)[-1]
        self.path([down], steps=2)
        forces = self.path([down + way * SLID * np.eye(d)[0]])
        return forces[:, :-1] / forces[:, -1:]


def turned(gdim, *degrees):
    """Rotation by one angle in 2D, about two axes in 3D."""
    angles = np.deg2rad(degrees)
    vector = np.array([0.0, 0.0, angles[0]]) if gdim == 2 else np.append(angles, 0.0)
    return rotation_matrix(vector)[:gdim, :gdim]


def _flat_surface(gdim, size):
    """A flat surface of facets, open."""
    ends = size * np.array([-1.5, -0.3, 0.4, 1.5])
    if gdim == 2:
        points = np.column_stack([ends, 0.0 * ends])
        facets = np.array([[1, 0], [2, 1], [3, 2]])
    else:
        points = np.array([[x, y, 0.0] for x in ends for y in ends])
        corner = np.array([4 * i + j for i in range(3) for j in range(3)])[:, None]
        facets = corner + np.array([[0, 4, 5, 1]])
    return rigid.Surface(points, facets, closed=False)


def flat_tool(kind, gdim, size=1.0):
    """Something rigid and flat below the block: a shape, or a mesh, which is None."""
    up = np.eye(gdim)[-1]
    if kind == "surface":
        return _flat_surface(gdim, size)
    shape = rigid.Line if gdim == 2 else rigid.Plane
    return None if kind == "mesh" else shape(0.0 * up, up)


def block_on(
    tool, turn, n=8, degree=1, cell="quadrilateral", size=1.0, E=1.0, **options
):
    """The block on a tool, or on a mesh whose dofs are all held.

    Parameters
    ----------
    tool
        Rigid shape or body; None: a mesh.
    turn
        Rotation of the block about its lower left corner, which is at the origin.
    options
        Of Contact.
    """
    gdim = len(turn)
    mesh = boxes.box(cell, n)
    sides = [(gdim - 1, 0.0), (gdim - 1, 1.0)]
    tags = [boxes.tag_sides(mesh, *sides)]
    mesh.geometry.x[:, :gdim] = size * mesh.geometry.x[:, :gdim] @ turn.T
    meshes = [mesh]
    if tool is None:
        shift = np.full(gdim, 0.5) + 0.5 * np.eye(gdim)[-1]
        floor = boxes.box(cell, 3, move=lambda x: 3.0 * size * (x - shift))
        tags.append(boxes.tag_sides(floor, (0, 9.0), (0, 9.0), (gdim - 1, 0.0)))
        meshes.append(floor)
    spaces = [compat.vector_space(each, degree) for each in meshes]
    functions = [fem.Function(V) for V in spaces]
    stress, _ = MATERIALS["neo-hookean"]
    forms = [
        ufl.inner(stress(ufl.grad(u), *lame(E, 0.3)), ufl.grad(ufl.TestFunction(V)))
        * ufl.dx(V.mesh, metadata={"quadrature_degree": 2 * degree})
        for u, V in zip(functions, spaces)
    ]
    top = fem.Constant(mesh, np.zeros(gdim))
    held = fem.locate_dofs_topological(spaces[0], gdim - 1, tags[0].find(TOP))
    bcs = [fem.dirichletbc(top, held, spaces[0])]
    if tool is not None:
        contact = Contact(functions[0], tags[0], [(BOTTOM, tool)], **options)
        problem = NonlinearProblem(forms[0], contact, bcs)
    else:
        every = fem.locate_dofs_geometrical(spaces[1], lambda x: x[0] == x[0])
        bcs.append(fem.dirichletbc(np.zeros(gdim), every, spaces[1]))
        contact = Contact(functions, tags, [(BOTTOM, FLOOR)], **options)
        problem = NonlinearProblem(forms, contact, bcs, u=functions)
    return Corner(functions[0], contact, problem, top, size)


def corner_on_flat(turn, n=8, E=1.0, **options):
    """A stiff block's corner on the flat side, the slave, of a soft block that is held
    below: contact, problem, and the place that the stiff block is led to."""
    gdim = len(turn)
    cell = "quadrilateral" if gdim == 2 else "hexahedron"
    middle = np.append(np.full(gdim - 1, 0.4), 1.001)
    soft = boxes.box(cell, n)

    def stand(x):
        return 0.5 * x @ turn.T + middle

    stiff = boxes.box(cell, 2, move=stand)

    def is_low(x):
        return np.isclose((x[:gdim].T - middle) @ turn, 0.0).any(axis=1)

    tags = [
        boxes.tag_sides(soft, (gdim - 1, 1.0)),
        tag_where(stiff, lambda x: x[0] > 9.0, is_low),
    ]
    spaces = [compat.vector_space(each, 1) for each in (soft, stiff)]
    functions = [fem.Function(V) for V in spaces]
    place = fem.Constant(stiff, np.zeros(gdim))
    foot = fem.locate_dofs_geometrical(spaces[0], lambda x: x[gdim - 1] < 1e-9)
    every = fem.locate_dofs_geometrical(spaces[1], lambda x: x[0] == x[0])
    bcs = [
        fem.dirichletbc(np.zeros(gdim), foot, spaces[0]),
        fem.dirichletbc(place, every, spaces[1]),
    ]
    stress, _ = MATERIALS["neo-hookean"]
    forms = [
        ufl.inner(stress(ufl.grad(u), *lame(E, 0.3)), ufl.grad(ufl.TestFunction(V)))
        * ufl.dx
        for u, V in zip(functions, spaces)
    ]
    contact = Contact(functions, tags, [(1, 2)], **options)
    return contact, NonlinearProblem(forms, contact, bcs, u=functions), place
