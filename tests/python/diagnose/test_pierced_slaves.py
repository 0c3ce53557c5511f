"""Rigid tools that are led through a slave: no step through it is accepted."""

import warnings

import numpy as np
import pytest
import ufl
from boxes import COMM
from dolfinx import fem
from materials import MATERIALS, lame

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    Contact,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    SNESSolver,
    rigid,
)
from raymortar.core import compat

LENGTH, HEIGHT, RADIUS, ABOVE = 2.0, 0.6, 0.2, 0.35
TOP, BOTTOM = 1, 2
# The last is of a block that is flat below the tool
REFUSED = "gone through|wrong side|jumps into its slave|Newton did not converge"


def led_down(material, friction, size=1.0, E=10.0, n=(10, 4)):
    """A block that is held below, and a circle above it."""
    sides = {"bottom": BOTTOM, "top": TOP}
    block = Block(n, (0.0, 0.0), (LENGTH * size, HEIGHT * size), tags=sides)
    mesh, _, tags = assemble_blocks(COMM, [block], "quadrilateral")
    V = compat.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress = MATERIALS[material][0](ufl.grad(u), *lame(E, 0.3))
    held = fem.locate_dofs_topological(V, 1, tags.find(BOTTOM))
    centre = (0.5 * LENGTH * size, (HEIGHT + ABOVE + RADIUS) * size)
    body = rigid.Body(rigid.Circle(centre, RADIUS * size))
    law = {} if friction is None else {"friction": Coulomb(friction)}
    contact = Contact(u, tags, [(TOP, body)], **law)
    form = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    bcs = [fem.dirichletbc(np.zeros(2), held, V)]
    return body, contact, SNESSolver(NonlinearProblem(form, contact, bcs))


@pytest.mark.mpi(where=lambda steps, **_: steps == 1)
@pytest.mark.parametrize("steps", [1, 5])
@pytest.mark.parametrize(
    "material, friction, size, E",
    [
        ("neo-hookean", None, 1.0, 10.0),
        ("neo-hookean", 0.3, 1.0, 10.0),
        ("linear", 0.3, 1.0, 10.0),
        ("linear", 0.3, 1e-3, 2e11),
    ],
)
def test_a_tool_does_not_leave_below_the_block(material, friction, size, E, steps):
    body, contact, solver = led_down(material, friction, size, E)
    forces = []
    path = LoadSteps(solver, lambda t: body.move((0.0, -3.0 * size * t)), steps)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(ConvergenceError, match=REFUSED):
            for step in path:
                if 3.0 * step.factor > 1.1 * ABOVE:
                    forces.append(contact.resultant(0).force[1])
    assert len(forces) > 1 and max(forces) < 0.0


@pytest.mark.mpi(where=lambda size, **_: size == 1.0)
@pytest.mark.parametrize("size, E", [(1.0, 10.0), (1e-3, 2e11)])
def test_a_step_does_not_jump_into_the_tool(size, E):
    """The more it presses, the more the block resists, until there is no way down."""
    body, contact, solver = led_down("linear", 0.3, size, E)
    forces = []

    def apply(t):
        body.move((0.0, -3.0 * size * t))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(ConvergenceError, match=REFUSED):
            for _ in LoadSteps(solver, apply, 24, path=(0.1, 0.3)):
                forces.append(-contact.resultant(0).force[1])
    assert max(forces) > 0.1 * E * size
    assert np.diff(forces).min() > -0.05 * max(forces)


@pytest.mark.mpi
def test_a_small_gamma_stays_where_gamma_itself_cycles():
    """Both solutions meet the conditions in the mean; gamma is back at the path's end."""
    body, contact, solver = led_down("linear", 0.3, 1.0, 10.0)
    given, found = contact.gamma, []

    def apply(t):
        body.move((0.0, -3.0 * t))

    for step in LoadSteps(solver, apply, 12, path=(0.1, 0.2)):
        found.append((step.strategy, contact.gamma / given, step.halvings))
    assert found[-4][0] == "small gamma, line search"
    np.testing.assert_allclose([one[1] for one in found], [1.0] * 8 + [0.1] * 4)
    assert found[-1][2] == 0
    assert contact.gamma == given


@pytest.mark.mpi
@pytest.mark.parametrize("way", [(0.6, 0.0), (-1.2, 0.02), (0.3, 0.4)])
def test_a_tool_in_contact_may_slide_and_lift_off(way):
    body, contact, solver = led_down("neo-hookean", None)
    down = -(ABOVE + 0.1)

    def apply(t):
        along, up = np.array(way) * max(t - 1.0, 0.0)
        body.move((along, down * min(t, 1.0) + up))

    path = LoadSteps(solver, apply, 4, path=(0.0, 2.0), strategy="halve")
    assert [step.factor for step in path][-1] == 2.0 and path.halvings == 0
