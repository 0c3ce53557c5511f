"""An annulus turned against a flat surface (R6): torque of friction at any step.

Everything is prescribed, the pressure p is uniform: M = (2/3) mu p pi (b^3 - a^3),
and no friction acts along the radius.
"""

from __future__ import annotations

import boxes
import gathered
import numpy as np
import pytest
import states
from dolfinx import fem

from raymortar import Contact, Coulomb, Penalty, compat, rigid
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


@pytest.mark.mpi(where=lambda cell, step, **_: cell == "hexahedron" and step == 0.5)
@pytest.mark.parametrize("step", [0.01, 0.1, 0.5, 1.5])
@pytest.mark.parametrize("share", [0.0, 1.0, 0.4])  # of the turn that the ring makes
@pytest.mark.parametrize("master", ["plane", "plate"])
@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_torque_is_that_of_the_whole_path(cell, master, share, step, record_property):
    scene = Scene(cell, master)
    scene.turn(share * step, (share - 1.0) * step)
    p = gathered.points(scene.contact)
    x, t, area = p["x"][:, :2], p["traction"][:, :2], p["weight"]
    r = np.linalg.norm(x, axis=1)
    torque = -area @ (x[:, 0] * t[:, 1] - x[:, 1] * t[:, 0])
    bound = MU * GAMMA * DEPTH
    # Of the facets there are, whose inner and outer rims are polygons
    assert torque == pytest.approx(bound * area @ r, rel=1e-9)
    radial = np.abs(np.einsum("qi,qi->q", x, t)) / r
    record_property("radial", radial.max() / bound)
    assert radial.max() <= 1e-9 * bound
    whole = 2.0 / 3.0 * np.pi * (OUTER**3 - INNER**3)
    polygon = abs(area @ r / whole - 1.0)
    assert abs(torque / (bound * whole) - 1.0) <= 1e-3 + polygon


@pytest.mark.parametrize("step", [0.5, 1.5])
def test_turning_together_is_no_slip(step):
    scene = Scene("hexahedron", "plate")
    scene.turn(step, step)
    assert np.abs(gathered.points(scene.contact)["slip"]).max() <= 1e-13
