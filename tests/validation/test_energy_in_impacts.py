"""Impacts and stick without a source of energy: what contact takes, it gives back."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from materials import lame, neo_hookean_energy
from problems import COMM

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import AugmentedLagrangian, Contact, Coulomb, dynamics, tools

POINTS = AugmentedLagrangian()
DUAL = AugmentedLagrangian(condition="nodes", multiplier="dual")
SLAVE, MASTER, HELD, LED = 1, 2, 3, 4
E, NU = 10.0, 0.3


def block_above(n, lower, upper, ends, round_by):
    """Two blocks in 2D, the upper one with a round lower face over its middle: n cells
    along lower and upper, and ends of their first axes."""
    (low, high), gap = ends, 0.02
    top = lower + gap + upper

    def rounded(x):
        height = round_by * (x[:, 0] - 0.5 * sum(high)) ** 2 * (top - x[:, 1]) / upper
        return x + np.outer(height, [0.0, 1.0])

    blocks = [
        Block((n[0], 3), (low[0], 0.0), (low[1], lower),
              tags={"bottom": HELD, "top": MASTER}),
        Block((n[1], 3), (high[0], lower + gap), (high[1], top), mapping=rounded,
              tags={"bottom": SLAVE, "top": LED}),
    ]  # fmt: skip
    mesh, _, facets = assemble_blocks(COMM, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V, name="u"), ufl.TestFunction(V)
    F = ufl.Identity(2) + ufl.grad(u)
    energy = neo_hookean_energy(F, *lame(E, NU)) * ufl.dx(mesh, degree=2)
    return facets, V, u, v, energy


def kept(method, n, dt):
    """Energy after an oblique impact of two free blocks, over that before."""
    facets, V, u, v, energy = block_above(n, 0.5, 0.5, ((0.0, 1.5), (0.35, 1.25)), 0.3)
    contact = Contact(u, facets, [(SLAVE, MASTER)], method)
    problem = raymortar.NonlinearProblem(ufl.derivative(energy, u, v), contact)
    mass = ufl.inner(ufl.TrialFunction(V), v) * ufl.dx
    velocity = fem.Function(V)
    velocity.interpolate(
        lambda x: np.where(x[1] > 0.51, [[0.2], [-0.3]], 0.0) + 0.0 * x[:2]
    )
    history = raymortar.History(problem)
    dynamics.TimeSteps(
        problem.snes_solver, dynamics.Inertia(mass, contact, "nearest"), end=0.6, dt=dt,
        scheme=dynamics.Midpoint(), velocity=velocity, energy=energy, history=history,
        progress=False,
    ).run()  # fmt: skip
    assert history["active"].max() > 0 and history["active"][-1] == 0
    whole = history["kinetic"] + history["elastic"]
    return whole[-1] / whole[0]


@pytest.mark.parametrize(
    "n, dt", [((6, 4), 0.005), ((12, 8), 0.01), ((24, 16), 0.01)], ids=str
)
def test_dual_multipliers_give_an_impact_no_energy(n, dt):
    assert kept(DUAL, n, dt) == pytest.approx(kept(POINTS, n, dt), abs=2e-3)


@pytest.mark.parametrize("upper", [(0.5, 1.4), (0.8, 2.4)], ids=["above", "overhang"])
@pytest.mark.parametrize("n", [(8, 6), (16, 12)], ids=str)
def test_stick_takes_no_work(n, upper):
    """A round block pressed down and dragged without slip: over the whole lower one, and
    over its edge."""
    facets, V, u, v, energy = block_above(n, 0.4, 0.5, ((-0.1, 2.0), upper), 0.25)
    top = fem.Constant(V.mesh, np.zeros(2))
    bcs = [
        tools.prescribe(V, facets.find(HELD)),
        tools.prescribe(V, facets.find(LED), top),
    ]
    contact = Contact(u, facets, [(SLAVE, MASTER)], DUAL, friction=Coulomb(10.0))
    problem = raymortar.NonlinearProblem(ufl.derivative(energy, u, v), contact, bcs)
    history = raymortar.History(problem, energy=energy, works={"top": bcs[1]})

    def lead(t):
        top.value = [0.05 * max(0.0, 2 * t - 1), -0.08 * min(1.0, 2 * t)]

    raymortar.LoadSteps(
        problem.snes_solver, lead, 20, history=history, progress=False
    ).run()
    done, stored = history["work_top"], history["energy"]
    assert history["active"][-1] > 0
    assert np.diff(history["friction_work"]).min() >= -1e-12 * done[-1]
    # The work of normal tractions is zero but for what a step opens and closes
    assert np.abs(done - stored - history["friction_work"]).max() <= 8e-3 * done[-1]
