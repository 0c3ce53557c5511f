"""The multiplier follows a smooth pressure without oscillating.

Two layers with rollers on their sides under the pressure 1 + cos(2 pi x) / 2 on top: in
linear elasticity the contact pressure is 1 + a cos(2 pi x) with some a, of total
variation 4 a. Stiffness of the layers a thousand times apart, either way, and the
slave's facets eight times finer or coarser than the master's.
"""


import numpy as np
import pytest
from problems import CELLS_2D
from two_layers import press

RATIOS = [1.0, 1e3, 1e-3]  # of the master's modulus to the slave's
FINER, COARSER = 8, -8


# A slave that is finer and not softer than a master of few facets follows their edges
SMOOTH = [(1.0, COARSER), (1e3, FINER), (1e3, COARSER), (1e-3, COARSER)]


@pytest.mark.mpi(where=lambda ratio, finer, **_: (ratio, finer) == (1e3, FINER))
@pytest.mark.parametrize("ratio, finer", SMOOTH)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS_2D)
def test_total_variation_is_that_of_the_wave(
    cell, degree, ratio, finer, record_property
):
    master, slave = (8, 64) if finer == FINER else (64, 8)
    found = press(cell, degree, master, slave, ratio)
    record_property("variation", [found.variation, 4.0 * found.a, found.rough])
    assert abs(found.mean - 1.0) < 1e-3
    # Eight triangles across a wave have errors of their own
    off = 0.03 if cell == "quadrilateral" or finer == FINER else 0.15
    assert abs(found.variation / (4.0 * found.a) - 1.0) < off


@pytest.mark.mpi(where=lambda degree, ratio, **_: (degree, ratio) == (1, 1.0))
@pytest.mark.parametrize("ratio", [1.0, 1e-3])
@pytest.mark.parametrize("degree, least", [(1, 0.8), (2, 2.0)])
def test_edges_of_a_coarse_master_show_less_as_it_is_refined(
    degree, least, ratio, record_property
):
    """What a finer and stiffer slave feels of them is an error of the master's mesh:
    an instability of the multiplier's would stay."""
    found = [press("quadrilateral", degree, n, 8 * n, ratio).rough for n in (4, 8)]
    record_property("roughness", found)
    assert np.log2(found[0] / found[1]) > least
