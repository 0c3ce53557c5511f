"""A face of a slave that has passed an edge of the master does not meet the face in front
of that edge [theory, Edges of the master]."""

import numpy as np
import pytest
from problems import COMM, DIMENSION, build

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import Penalty

TAGS = {"slave": 1, "master": 2}
TILT, SUNK = 0.09, 0.01


def hook(cell, front):
    """A tilted block on the left edge of another one, which has sunk a little into its foot.
    Its front face is `front` beyond the edge."""
    dim = DIMENSION[cell]
    near, far = (0.0,) * (dim - 2), (1.0,) * (dim - 2)
    lower = (0.0, *near, -0.5), (1.0, *far, 0.0)
    upper = (front - 1.0, *near, 0.0), (front, *far, 0.5)
    on = [{"top": TAGS["master"], "left": TAGS["master"]}]
    on += [{"bottom": TAGS["slave"], "right": TAGS["slave"]}]
    blocks = [
        Block((n,) * dim, *at, tags=tags)
        for n, at, tags in zip((4, 5), (lower, upper), on)
    ]
    case = build(Scene(*assemble_blocks(COMM, blocks, cell), TAGS), method=Penalty())
    V, u = case.u.function_space, case.u.x.array.reshape(-1, dim)
    x, z = V.tabulate_dof_coordinates()[:, [0, dim - 1]].T
    c, s = np.cos(TILT), np.sin(TILT)
    moved = np.column_stack([c * x - s * z - x, s * x + c * z - z - SUNK])
    u[:, [0, -1]] = np.where(upper_body(case)[:, None], moved, 0.0)
    case.contact.update()
    return case


def upper_body(case):
    """Which dofs are of the upper block."""
    of = case.contact.system.bodies.dofs
    z = case.u.function_space.tabulate_dof_coordinates()[:, case.dim - 1]
    _, lower = min(COMM.allgather((z.min(), int(of[np.argmin(z)]))))
    return of != lower


@pytest.mark.quick
@pytest.mark.mpi(where=lambda cell, front: front == 0.15)
@pytest.mark.parametrize("front", [0.15, 0.3, 0.7])
def test_the_force_is_that_of_the_face_that_the_edge_sinks_into(cell, front):
    case = hook(cell, front)
    force = case.contact.resultant(0).force
    along, across = np.cos(TILT), np.sin(TILT)
    assert force[-1] > 0.0
    assert abs(force[0] * along + force[-1] * across) < 1e-9 * force[-1]
    points = case.contact.points()
    assert points["gap"][points["status"] > 0].min(initial=0.0) > -2.0 * SUNK
