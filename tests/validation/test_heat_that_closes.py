"""Bars that heat presses together, against their closed form: a conductance that grows
with the pressure, where the warmed bar expands more than the cooled one shrinks."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import Contact, ConvergenceError, LoadSteps, NonlinearProblem, tools
from raymortar.fluxes import Flux

EXPANSION, GAP, CONDUCTANCE = 0.01, 0.01, 1e4
BOTTOM, TOP, SIDES, SLAVE, MASTER = 1, 2, 3, 4, 5
HOT_LOWER, COLD_LOWER = (4.0, 1.0), (1.0, 4.0)  # conductivities of both bars


class Bars:
    """Two bars of length, width and modulus 1 between walls; the lower one is heated."""

    def __init__(self, conductivities):
        self.k = conductivities
        side = {"left": SIDES, "right": SIDES}
        blocks = [
            Block(
                (1, 4),
                (0.0, 0.0),
                (1.0, 1.0),
                tags={"bottom": BOTTOM, "top": SLAVE, **side},
                body="lower",
            ),
            Block(
                (1, 3),
                (0.0, 1.0 + GAP),
                (1.0, 2.0 + GAP),
                tags={"bottom": MASTER, "top": TOP, **side},
                body="upper",
            ),
        ]
        mesh, _, facets = assemble_blocks(MPI.COMM_WORLD, blocks, "quadrilateral")
        V, W = tools.vector_space(mesh, 2), tools.scalar_space(mesh, 1)
        u, T = fem.Function(V, name="u"), fem.Function(W, name="T")
        v, s = ufl.TestFunction(V), ufl.TestFunction(W)
        y = ufl.SpatialCoordinate(mesh)[1]
        k = ufl.conditional(y < 1.0 + GAP / 2, *conductivities)
        strain = ufl.sym(ufl.grad(u)) - EXPANSION * T * ufl.Identity(2)
        forms = [
            ufl.inner(strain, ufl.sym(ufl.grad(v))) * ufl.dx,
            k * ufl.inner(ufl.grad(T), ufl.grad(s)) * ufl.dx,
        ]
        self.heat = fem.Constant(mesh, 0.0)
        bcs = [
            tools.prescribe(V, facets.find(BOTTOM), 0.0, 1),
            tools.prescribe(V, facets.find(TOP), 0.0, 1),
            tools.prescribe(V, facets.find(SIDES), 0.0, 0),
            tools.prescribe(W, facets.find(BOTTOM), self.heat),
            tools.prescribe(W, facets.find(TOP), 0.0),
        ]
        self.contact = Contact(u, facets, [(SLAVE, MASTER)])
        self.flux = Flux(
            self.contact, T, lambda T_s, T_m, p, g, v: CONDUCTANCE * p * (T_s - T_m)
        )
        both = [self.contact, self.flux]
        self.problem = NonlinearProblem(forms, both, bcs, u=[u, T])

    def to(self, hot, begin=0.0, **options):
        """Heat the lower end; return pressure and flux."""

        def apply(t):
            self.heat.value = t

        solver = self.problem.snes_solver
        LoadSteps(solver, apply, path=(begin, hot), **options).run()
        return -self.contact.resultant().force[1], self.flux.rates().through

    def exact(self, hot):
        """Pressure and flux of the closed state that heat closes most."""
        below, above = 0.0, 1.0
        while above - below > 1e-14:
            p = (below + above) / 2
            q = hot / (1 / self.k[0] + 1 / self.k[1] + 1 / (CONDUCTANCE * p))
            lower, upper = hot - q / self.k[0] / 2, q / self.k[1] / 2
            needed = (EXPANSION * (lower + upper) - GAP) / 2
            below, above = (p, above) if needed > p else (below, p)
        return np.array([p, q])


@pytest.mark.mpi
def test_bars_that_close_gently_agree_with_the_closed_form():
    bars = Bars(COLD_LOWER)
    for begin, hot in ((0.0, 1.5), (1.5, 4.0)):
        assert bars.to(hot, begin, steps=2) == pytest.approx(bars.exact(hot), rel=1e-7)


@pytest.mark.mpi
def test_a_jump_of_heat_is_named_and_passed_by_a_larger_step():
    """Small steps end before the jump; one large step arrives beyond it."""
    bars = Bars(HOT_LOWER)
    bars.to(0.9, steps=1)
    options = {"strategy": "halve", "max_halvings": 1}
    with pytest.raises(ConvergenceError, match="by a jump, which a larger step passes"):
        bars.to(1.2, 0.9, steps=1, **options)
    p, q = bars.to(6.0, 0.9, steps=1, **options)
    assert (p, q) == pytest.approx(bars.exact(6.0), rel=1e-7)
