"""What all the Python tests share."""

import pytest
from problems import CELLS, CELLS_2D, CELLS_3D, COMM


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


@pytest.fixture
def folder(tmp_path):
    """Temporary folder, the same on every rank."""
    return COMM.bcast(tmp_path, root=0)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Where ``mpi`` says for which parameters, take it off the others."""
    for item in items:
        for mark in list(item.iter_markers("mpi")):
            where = mark.kwargs.get("where")
            if where and not where(**item.callspec.params):
                item.own_markers.remove(mark)
