"""Rigid tools whose temperature is an unknown: balances of heat."""

from __future__ import annotations

import pytest
import ufl
from dolfinx import fem
from fluxes import conduction, field_space, prescribe
from problems import fix, stack

from raymortar import Contact, Coulomb, LoadSteps, NonlinearProblem, rigid, tools
from raymortar.core import compat
from raymortar.fluxes import FieldProblem, Flux, ToolField

CAPACITY, DT = 2.0, 0.1  # of the slab per volume; of each step


def conductance(T_s, T_m, p, g, v):
    return (0.3 + 5.0 * p) * (T_s - T_m)


class Slid:
    """An insulated slab that is pressed on a rigid flat, which slides below it."""

    def __init__(self, capacity):
        self.scene = scene = stack("quadrilateral", (3, 2))
        mesh = scene.mesh
        V, W = compat.vector_space(mesh, 1), field_space(mesh, 1)
        self.u, self.T, self.old = fem.Function(V), fem.Function(W), fem.Function(W)
        self.body = rigid.Body(rigid.Line((0.0, 0.0), (0.0, 1.0)))
        pair = (scene.tags["bottom"], self.body)
        self.contact = Contact(self.u, scene.facet_tags, [pair], friction=Coulomb(0.3))
        self.tool = ToolField(3.0, capacity)
        self.flux = Flux(self.contact, self.T, conductance, None, 0.3, tool=self.tool)
        v, s = ufl.TestFunction(V), ufl.TestFunction(W)
        stored = CAPACITY / DT * (self.T - self.old) * s * ufl.dx
        forms = [
            ufl.inner(ufl.sym(ufl.grad(self.u)), ufl.grad(v)) * ufl.dx,
            conduction(scene, self.T, 1.0) + stored,
        ]
        bcs = [fix(V, scene, "slave"), fix(V, scene, "top"), fix(V, scene, "master", 0)]
        bcs.append(fix(V, scene, "master", 1, -0.05))
        unknowns = [self.u, self.T]
        self.problem = NonlinearProblem(
            forms, [self.contact, self.flux], bcs, u=unknowns
        )

    def heat(self):
        """Of the slab."""
        return tools.integral(CAPACITY * self.T * ufl.dx, self.scene.mesh)

    def accept(self):
        self.old.x.array[:] = self.T.x.array
        self.tool.accept()


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("capacity", [0.7, 0.0])
def test_slab_and_tool_gain_the_work_of_friction(capacity, record_property):
    """A tool without a capacity gives all that it takes to the slab."""
    case, work, errors = Slid(capacity), 0.0, []

    def apply(t, step):
        case.body.move((0.3 * t, 0.0))
        case.contact.dt = DT

    steps = LoadSteps(case.problem.snes_solver, apply, 4, on_accept=case.accept)
    for _ in steps:
        work += case.contact.friction_work()
        gained = case.heat() + case.tool.stored
        errors.append(abs(gained - work) / max(work, 1e-4))
    record_property("errors", errors)
    assert max(errors) <= 1e-10, errors
    assert work > 1e-4
    assert abs(case.tool.value - 3.0) > 1e-3


@pytest.mark.quick
@pytest.mark.mpi
def test_two_slabs_share_a_tool():
    """A cold block between two hot walls: what it stores flows through both, and in the
    end it has the mean of both, weighed by their conductances."""
    scene = stack("triangle", (3, 2))
    W = field_space(scene.mesh, 1)
    T = fem.Function(W, name="T")
    tags, line = scene.tags, rigid.Line((0.0, 0.0), (0.0, 1.0))
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    tool = ToolField(0.0, 4.0, source=0.5)
    contacts = [
        Contact(u, scene.facet_tags, [(tags["bottom"], line)]),
        Contact(
            u, scene.facet_tags, [(tags["top"], rigid.Line((0.0, 2.0), (0.0, -1.0)))]
        ),
    ]
    laws = [lambda T_s, T_m, p, g, v, h=h: h * (T_s - T_m) for h in (1.0, 0.25)]
    fluxes = [Flux(c, T, q, tool=tool) for c, q in zip(contacts, laws)]
    walls = {"master": 10.0, "slave": 20.0}
    bcs = [prescribe(W, scene, name, value) for name, value in walls.items()]
    problem = FieldProblem(conduction(scene, T, 1.0), T, fluxes, bcs)
    for contact in contacts:
        contact.dt = 2.0
    for _ in range(3):
        before = tool.value
        problem.solve()
        rates = sum(flux.rates().through for flux in fluxes)
        assert abs(4.0 * (tool.value - before) / 2.0 - rates - 0.5) <= 1e-12
        tool.accept()
    for contact in contacts:
        contact.dt = 1e9
    problem.solve()
    # Slab and conductance in series
    h = [1.0 / (1.0 + 1.0), 1.0 / (1.0 + 4.0)]
    expected = (10.0 * h[0] + 20.0 * h[1] + 0.5) / sum(h)
    assert abs(tool.value - expected) <= 1e-7
