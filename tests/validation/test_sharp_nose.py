"""A sharp nose of a snap-fit on a catch of flat faces (R3)."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import fem
from strips import neo_hookean, strip, tag_where

from raymortar import Contact, Coulomb, LoadSteps, NonlinearProblem, SNESSolver, rigid
from raymortar.core import compat

# Unit-free, and steel in metres
UNITS = {"unit-free": (1.0, 1.0), "SI": (1e-3, 2e11)}

# A cantilever with a sharp nose, drawn over a ramp and a flat top
SLAVE, CLAMP, MU, RAMP = 1, 2, 0.2, np.deg2rad(30.0)
NOSE, HEIGHT, HALF, TOP = 0.875, 0.1, 0.125, 0.06


def edge_of(ramp):
    """Where the flat top ends."""
    return NOSE - 0.02 - TOP / np.tan(ramp)


EDGE = edge_of(RAMP)


def lowest(x):
    """Lower side of the cantilever, of length 1."""
    return -HEIGHT * np.clip(1.0 - np.abs(x - NOSE) / HALF, 0.0, 1.0)


def nose(size, E, mu, ramp=RAMP):
    """The cantilever above the catch: contact, and a function that leads its clamp."""

    def move(x):
        x[:, 1] += (1.0 - 10.0 * x[:, 1]) * lowest(x[:, 0])
        return size * x

    mesh = strip(16, 2, 1.0, 0.1, move)

    def is_low(x):
        y = x / size
        return (np.abs(y[1] - lowest(y[0])) < 1e-9) & (y[0] > NOSE - HALF - 1e-6)

    tags = tag_where(mesh, is_low, lambda x: x[0] < 1e-9 * size)
    V = compat.vector_space(mesh, 1)
    u, clamp = fem.Function(V), fem.Constant(mesh, np.zeros(2))
    held = fem.locate_dofs_topological(V, 1, tags.find(CLAMP))
    edge = edge_of(ramp)
    foot, low = edge + TOP / np.tan(ramp), -HEIGHT - 0.002
    x = [edge - 0.8, edge, foot, foot + 0.5]
    points = size * np.column_stack([x, [low + TOP, low + TOP, low, low]])
    catch = rigid.Surface(points, np.array([[1, 0], [2, 1], [3, 2]]), closed=False)
    friction = Coulomb(mu) if mu else None
    contact = Contact(u, tags, [(SLAVE, catch)], friction=friction, frame="master")
    bcs = [fem.dirichletbc(clamp, held, V)]
    problem = NonlinearProblem(neo_hookean(u, E), contact, bcs)

    def lead(way):
        clamp.value[0] = -way * size

    return contact, SNESSolver(problem), lead


@pytest.mark.mpi(where=lambda units, mu: mu > 0.0 and units == "SI")
@pytest.mark.parametrize("mu", [0.0, MU])
@pytest.mark.parametrize("units", UNITS)
def test_a_nose_on_a_ramp_and_on_a_flat_top(units, mu):
    """Its force makes the angle of friction with the normal of what it is on."""
    size, E = UNITS[units]
    contact, solver, lead = nose(size, E, mu)
    way, found = NOSE - EDGE + 0.05, {"ramp": [], "top": []}
    for step in LoadSteps(solver, lambda t: lead(t * way), 10):
        force = contact.resultant().force
        at = NOSE - step.factor * way  # of the nose, but for a thousandth
        if EDGE + 0.02 < at < NOSE - 0.03:
            found["ramp"].append(force[0] / force[1])
        elif at < EDGE - 0.02:
            found["top"].append(force[0] / force[1])
    slope = np.tan(RAMP)
    assert len(found["ramp"]) >= 3 and len(found["top"]) >= 1
    exact = {"ramp": (mu + slope) / (1.0 - mu * slope), "top": mu}
    for face, ratios in found.items():
        assert np.abs(np.array(ratios) - exact[face]).max() <= 1e-9


@pytest.mark.parametrize("degrees", [29.0, 31.0, 38.0])
def test_a_facet_that_comes_down_on_a_ramp_is_covered(degrees):
    """Edges above 30 degrees cut slave facets, but not off what they come down on."""
    contact, _, lead = nose(1.0, 1.0, MU, np.deg2rad(degrees))
    for way in (0.0, 0.02):
        contact.u.x.array[0::2] = -way
        contact.update()
        points = contact.points()
        behind = (points["X"][:, 0] > NOSE - HALF / 2) & (points["X"][:, 0] < NOSE)
        assert points["weight"][behind & (points["status"] > 0)].sum() == pytest.approx(
            points["weight"][behind].sum(), rel=1e-12
        )


@pytest.mark.mpi
def test_a_nose_arrives_in_short_steps():
    """Facets beside the edge of the ramp neither gain nor lose what they are on."""
    contact, solver, lead = nose(*UNITS["SI"], MU)
    way = NOSE - EDGE + 0.05
    steps = LoadSteps(solver, lambda t: lead(t * way), 24).run()
    assert len(steps) == 24
    force = contact.resultant().force
    assert force[0] / force[1] == pytest.approx(MU, rel=1e-9)
