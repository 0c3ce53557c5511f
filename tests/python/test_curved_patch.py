"""Patch test on curved interfaces (A4, G-6): quadratic geometry, unrelated nodes.

Both bodies have the same parabola or paraboloid as interface. The traction p n dG is
polynomial, so that a hydrostatic state is exact if and only if the segments break where
the true edges of the master are.
"""

import itertools

import numpy as np
import pytest

from problems import COMM, DIMENSION, build, fix, squeezed
from raymortar import Search, compat
from raymortar.scenes import two_blocks
from test_coverage import ROTATION, touch, worst
from test_patch import METHODS, check_hydrostatic

# Integrates the normal of a quadratic facet times two shape functions exactly
DEGREE = {"interval": 5, "facet": 6}
COVERAGE = 1e-12


def bowl(x):
    """Height of the interface over lateral points."""
    return 1.0 + 0.2 * np.sum((x - 0.5) ** 2, axis=1)


def blocks(cell, **options):
    """Two blocks with the bowl between them."""
    dim = DIMENSION[cell]
    below, above = ((5, 3), (4, 3)) if dim == 2 else ((3, 3, 1), (2, 2, 1))
    return two_blocks(COMM, dim, cell, below, above, 2, interface=bowl, **options)


@pytest.mark.parametrize("swap", [False, True])
def test_hydrostatic_pressure_on_a_curved_interface(cell, swap):
    dim = DIMENSION[cell]
    check_hydrostatic(
        blocks(cell),
        np.eye(dim)[-1],
        2,
        METHODS["normal"],
        swap=swap,
        quadrature_degree=DEGREE["interval" if dim == 2 else "facet"],
    )


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.0, 0.03, -0.03])
@pytest.mark.parametrize("swap", [False, True])
def test_curved_surfaces_are_covered(cell, swap, gap):
    """By a larger master, and where the rims coincide."""
    dim = DIMENSION[cell]
    pair = ("master", "slave") if swap else ("slave", "master")
    larger = "upper_size" if swap else "lower_size"
    sizes = {} if gap == 0.0 else {larger: (1.3,) * (dim - 1) + (1.0,)}
    scene = blocks(cell, gap=gap, rotation=ROTATION[dim], **sizes)
    for degree in (1, 2):
        contact = touch(scene, [pair], degree)
        segments = contact.zones[0].cpp.segments()
        assert worst(segments["covered"] - 1.0) <= COVERAGE
        # Newton's method has found all there is to find
        assert np.all(contact.points()["status"] >= 1)


def bend_within(scene, amplitude):
    """Move the nodes of the lower block among each other: straight edges of the
    interface become arcs within it, those of the rim stay."""
    x = scene.mesh.geometry.x
    cells = scene.cell_tags.find(scene.bodies["lower"])
    nodes = np.unique(compat.geometry_dofmap(scene.mesh)[cells])
    lateral = np.sin(np.pi * x[nodes, :2]).prod(axis=1) * x[nodes, 2]
    x[nodes, :2] += amplitude * lateral[:, None] * (1.0, -1.0)


def in_a_box(V, scene):
    """Squeezed, with no normal displacement on all lateral sides."""
    sides = itertools.product(("lower", "upper"), enumerate(("right", "back")))
    return squeezed(V, scene) + [
        fix(V, scene, f"{block}_{side}", axis) for block, (axis, side) in sides
    ]


@pytest.mark.parametrize("n", [2, 4])
def test_edges_bent_within_a_flat_interface(n, record_property):
    """The rims of both bodies coincide but for what the chords of bent edges do to the
    surfaces: crossings of rims must not wander along them, or Newton's method stalls.
    """
    errors = []
    for subdivide in (False, True):
        scene = two_blocks(COMM, 3, "hexahedron", (n + 1, n + 1, 1), (n, n, 1), 2)
        bend_within(scene, 0.1)
        search = Search(subdivide=subdivide)
        case = build(scene, 2, "neo-hookean", bcs=in_a_box, search=search)
        assert case.solve() <= 5
        exact = np.diag([0.0, 0.0, -0.2])
        errors.append(np.linalg.norm(case.gradient() - exact, axis=(2, 3)).mean())
    record_property("errors", errors)
    # The strain is 0.2: there is an error, and it is that of the chords
    assert 1e-6 < errors[0] < 2e-4
    assert errors[1] < 0.2 * errors[0]
