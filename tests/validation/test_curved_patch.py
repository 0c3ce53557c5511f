"""Patch test on curved interfaces (A4, G-6): quadratic geometry, unrelated nodes.

Both bodies have the same parabola or paraboloid as interface. The traction p n dG is
polynomial, so that a hydrostatic state is exact if and only if the segments break where
the true edges of the master are.
"""

import numpy as np
import pytest
from interfaces import bowl
from pairing import touch
from problems import COMM, DIMENSION, worst
from rotations import ROTATION
from uniform import METHODS, check_hydrostatic

from meshes.scenes import two_blocks

# Integrates the normal of a quadratic facet times two shape functions exactly
DEGREE = {"interval": 5, "facet": 6}
COVERAGE = 1e-12


def blocks(cell, **options):
    """Two blocks with the bowl between them."""
    dim = DIMENSION[cell]
    below, above = ((5, 3), (4, 3)) if dim == 2 else ((3, 3, 1), (2, 2, 1))
    return two_blocks(COMM, dim, cell, below, above, 2, interface=bowl, **options)


@pytest.mark.mpi(where=lambda swap, **_: not swap)
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
