"""A meshed ring that its hub turns under a shoe: the work of friction is the torque times
the angle, for steps of any size (2.17)."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from materials import lame
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    tools,
)

HUB, RIM, LINING, BACK = 1, 2, 3, 4
METHODS = {
    "points": AugmentedLagrangian,
    "nodes": lambda: AugmentedLagrangian(condition="nodes"),
    # In an overlap pressure has a moment of its own: 2e-3 of the torque at 1000
    "penalty": lambda: Penalty(10000.0),
}


def polar(x):
    """Angle from the right to the left, and radius."""
    angle = np.pi - x[:, 0]
    return x[:, 1:] * np.column_stack([np.cos(angle), np.sin(angle)])


class Brake:
    """The ring may be the master or the slave."""

    def __init__(self, method, ring_is_slave=False):
        tags = {"bottom": HUB, "top": RIM}
        blocks = [
            Block((24, 3), (k * np.pi, 0.4), ((k + 1) * np.pi, 1.0),
                  mapping=polar, tags=tags, body="ring")
            for k in (0, 1)
        ]  # fmt: skip
        blocks.append(
            Block((10, 3), (np.pi / 3, 1.0), (2 * np.pi / 3, 1.4),
                  mapping=polar, tags={"bottom": LINING, "top": BACK}, body="shoe")
        )  # fmt: skip
        mesh, _, facets = assemble_blocks(
            COMM, blocks, "quadrilateral", geometry_degree=2
        )
        V = tools.vector_space(mesh, 2)
        u, v = fem.Function(V), ufl.TestFunction(V)
        F = ufl.Identity(2) + ufl.grad(u)
        J = ufl.det(F)
        # A soft shoe: where the ring's surface has a dent, pressure works at its ends
        x = ufl.SpatialCoordinate(mesh)
        E = ufl.conditional(ufl.gt(ufl.dot(x, x), 1.0), 10.0, 100.0)
        mu, la = lame(E, 0.3)
        energy = mu / 2 * (ufl.inner(F, F) - 2 - 2 * ufl.ln(J))
        energy += la / 2 * ufl.ln(J) ** 2
        self.hub, self.down = fem.Function(V), fem.Constant(mesh, np.zeros(2))
        held = fem.locate_dofs_topological(V, 1, facets.find(HUB))
        bcs = [
            fem.dirichletbc(self.hub, held),
            tools.prescribe(V, facets.find(BACK), self.down),
        ]
        pair = (RIM, LINING) if ring_is_slave else (LINING, RIM)
        self.contact = Contact(u, facets, [pair], method, friction=Coulomb(0.3))
        form = ufl.derivative(energy * ufl.dx(metadata={"quadrature_degree": 4}), u, v)
        self.problem = NonlinearProblem(form, self.contact, bcs)
        self.solver = self.problem.snes_solver

    def press(self):
        def press(t):
            self.down.value[1] = -0.01 * t

        LoadSteps(self.solver, press, steps=2).run()

    def turn(self, angle):
        c, s = np.cos(angle), np.sin(angle)
        Q = np.array([[c - 1.0, -s], [s, c - 1.0]])
        self.hub.interpolate(lambda x: Q @ x[:2])


@pytest.mark.mpi(where=lambda steps, method, **_: steps == 20 and method == "points")
@pytest.mark.parametrize("steps", [20, 40, 80])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("ring_is_slave", [False, True])
def test_work_is_torque_times_angle(steps, method, ring_is_slave, record_property):
    brake, step = Brake(METHODS[method](), ring_is_slave), 2.0 * np.pi / steps
    brake.press()
    errors = []
    for k in range(4):

        def turn(t):
            brake.turn(step * (k + t))

        work = 0.0
        for _ in LoadSteps(brake.solver, turn, steps=1):
            torque = abs(float(brake.contact.results.resultant().moment))
            work += brake.contact.friction_work()
        errors.append(work / (torque * step) - 1.0)
    record_property("errors", errors)
    assert max(map(abs, errors[2:])) <= 1e-3
