"""How much of a body lies behind its facets."""

import numpy as np
import pytest
from problems import COMM, DIMENSION, stack, worst
from rotations import ROTATION

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar.core.discretization.facets import facet_corners, tagged_facets
from raymortar.setup import thickness

HEIGHTS = (0.2, 0.4, 1.0)
ROUNDING = 1e-13


def behind(mesh, facet_tags, tag, most):
    facets = tagged_facets(mesh, facet_tags, tag, "master")
    return thickness.thickness_behind(thickness.Cells(mesh), facets, most)


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("turned", [False, True])
def test_blocks_are_as_thick_as_they_are(cell, turned):
    """Whatever they touch or overlap, and however they are spread over ranks."""
    R = ROTATION[DIMENSION[cell]] if turned else None
    scene = stack(cell, (4, 3, 5), HEIGHTS, (0.0, -0.1, 0.0), rotation=R)
    for i, height in enumerate(HEIGHTS):
        sides = {"top": height, "bottom": height, "left": 1.0, "right": 1.0}
        for side, expected in sides.items():
            args = (scene.mesh, scene.facet_tags, scene.tags[f"{side}_{i}"])
            assert worst(behind(*args, 10.0) - expected) <= ROUNDING
            assert worst(behind(*args, 0.3) - min(0.3, expected)) <= ROUNDING


@pytest.mark.mpi
def test_the_way_goes_along_the_normal_of_each_facet(cell):
    """Through a wedge it is as long as the wedge is thick there."""
    dim, n = DIMENSION[cell], 7

    def wedge(x):
        y = x.copy()
        y[:, -1] *= 0.1 + 0.2 * x[:, 0]
        return y

    tags = {"bottom": 1}
    block = Block((n,) * dim, (0.0,) * dim, (1.0,) * dim, mapping=wedge, tags=tags)
    mesh, _, facet_tags = assemble_blocks(COMM, [block], cell, 1)
    facets = tagged_facets(mesh, facet_tags, 1, "master")
    middle = facet_corners(mesh, facets).mean(axis=1)
    found = behind(mesh, facet_tags, 1, 1.0)
    assert worst(found - 0.1 - 0.2 * middle[:, 0]) <= ROUNDING


@pytest.mark.mpi
def test_a_long_way_is_cut_off(cell_2d, monkeypatch):
    """What comes back is a length that lies behind for certain."""
    monkeypatch.setattr(thickness, "MOST_CELLS", 4)
    scene = stack(cell_2d, (2, 16), (1.0, 1.0))
    found = behind(scene.mesh, scene.facet_tags, scene.tags["top_1"], 10.0)
    assert np.all(found < 0.3) and np.all(found > 0.1)
