"""Two slave surfaces of a block that press at the corner between them."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import ufl
from boxes import box, tag_sides
from dolfinx import fem
from problems import COMM

from raymortar import Contact, ContactWarning, NonlinearProblem, rigid
from raymortar.tools import prescribe, vector_space


def confined(apart):
    """Floor's force on a block between floor, wall and a lid, and what is found."""
    mesh = box("quadrilateral", 4)
    tags = tag_sides(mesh, (1, 0.0), (0, 1.0), (1, 1.0), (0, 0.0))
    V = vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress = 2.0 * ufl.sym(ufl.grad(u)) + ufl.div(u) * ufl.Identity(2)
    floor = rigid.Body(rigid.Line((0.0, 0.0), (0.0, 1.0)), name="floor")
    wall = rigid.Body(rigid.Line((1.0, 0.0), (-1.0, 0.0)), name="wall")
    pairs = [(1, floor), (2, wall)]
    given = (
        [Contact(u, tags, [pair]) for pair in pairs]
        if apart
        else Contact(u, tags, pairs)
    )
    bcs = [
        prescribe(V, tags.find(3), -0.1, component=1),
        prescribe(V, tags.find(4), component=0),
    ]
    problem = NonlinearProblem(ufl.inner(stress, ufl.grad(v)) * ufl.dx, given, bcs=bcs)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        problem.solve()
    found = [one for one in problem.check() if "corner" in one.text]
    return problem.contact.resultant(0).force, found


@pytest.mark.mpi
def test_they_share_a_multiplier_and_are_found():
    force, (found,) = confined(apart=False)
    assert found.place == (1.0, 0.0) and "its own Contact" in found.remedy
    assert abs(force[1] - 0.3) > 1e-3


@pytest.mark.mpi
def test_each_in_a_contact_of_its_own_has_the_exact_force():
    force, found = confined(apart=True)
    assert not found
    np.testing.assert_allclose(force, (0.0, 0.3), atol=1e-10)
