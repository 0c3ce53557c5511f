"""A block with a coat that slides on a flat rigid tool (R5): moments balance.

Tractions of both sides act on the tool's surface, a coat below the block's facets.
"""

from __future__ import annotations

import boxes
import numpy as np
import pytest
import ufl
from balances import moments, nodal_forces, nodal_positions
from dolfinx import fem
from dolfinx import mesh as dmesh
from materials import MATERIALS, lame
from problems import COMM, DIMENSION
from rotations import turn
from states import dof_positions

from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    Tresca,
    rigid,
)
from raymortar.core import compat

MU, PRESS, SLIDE, STEPS = 0.3, 0.02, 0.05, 8
SLAVE, TOP = 1, 2
# Per unit of E / side; stiff enough that overlaps stay small
METHODS = {"augmented": AugmentedLagrangian, "penalty": lambda: Penalty(100.0)}


class CoatedBlock:
    """A unit block, its coat on a line or a plane, its top held where it is led."""

    def __init__(self, cell, method, coat, n=8, side=1.0, E=1.0, degree=1):
        dim = DIMENSION[cell]
        mesh = boxes.box(cell, n, move=lambda x: side * x)
        tags = boxes.tag_sides(mesh, (dim - 1, 0.0), (dim - 1, side))
        V = compat.vector_space(mesh, degree)
        at, up = np.full(dim, 0.5 * side), np.eye(dim)[-1]
        at[-1] = -coat * side
        self.body = rigid.Body((rigid.Line if dim == 2 else rigid.Plane)(at, up))
        u, self.side = fem.Function(V), side
        self.contact = Contact(
            u, tags, [(SLAVE, self.body)], method, Coulomb(MU), offset=-coat * side
        )
        P = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(E, 0.3))
        dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
        F = ufl.inner(P, ufl.grad(ufl.TestFunction(V))) * dx
        self.top = fem.Constant(mesh, np.zeros(dim))
        held = fem.locate_dofs_topological(V, dim - 1, tags.find(TOP))
        bc = fem.dirichletbc(self.top, held, V)
        self.problem = NonlinearProblem(F, self.contact, [bc])
        self.solver = SNESSolver(self.problem)

    def slide(self, steps=STEPS):
        for k in range(steps + 1):
            self.top.value[-1] = -PRESS * self.side
            self.top.value[0] = SLIDE * self.side * k / steps
            self.solver.solve()
            self.contact.advance()

    def support(self):
        """Moment of the top's support about the origin: of all forces but contact."""
        forces = self.problem.volume.forces(self.problem.bcs)
        x = nodal_positions(self.contact)
        forces = np.concatenate(COMM.allgather(forces)).reshape(-1, x.shape[1])
        whole = forces + nodal_forces(self.contact)
        return moments(x, whole).sum(axis=0)

    def holding(self):
        """Moment of what holds the tool, about the origin."""
        on = self.contact.results.resultant_on(self.body)
        place = self.body.place[None, : len(on.force)]
        return -moments(place, on.force[None])[0] - on.moment


@pytest.mark.mpi(where=lambda coat, **_: coat == 0.2)
@pytest.mark.parametrize("coat", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("method", METHODS)
def test_support_and_tool_are_in_balance(method, coat, record_property):
    block = CoatedBlock("quadrilateral", METHODS[method](), coat)
    block.slide()
    force = block.contact.resultant().force
    assert abs(force[0]) >= 0.9 * MU * force[1]
    error = np.abs(block.support() + block.holding()).max()
    record_property("moment", error)
    assert error <= 1e-12
    slave = block.contact.resultant().moment
    assert abs(slave - block.holding()[0]) <= 1e-12


@pytest.mark.parametrize("cell", ["triangle", "tetrahedron", "hexahedron"])
def test_balance_in_si(cell):
    """Steel, a side of 10 mm, steps of 2e-4 m; in 3D all three moments."""
    E, side = 2e11, 1e-2
    method = Penalty(100.0 * E / side)
    block = CoatedBlock(cell, method, 0.05, n=3, side=side, E=E)
    block.slide(steps=4)
    size = side * np.abs(block.contact.resultant().force).max()
    assert np.abs(block.support() + block.holding()).max() <= 1e-10 * size


RADIUS, COAT = 1.0, 0.1


def sector(x):
    """The unit square as the lowest part of a wheel about the origin."""
    r, angle = RADIUS - 0.2 * (1.0 - x[:, 0]), 0.4 * (x[:, 1] - 0.5) - 0.5 * np.pi
    return np.column_stack([r * np.cos(angle), r * np.sin(angle)])


def rim(mesh):
    """Tags of the facets at the largest radius."""
    facets = dmesh.locate_entities_boundary(
        mesh, 1, lambda x: np.isclose(np.hypot(x[0], x[1]), RADIUS)
    )
    return compat.meshtags(mesh, 1, facets, np.full(len(facets), SLAVE))


@pytest.mark.mpi
def test_work_of_friction_is_torque_times_angle():
    """A wheel with a coat turns on a line: its friction has the coat in its arm. The
    tractions along the normal are those of the same penalty without friction."""
    angle, torques = 1e-3, []
    mesh = boxes.box("quadrilateral", 24, move=sector)
    for mu in (0.0, MU):
        u = fem.Function(compat.vector_space(mesh, 1))
        line = rigid.Body(rigid.Line((0.0, 1e-3 - RADIUS - COAT), (0.0, 1.0)))
        law = Penalty(50.0, tangential="rate"), Tresca(mu * 1e-3)
        contact = Contact(u, rim(mesh), [(SLAVE, line)], *law, offset=-COAT)
        contact.update()
        contact.advance()
        X = dof_positions(u.function_space)
        Q = turn(2, angle, None)
        u.x.array[:] = (X @ Q.T - X).ravel()
        contact.update()
        torques.append(moments(nodal_positions(contact), nodal_forces(contact)).sum())
    torque = torques[1] - torques[0]
    assert contact.friction_work() > 0.0
    assert torque * angle == pytest.approx(contact.friction_work(), rel=1e-5)
