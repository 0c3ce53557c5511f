"""A slit inside a block closes, slides with friction and opens again (M5)."""

from __future__ import annotations

import warnings

import gathered
import numpy as np
import pytest
import ufl
from balances import out_of_balance
from dolfinx import fem
from folding import SKIN
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import (
    Contact,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    tools,
)

E, MU, GAP = 10.0, 0.1, 0.03
X, Y = (0.0, 0.5, 1.5, 2.0), (0.0, 0.5, 0.5 + GAP, 1.0 + GAP)
CELLS = (4, 8, 4), (4, 1, 4)
# Where the top is moved to, in turn: the slit closes, slides to and fro, and opens
CORNERS = ((0.0, -0.12), (0.1, -0.12), (-0.05, -0.12), (0.0, 0.05), (0.0, 0.0))


def slit_block():
    """A block around a slit whose sides are one tag, and two at its bottom and top."""
    blocks = []
    for i, j in np.ndindex(3, 3):
        if (i, j) == (1, 1):
            continue
        sides = {"bottom": 1} if j == 0 else {"top": 2} if j == 2 else {}
        if i == 1:
            sides = sides | ({"top": SKIN} if j == 0 else {"bottom": SKIN})
        if j == 1:
            sides = {"right": SKIN} if i == 0 else {"left": SKIN}
        low, high = (X[i], Y[j]), (X[i + 1], Y[j + 1])
        blocks.append(Block((CELLS[0][i], CELLS[1][j]), low, high, tags=sides))
    tags = {"bottom": 1, "top": 2, "skin": SKIN}
    return Scene(*assemble_blocks(COMM, blocks, "quadrilateral"), tags, {"body": 1})


def closed_and_opened(steps):
    """Follow the path; at each corner the largest overlap and the imbalance of forces."""
    scene = slit_block()
    V = tools.vector_space(scene.mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    F = ufl.Identity(2) + ufl.grad(u)
    log = ufl.ln(ufl.det(F))
    energy = E * (0.5 * (ufl.inner(F, F) - 2) - log + log**2) * ufl.dx(degree=3)
    moved = fem.Constant(scene.mesh, np.zeros(2))
    foot = tools.prescribe(V, scene.find("bottom"))
    top = tools.prescribe(V, scene.find("top"), moved)
    contact = Contact(u, scene.facet_tags, [(SKIN, SKIN)], Penalty(1e3), Coulomb(MU))
    problem = NonlinearProblem(ufl.derivative(energy, u, v), contact, [foot, top])
    reactions = {"foot": [foot], "top": [top]}
    history = History(problem, reactions=reactions, energy=energy, works={"top": [top]})
    solver, start, found = SNESSolver(problem), np.zeros(2), []
    for k, corner in enumerate(CORNERS):

        def apply(t, start=start, way=np.array(corner) - start):
            moved.value[:] = start + (t - k) * way

        path = LoadSteps(solver, apply, steps, path=(k, k + 1), history=history)
        with warnings.catch_warnings():
            # Where the halves have come apart, energies are rounding errors
            warnings.filterwarnings("error", "a snap was passed")
            path.run()
        start = np.array(corner)
        points = gathered.points(contact)
        closed = points["status"] >= 2
        found.append(
            (points, closed, out_of_balance(contact) if closed.any() else None)
        )
    return u, history, found


@pytest.mark.mpi
def test_a_slit_closes_slides_and_opens():
    lost = []
    for steps in (4, 8):
        u, history, found = closed_and_opened(steps)
        for k, (points, closed, balance) in enumerate(found):
            assert closed.any() == (k < 3)
            if not closed.any():
                continue
            assert points["gap"].min() > -0.03  # a quarter of a facet
            force, moment = balance
            assert force < 1e-13 and moment < 1e-12
            pressure, traction = points["pressure"], points["traction"]
            along = np.linalg.norm(traction, axis=1) ** 2 - pressure**2
            along = np.sqrt(np.maximum(along, 0.0))
            slips = points["status"] == 3
            size = np.abs(pressure).max()
            np.testing.assert_allclose(
                along[slips], MU * np.abs(pressure[slips]), atol=1e-7 * size
            )
            assert k == 0 or slips.any()
        # What the supports carry is in balance, and nothing is left of the path
        push, hold = (history[f"reaction_{name}_y"] for name in ("top", "foot"))
        np.testing.assert_allclose(push + hold, 0.0, atol=1e-7 * np.abs(push).max())
        assert COMM.allreduce(np.abs(u.x.array).max(initial=0.0)) < 1e-8
        heat = history["friction_work"][-1]
        assert heat > 0.0
        lost.append(history["work_top"][-1] / heat - 1.0)
    # Work of forces at the ends of steps: of first order in the step
    assert abs(lost[1]) < 0.6 * abs(lost[0]) < 0.1
