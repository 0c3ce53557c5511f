"""Heat of friction against closed forms: on a tool, between slabs, and as it is stored."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import (
    CONDUCTIVITY,
    DEPTH,
    conduction,
    constant,
    elastic,
    field_space,
    of_pressure,
    prescribe,
    values_on,
)
from problems import COMM, fix, stack, worst

from raymortar import Contact, Coulomb, NonlinearProblem, Penalty, SNESSolver, rigid
from raymortar.core import compat
from raymortar.fluxes import Flux

MU, SPEED = 0.3, 2.0
STIFFNESS, OVERLAP, SLIDE = 1e8, 1e-8, 1e-7  # pressure 1


class Slider:
    """Bodies whose displacement is prescribed: the pressure is that of a penalty.

    The upper body, or a tool below the lower one, slides by next to nothing, so that it
    stays above the other throughout, in a time that makes the speed what it is.
    """

    def __init__(self, law, on_tool, share):
        self.scene = scene = stack("triangle", (3, 4))
        V, W = compat.vector_space(scene.mesh, 1), field_space(scene.mesh, 1)
        self.u, self.T = fem.Function(V, name="u"), fem.Function(W, name="T")
        self.place = fem.Function(V)
        self.tool = rigid.Body(rigid.Line((0.0, 0.0), (0.0, 1.0)))
        tags = scene.tags
        pair = (
            (tags["bottom"], self.tool) if on_tool else (tags["slave"], tags["master"])
        )
        self.contact = Contact(
            self.u,
            scene.facet_tags,
            [pair],
            Penalty(STIFFNESS, tangential="rate"),
            Coulomb(MU),
        )
        self.flux = Flux(
            self.contact,
            self.T,
            law,
            friction_heat=share,
            tool=0.0 if on_tool else None,
        )
        ends = {"top": 0.0, "master": 0.0} if on_tool else {"top": 0.0, "bottom": 0.0}
        everywhere = np.arange(len(self.u.x.array) // 2, dtype=np.int32)
        bcs = [fem.dirichletbc(self.place, everywhere)]
        bcs += [prescribe(W, scene, name, value) for name, value in ends.items()]
        forms = [elastic(self.u), conduction(scene, self.T, 1.0)]
        unknowns = [self.u, self.T]
        self.problem = NonlinearProblem(
            forms, [self.contact, self.flux], bcs, u=unknowns
        )

    def slide(self, on_tool):
        x = self.place.function_space.tabulate_dof_coordinates()
        u = self.place.x.array.reshape(-1, 2)
        moved = np.ones(len(x), dtype=bool) if on_tool else self.upper()
        u[moved, 1] = -OVERLAP
        # Nothing but the temperature is free, and it is in balance until the slide
        # begins: a line search would take any heat for a step that is too long
        solver = SNESSolver(self.problem, {"snes_linesearch_type": "basic"})
        solver.solve()
        self.contact.advance()
        self.contact.dt = SLIDE / SPEED
        if on_tool:
            self.tool.move((SLIDE, 0.0))
        else:
            u[moved, 0] = SLIDE
        solver.solve()

    def upper(self):
        V, found = self.place.function_space, np.zeros(
            len(self.place.x.array) // 2, bool
        )
        cells = self.scene.cell_tags.find(self.scene.bodies["1"])
        found[compat.dofmap_array(V)[cells]] = True
        return found


@pytest.mark.mpi
@pytest.mark.parametrize("share", [0.5, 0.2, 1.0])
def test_heat_of_friction_on_a_moving_tool(share):
    """A slab on a line that moves: 2 T + k T / L = share mu p v."""
    case = Slider(constant, True, share)
    case.slide(True)
    heat = MU * STIFFNESS * OVERLAP * SPEED
    rates = case.flux.rates()
    assert abs(rates.slave_heat / (share * heat) - 1.0) <= 1e-8
    assert abs(case.contact.friction_work() / case.contact.dt / heat - 1.0) <= 1e-8
    T = values_on(case.T, case.scene, "bottom")
    assert worst(T / (share * heat / 3.0) - 1.0) <= 1e-8


@pytest.mark.mpi
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_heat_of_friction_between_equal_slabs(share, record_property):
    """T = mu p v L / (2 k) on both sides, but for the jump of unequal shares."""
    h = 1e4
    case = Slider(lambda T_s, T_m, p, g, v: h * (T_s - T_m), False, share)
    case.slide(False)
    heat = MU * STIFFNESS * OVERLAP * SPEED
    jump = (2.0 * share - 1.0) * heat / (1.0 + 2.0 * h)
    sides = {"slave": 0.5 * (heat + jump), "master": 0.5 * (heat - jump)}
    error = max(
        worst(values_on(case.T, case.scene, name) / T - 1.0)
        for name, T in sides.items()
    )
    record_property("error", error)
    assert error <= 1e-6


@pytest.mark.mpi
def test_balance_of_transient_heat(record_property):
    """Insulated bodies that slide: what friction does is stored, step by step."""
    scene = stack("quadrilateral", (5, 3), widths=[1.0, 0.5])
    V, W = compat.vector_space(scene.mesh, 1), field_space(scene.mesh, 1)
    u, T, old = (fem.Function(S) for S in (V, W, W))
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = Contact(u, scene.facet_tags, [pair], friction=Coulomb(MU))
    flux = Flux(contact, T, of_pressure, friction_heat=0.3)
    v, s = ufl.TestFunction(V), ufl.TestFunction(W)
    dt, capacity = 0.1, 2.0
    forms = [
        ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx,
        conduction(scene, T, CONDUCTIVITY) + capacity / dt * (T - old) * s * ufl.dx,
    ]
    move = fem.Constant(scene.mesh, np.zeros(2))
    top = scene.facet_tags.find(scene.tags["top"])
    dofs = fem.locate_dofs_topological(V, 1, top)
    bcs = [fem.dirichletbc(move, dofs, V), fix(V, scene, "bottom")]
    problem = NonlinearProblem(forms, [contact, flux], bcs, u=[u, T])
    stored = compat.form(capacity / dt * (T - old) * ufl.dx)
    total = 0.0
    for k in range(5):
        contact.dt = dt
        move.value[:] = [0.08 * k, -DEPTH]
        problem.solve()
        rates = flux.rates()
        gained = COMM.allreduce(fem.assemble_scalar(stored))
        heat = rates.slave_heat + rates.master_heat
        assert abs(gained - heat) <= 1e-10 * max(heat, 1e-3), (gained, heat)
        assert abs(heat * dt - contact.friction_work()) <= 1e-12
        total += heat
        old.x.array[:] = T.x.array
        contact.advance()
    assert total > 1e-3
