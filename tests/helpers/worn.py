"""A block that wears under a dead load."""

from __future__ import annotations

import boxes
import numpy as np
import ufl
from dolfinx import fem

from raymortar import Contact, NonlinearProblem, rigid, tools
from raymortar.core import compat


class Pressed:
    """A block under a dead load on a rigid flat that slides below it."""

    LOAD, WAY = 2.0, 5.0

    def __init__(self):
        mesh = boxes.box("quadrilateral", 4)
        tags = boxes.tag_sides(mesh, (1, 0.0), (1, 1.0), (0, 0.0), (0, 1.0))
        V = compat.vector_space(mesh, 1)
        u, v = fem.Function(V), ufl.TestFunction(V)
        self.belt = rigid.Body(rigid.Line((0.0, 0.0), (0.0, 1.0)))
        self.contact = Contact(u, tags, [(1, self.belt)])
        self.load = fem.Constant(mesh, 0.0)
        strain = ufl.sym(ufl.grad(u))
        F = 100.0 * ufl.inner(strain, ufl.sym(ufl.grad(v))) * ufl.dx
        F += self.load * v[1] * ufl.Measure("ds", mesh, subdomain_data=tags)(2)
        sides = np.union1d(tags.find(3), tags.find(4))
        bcs = [tools.prescribe(V, sides, 0.0, 0)]
        self.problem = NonlinearProblem(F, self.contact, bcs)

    def press(self, t):
        self.load.value = self.LOAD * t

    def slide(self, t):
        self.belt.move((self.WAY * t, 0.0))
