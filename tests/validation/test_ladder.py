"""A ladder that leans on floor and wall, held by friction alone (R2)."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from strips import neo_hookean, strip, tag_where

from raymortar import (
    Contact,
    ContactError,
    ConvergenceError,
    Coulomb,
    NonlinearProblem,
    SNESSolver,
    rigid,
)
from raymortar.core import compat

# Unit-free, and steel in metres: length and modulus
UNITS = {"unit-free": (1.0, 1.0), "SI": (4.0, 2e11)}
# Thickness over length, and place of the integration point next to a sharp edge
THICK = 0.004
FIRST = 0.5 * (1.0 - 1.0 / np.sqrt(3.0))
FLOOR, WALL = 0.4, 0.3


def limit_of(floor, wall, thick=0.0):
    """Angle with the floor below which the ladder slides. Degrees.

    Its weight is in the middle of the thickness, off the line between the points that
    touch.
    """
    arm = (0.5 - FIRST) * thick
    steep = (1.0 - floor * wall) / (2.0 * (floor + (1.0 + floor * wall) * arm))
    return np.degrees(np.arctan(steep))


def lean(degrees, floor, wall, units="unit-free"):
    """Forces of floor and wall over the weight; they touch by sharp edges."""
    (length, E), angle = UNITS[units], np.radians(degrees)
    along = np.array([-np.cos(angle), np.sin(angle)])
    up = np.array([np.sin(angle), np.cos(angle)])
    # The points next to the lower edges are just in the floor and in the wall
    foot = np.array([np.cos(angle), 0.0]) - FIRST * THICK * up - 1e-9

    def move(x):
        return length * (foot + np.outer(x[:, 0], along) + np.outer(x[:, 1], up))

    mesh = strip(12, 1, 1.0, THICK, move)
    ends = [lambda x, k=k: abs(place(x) - k) < 1e-6 for k in (0, 1)]

    def place(x):
        return (x[:2].T / length - foot) @ along

    tags = tag_where(mesh, *ends)
    u = fem.Function(compat.vector_space(mesh, 1))
    weight = 1e-8 * E * length
    load = fem.Constant(mesh, weight / (THICK * length**2))
    v = ufl.TestFunction(u.function_space)
    tools = rigid.Line((0.0, 0.0), (0.0, 1.0)), rigid.Line((0.0, 0.0), (1.0, 0.0))
    contacts = [
        Contact(u, tags, [(end, tool)], friction=Coulomb(mu), frame="master")
        for end, tool, mu in zip((1, 2), tools, (floor, wall))
    ]
    problem = NonlinearProblem(neo_hookean(u, E) + load * v[1] * ufl.dx, contacts)
    SNESSolver(problem).solve()
    return [contact.resultant().force / weight for contact in contacts]


@pytest.mark.mpi(where=lambda off, units: off > 0.0 and units == "SI")
@pytest.mark.parametrize("off", [0.2, -0.2])
@pytest.mark.parametrize("units", UNITS)
def test_a_ladder_stays_above_an_angle_and_slides_below(off, units):
    """tan a = (1 - mu_f mu_w) / (2 mu_f)."""
    angle = limit_of(FLOOR, WALL) + off
    if off < 0.0:
        with pytest.raises((ContactError, ConvergenceError)):
            lean(angle, FLOOR, WALL, units)
        return
    (x, y), (push, lift) = lean(angle, FLOOR, WALL, units)
    assert (x + push, y + lift) == pytest.approx((0.0, 1.0), abs=1e-8)
    assert lift == pytest.approx(WALL * push, rel=1e-6)
    # All but the limit of the floor, too
    assert 0.99 * FLOOR <= -x / y <= FLOOR


@pytest.mark.parametrize("floor, wall", [(0.4, 0.3), (0.4, 0.0), (0.25, 0.6)])
def test_the_angle_is_found_by_bisection(floor, wall):
    """With the arm of the weight, to a fiftieth of a degree."""
    slides, stays = 30.0, 80.0
    while stays - slides > 0.01:
        middle = 0.5 * (slides + stays)
        try:
            lean(middle, floor, wall)
            stays = middle
        except (ContactError, ConvergenceError):
            slides = middle
    assert stays == pytest.approx(limit_of(floor, wall, THICK), abs=0.02)
