"""Edges of slave and master that coincide, as rims and lines of symmetry do.

Rounding then decides whether an edge cuts a slave facet, and segments gain and lose
vertices from one iteration to the next. With integration points that hop with the
number of vertices Newton's method goes to and fro at 1e-4 to 1e-6 of the first residual.
"""

import numpy as np
import pytest
from problems import COMM, build, fix

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_blocks
from raymortar import Coulomb, Search

MAX_ITERATIONS = 9


def sheared(below, above, down, **sizes):
    """Blocks of hexahedra, pressed together and shifted with friction."""
    scene = two_blocks(COMM, 3, "hexahedron", below, above, **sizes)
    return build(
        scene,
        1,
        "neo-hookean",
        E=10.0,
        friction=Coulomb(0.3),
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", 2, -down),
            fix(V, scene, "top", 1, 0.0),
            fix(V, scene, "top", 0, 0.004),
        ],
    )


def bent(x):
    """Points moved along the interface, but for its rim: cells have bent edges."""
    bubble = np.prod(4 * x[:, :2] * (1 - x[:, :2]), axis=1)
    along = 0.1 * bubble * np.sin(2 * np.pi * x[:, 0])
    return x + along[:, None] * np.array([0.5, 0.7, 0.0])


def boxed(n, **options):
    """Hexahedra of degree 2 with bent edges, pressed in a box by a fifth."""
    rim = ("left", "right", "front", "back")
    tags = [
        {name: 10 * body + k for k, name in enumerate(("bottom", "top", *rim))}
        for body in (1, 2)
    ]
    mesh, cell_tags, facet_tags = assemble_blocks(
        COMM,
        [
            Block(
                (n + 1, n + 1, 1), (0, 0, 0), (1, 1, 0.5), mapping=bent, tags=tags[0]
            ),
            Block((n, n, 1), (0, 0, 0.5), (1, 1, 1), tags=tags[1]),
        ],
        "hexahedron",
        2,
    )
    named = {f"{name}_{body}": t for body in (0, 1) for name, t in tags[body].items()}
    named |= {"slave": tags[1]["bottom"], "master": tags[0]["top"]}
    scene = Scene(mesh, cell_tags, facet_tags, named, {"lower": 1, "upper": 2})

    def conditions(V, scene):
        sides = [
            fix(V, scene, f"{name}_{body}", k // 2, 0.0)
            for k, name in enumerate(rim)
            for body in (0, 1)
        ]
        pressed = [fix(V, scene, "bottom_0", 2), fix(V, scene, "top_1", 2, -0.2)]
        return [*sides, *pressed]

    return build(scene, 2, "neo-hookean", E=10.0, bcs=conditions, **options)


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("subdivide", [False, True])
@pytest.mark.parametrize("n", [2, 3])
def test_newton_converges_on_curved_facets(n, subdivide):
    problem = boxed(n, search=Search(subdivide=subdivide))
    assert problem.solve() <= 5


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("coincident", ["lines of symmetry", "rims"])
def test_newton_converges_quadratically(coincident):
    if coincident == "rims":
        problem = sheared((3, 3, 1), (4, 4, 1), 0.05)
    else:
        sizes = {"lower_size": (1.0, 1.0, 0.5), "upper_size": (0.8, 0.8, 0.5)}
        problem = sheared((4, 4, 2), (6, 6, 2), 0.02, **sizes)
    assert problem.solve() <= MAX_ITERATIONS
    r = np.array(problem.history) / problem.history[0]
    # The last two steps, where nothing changes any more but what coincides
    assert r[-1] < 1e-2 * r[-2] < 1e-2
