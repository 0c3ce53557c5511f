"""Ties at cross points, at corners and next to contact."""

from __future__ import annotations

import gathered
import numpy as np
import pytest
from problems import CELLS, DIMENSION, fix, worst
from tying import (
    AROUND,
    NU,
    E,
    build,
    errors,
    four_blocks,
    linear,
    outer,
    strain_of,
    stress_of,
)

import raymortar
from raymortar import ContactWarning, SNESSolver

TOLERANCE = 1e-10


# Cross points

# Of `AROUND`, undeformed: axis and sign of the slaves' normals
NORMALS = ((0, 1.0), (-1, 1.0), (-1, 1.0), (0, -1.0))


def pulled_around(cell, divisions):
    """Four blocks, each tied to two others, under a uniform stress; the problem."""
    scene = four_blocks(cell, divisions)
    inner = {name for pair in AROUND for name in pair}
    held = ["bottom_0", "bottom_1", "left_0"]
    problem = build(
        scene,
        pairs=AROUND,
        ties=4,
        bcs=lambda V, scene: linear(V, scene, *held),
        loaded=[n for n in outer(scene, *inner) if n not in held],
        load=stress_of(strain_of(DIMENSION[cell])),
    )
    problem.solve(rtol=1e-13)
    return problem


@pytest.mark.mpi
@pytest.mark.parametrize("matching", [False, True])
@pytest.mark.parametrize("cell", CELLS)
def test_four_blocks_around_a_cross_point(cell, matching):
    """The ties ask more of the common node than it can give: three conditions imply the
    fourth. Undamped, the multipliers of matching blocks would be anything."""
    dim = DIMENSION[cell]
    divisions = (2,) * 4 if matching else (3, 4, 5, 2) if dim == 2 else (2, 3, 1, 2)
    problem = pulled_around(cell, divisions)
    assert errors(problem) <= TOLERANCE
    S = stress_of(strain_of(dim))
    for tie, (axis, sign) in zip(problem.problem.contact.contacts, NORMALS):
        exact = sign * S[:, axis]
        assert worst(tie.points()["traction"] - exact) <= 1e-8 * np.linalg.norm(S)


@pytest.mark.parametrize("degree", [1, 2])
def test_the_matrix_is_regular_at_a_cross_point(degree, monkeypatch):
    """It has two zeros where cross points are not seen: one for each component."""

    def least():
        problem = build(
            four_blocks("quadrilateral", (2,) * 4),
            degree,
            pairs=AROUND,
            ties=4,
            bcs=lambda V, scene: linear(V, scene, "bottom_0"),
        )
        problem.solve(SNESSolver)
        A = gathered.dense(problem.solver.snes.getJacobian()[0])
        values = np.linalg.svd(A, compute_uv=False)
        return values[-3:] / values[0]

    assert least()[-1] > 1e-6
    monkeypatch.setattr(
        raymortar.core.system.assembly,
        "crossing",
        lambda tie, _: [
            np.zeros(len(zone.facets.slave_surface.dofs), np.int8) for zone in tie.zones
        ],
    )
    found = least()
    assert found[0] > 1e-6 and found[1] < 1e-14


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_a_tie_that_ends_at_contact(cell):
    """Two columns of two blocks each: tied to each other, and in contact across."""
    dim = DIMENSION[cell]
    scene = four_blocks(cell, (2, 3, 3, 2))
    ties, contacts = AROUND[::3], AROUND[1:3]
    S = np.zeros((dim, dim))
    S[-1, -1] = -100.0
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    trace = np.trace(S) / (2.0 * mu + dim * lmbda)
    H = (S - lmbda * trace * np.eye(dim)) / (2.0 * mu)
    sides = {"bottom_0": dim - 1, "bottom_1": dim - 1, "left_0": 0, "left_2": 0}
    sides |= {f"front_{k}": 1 for k in range(4)} if dim == 3 else {}

    def bcs(V, scene):
        return [
            fix(V, scene, name, i, lambda x, i=i: H[i, i] * x[:, i])
            for name, i in sides.items()
        ]

    problem = build(
        scene,
        pairs=ties,
        bcs=bcs,
        loaded=["top_2", "top_3"],
        load=S,
        others=lambda u: [
            raymortar.Contact(u, scene.facet_tags, [(scene.tags[a], scene.tags[b])])
            for a, b in contacts
        ],
    )
    problem.solve(rtol=1e-13)
    assert worst(problem.gradient() - H) <= TOLERANCE
    tie, *rest = problem.problem.contact.contacts
    for zone in (0, 1):
        assert worst(tie.points(zone)["traction"]) <= 1e-7
    for contact in rest:
        points = contact.points()
        assert worst(points["pressure"] - 100.0) <= 1e-6


@pytest.mark.mpi
def test_corners_of_one_multiplier_are_told_of():
    scene = four_blocks("quadrilateral")
    with pytest.warns(ContactWarning, match="turns by more than 60 degrees at 1 node"):
        build(scene, pairs=AROUND[:2])
