"""Rigid balls at the bottom of a block whose sides are slaves too: they have passed it
only where they come out of its top."""

import numpy as np
import pytest
import ufl
from boxes import CELLS, COMM
from dolfinx import fem
from dolfinx.mesh import (
    CellType,
    create_box,
    create_rectangle,
    locate_entities_boundary,
    meshtags,
)

from raymortar import Contact, LoadSteps, NonlinearProblem, SNESSolver, rigid, tools
from raymortar.diagnose.lost_contact import passed_surfaces

N = {2: 12, 3: 4}


def block_on_ball(cell, radius, below):
    """A block, its boundary below a height in contact with a ball under its middle."""
    gdim = 2 if cell in ("triangle", "quadrilateral") else 3
    create = create_rectangle if gdim == 2 else create_box
    ends = [np.zeros(gdim), np.ones(gdim)]
    mesh = create(COMM, ends, [N[gdim]] * gdim, getattr(CellType, cell))
    near = locate_entities_boundary(
        mesh, gdim - 1, lambda x: x[gdim - 1] < below + 1e-9
    )
    ones = np.ones(len(near), dtype=np.int32)
    tags = meshtags(mesh, gdim - 1, np.sort(near), ones)
    top = locate_entities_boundary(mesh, gdim - 1, lambda x: x[gdim - 1] > 1.0 - 1e-9)
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    F = ufl.Identity(gdim) + ufl.grad(u)
    log = ufl.ln(ufl.det(F))
    energy = 0.5 * (ufl.inner(F, F) - gdim - 2.0 * log) + 0.75 * log**2
    form = ufl.derivative(energy * ufl.dx(degree=4), u, v)
    centre = [0.5] * (gdim - 1) + [-radius]
    ball = rigid.Body(rigid.Sphere(centre, radius))
    contact = Contact(u, tags, [(1, ball)])
    lead = fem.Constant(mesh, np.zeros(gdim))
    problem = NonlinearProblem(form, contact, [tools.prescribe(V, top, lead)])
    return ball, contact, problem, lead


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("below", [0.25, 1.0])
def test_a_ball_that_presses_into_the_bottom_has_not_passed_the_sides(cell, below):
    _, contact, problem, lead = block_on_ball(cell, 1.0, below)

    def push(t):
        lead.value[-1] = -0.1 * t

    path = LoadSteps(SNESSolver(problem), push, 2)
    path.run()
    assert path.halvings == 0
    assert contact.resultant().force[-1] > 0.0


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("up, passed", [(0.0, False), (0.92, True)])
def test_a_ball_below_the_top_is_told_of_a_whole_boundary(cell, up, passed):
    ball, contact, problem, lead = block_on_ball(cell, 0.3, 1.0)
    ball.move([0.0] * (len(lead.value) - 1) + [up])
    contact.update()
    assert ("wrong side" in "".join(passed_surfaces(problem))) == passed
