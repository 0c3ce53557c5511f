"""GRECO's plate (Raous; code_aster SSNV128): opening, slip and stick on one edge.

Half of a plate rests on a rigid plane with friction, pressed from above and pushed
along from its free side.
"""

import numpy as np
from dolfinx import fem
from problems import COMM, build, fix

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks

SIDE, STEPS = 0.04, 5  # m
# A hundredth of modulus over cell, code_aster's choice too. The automatic coefficient
# is about E / h and takes twice the iterations; no line search, and neither converges
GAMMA = 1e12  # Pa / m
# Nominal stress on the loaded sides, Pa
LOAD = -np.diag([15e7, 5e7])
FORCE = 5e7 * SIDE  # N per thickness, pressed on the plane


def plate(cell):
    sides = {"left": 1, "right": 2, "bottom": 3, "top": 4}
    body = Block((32, 10), (0.0, 0.0), (SIDE, SIDE), tags=sides)
    below = Block(
        (7, 1), (-0.2 * SIDE, -0.1 * SIDE), (1.1 * SIDE, 0.0), tags={"top": 5}
    )
    mesh, cells, facets = assemble_blocks(COMM, [below, body], cell)
    tags = {"left": 1, "right": 2, "slave": 3, "top": 4, "master": 5}
    return Scene(mesh, cells, facets, tags)


def supports(V, scene):
    """Symmetry, and the plane at rest with all its cells."""
    rest = fem.Function(V)
    dofs = fem.locate_dofs_topological(V, 2, scene.cell_tags.find(1))
    W, _ = V.sub(1).collapse()
    corner = fem.locate_dofs_geometrical(
        (V.sub(1), W), lambda x: np.hypot(x[0] - SIDE, x[1]) < 1e-9 * SIDE
    )
    held = fem.Function(W)
    return [
        fem.dirichletbc(rest, dofs),
        fix(V, scene, "right", 0),
        fem.dirichletbc(held, corner, V.sub(1)),
    ]


def problem(cell, degree, gamma=GAMMA):
    """The plate, and what sets its load."""
    scene = plate(cell)
    found = build(
        scene,
        degree,
        method=raymortar.AugmentedLagrangian(gamma, condition="points"),
        E=1.3e11,
        nu=0.2,
        bcs=supports,
        loaded=("left", "top"),
        friction=raymortar.Coulomb(1.0),
    )

    def apply(factor):
        found.load.value[:] = factor * LOAD

    return found, apply


def solve(cell, degree, gamma=GAMMA):
    found, apply = problem(cell, degree, gamma)
    solver = raymortar.SNESSolver(found.problem, {"snes_linesearch_type": "l2"})
    return found, raymortar.LoadSteps(solver, apply, steps=STEPS).run()
