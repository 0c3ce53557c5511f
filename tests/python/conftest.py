"""What all the Python tests share."""

import pytest

from problems import CELLS, CELLS_2D, CELLS_3D


@pytest.fixture(params=CELLS)
def cell(request):
    """Every cell that is supported."""
    return request.param


@pytest.fixture(params=CELLS_2D)
def cell_2d(request):
    return request.param


@pytest.fixture(params=CELLS_3D)
def cell_3d(request):
    return request.param
