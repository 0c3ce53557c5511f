"""An annulus that is turned on a flat surface, under a uniform pressure."""

from __future__ import annotations

import boxes
import numpy as np
import states
from dolfinx import fem

from raymortar import Contact, Coulomb, Penalty, rigid
from raymortar.core import compat
from raymortar.rigid.turning import rotation_matrix

INNER, OUTER, MU, GAMMA, DEPTH = 0.4, 1.0, 0.3, 50.0, 1e-4
UP = np.array([0.0, 0.0, 1.0])
RING, PLATE = 1, 2


def ring(x):
    """The unit cube as a ring that stands on z = 0, open at one angle."""
    r, angle = INNER + (OUTER - INNER) * x[:, 0], 2.0 * np.pi * x[:, 1]
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), 0.3 * x[:, 2]])


def plate(x):
    """The unit cube as what it stands on."""
    return 4.0 * x - [2.1, 2.2, 4.0]


class Scene:
    """A ring that is DEPTH deep in a plane or in a plate, accepted so."""

    def __init__(self, cell, master):
        meshes = [boxes.box(cell, 10, move=ring)]
        tags = [boxes.tag_sides(meshes[0], (2, 0.0))]
        self.body = rigid.Body(rigid.Plane((0.0, 0.0, 0.0), UP))
        if master == "plate":
            meshes.append(boxes.box(cell, 3, move=plate))
            tags.append(boxes.tag_sides(meshes[1], (2, 4.0), (2, 0.0)))
        self.u = [fem.Function(compat.vector_space(mesh, 1)) for mesh in meshes]
        law = Penalty(GAMMA, tangential="rate"), Coulomb(MU)
        if master == "plate":
            self.contact = Contact(self.u, tags, [(RING, PLATE)], *law)
        else:
            self.contact = Contact(self.u[0], tags[0], [(RING, self.body)], *law)
        self.turn(0.0, 0.0)
        self.contact.advance()

    def turn(self, angle, below):
        """Turn both about the ring's axis, and pair."""
        for u, by, depth in zip(self.u, (angle, below), (DEPTH, 0.0)):
            X = states.dof_positions(u.function_space)
            x = X @ rotation_matrix(by * UP).T - depth * UP
            u.x.array[:] = (x - X).ravel()
        self.body.move(rotation=below * UP)
        self.contact.update()
