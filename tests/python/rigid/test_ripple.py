"""Ripple of the force on a tool that is dragged over a flat layer, or spun on it."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import Contact, NonlinearProblem, SNESSolver, rigid
from raymortar.core import compat

LENGTH, FACETS, RADIUS, DEPTH = 6.0, 60, 1.0, 0.06
SIZE = LENGTH / FACETS


def ring(degree, size=SIZE):
    """A circle of facets about as long as the slave's."""
    n = int(np.ceil(2.0 * np.pi * RADIUS / size))
    count = n * degree
    # Neither a corner nor a middle is lowest
    angle = 2.0 * np.pi * (np.arange(count) / count) + 0.3 * SIZE
    points = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    first = degree * np.arange(n)
    ends = np.column_stack([first, (first + degree) % count])
    facets = ends if degree == 1 else np.column_stack([ends, first + 1])
    points[:, 1] += RADIUS
    return rigid.Surface(points, facets)


TOOLS = {
    "circle": lambda: rigid.Circle((0.0, RADIUS), RADIUS),
    "straight": lambda: ring(1),
    "quadratic": lambda: ring(2),
}


def forces(shape, motions, refined=1):
    """Normal forces at poses (x, angle) of a tool that is pressed into a layer."""
    layer = Block(
        (refined * FACETS, refined * 8), (-0.5 * LENGTH, -1.0), (0.5 * LENGTH, 0.0),
        tags={"top": 1, "bottom": 2}, body="layer",
    )  # fmt: skip
    mesh, _, tags = assemble_blocks(COMM, [layer], "quadrilateral")
    V = compat.vector_space(mesh, 1)
    u = fem.Function(V)
    body = rigid.Body(shape, centre=(0.0, RADIUS))
    contact = Contact(u, tags, [(1, body)])
    P = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(40.0, 0.3))
    F = ufl.inner(P, ufl.grad(ufl.TestFunction(V))) * ufl.dx(degree=2)
    bottom = fem.locate_dofs_topological(V, 1, tags.find(2))
    bc = fem.dirichletbc(np.zeros(2), bottom, V)
    solver = SNESSolver(NonlinearProblem(F, contact, [bc]))
    found = []
    for x, angle in motions:
        body.move((x, -DEPTH), angle)
        solver.solve()
        found.append(-contact.resultant().force[1])
        contact.advance()
    return np.array(found)


def ripple(values):
    """Peak to peak, over the mean."""
    return np.ptp(values) / np.mean(values)


def dragged(name, refined=1, facets=2):
    """Forces at quarters of the slave's facets."""
    xs = SIZE / refined * np.arange(0.0, facets + 0.1, 0.25)
    return forces(TOOLS[name](), [(x, 0.0) for x in xs], refined)


def spun(name):
    """Forces of a tool that turns in its place, by two of its facets."""
    angles = SIZE / RADIUS * np.arange(0.0, 2.1, 0.25)
    return forces(TOOLS[name](), [(0.03, angle) for angle in angles])


def test_a_circle_shows_the_facets_of_the_slave_only():
    """The force repeats with these, and is smoother where they are smaller."""
    coarse, fine = (dragged("circle", refined) for refined in (1, 2))
    # But for the ends of the layer
    assert coarse[4:] == pytest.approx(coarse[:5], abs=0.01 * np.ptp(coarse))
    assert 0.0 < ripple(coarse) < 5e-3
    assert ripple(fine) < 0.5 * ripple(coarse)
    assert ripple(dragged("straight")) > 2.0 * ripple(coarse)


def test_a_circle_that_spins_shows_nothing():
    assert ripple(spun("circle")) <= 1e-12
    quadratic, straight = ripple(spun("quadratic")), ripple(spun("straight"))
    assert 0.0 < quadratic < 1e-5
    assert straight > 5e-3
