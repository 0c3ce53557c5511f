"""What all the Python tests share."""

import gc
import json
from pathlib import Path

import pytest
from ahead import without
from kept_meshes import kept_meshes
from loaded_forms import keep_loaded_forms
from problems import CELLS, CELLS_2D, CELLS_3D, COMM
from rounding_noise import disturb_tangents
from selection import of_a_push, of_each_file

from raymortar.solvers import correcting
from raymortar.viscous.landing import Landing
from raymortar.viscous.settling import Settling


@pytest.fixture(autouse=True)
def no_mesh_ends_with_an_exception():
    """See `kept_meshes`."""
    with kept_meshes():
        yield


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


@pytest.fixture
def uncorrected(monkeypatch):
    """Paths solve by Newton's method alone, a tangent for each iterate."""
    monkeypatch.setattr(correcting, "has_own_factors", lambda ksp: False)


@pytest.fixture
def not_ahead():
    """Iterations end with the statuses that their linear step has at its begin."""
    with without():
        yield


@pytest.fixture
def unlanded(monkeypatch):
    """Loose bodies fall, turn and slide under viscous forces alone."""
    monkeypatch.setattr(Landing, "land", lambda self: None)
    monkeypatch.setattr(Settling, "settle", lambda self: None)


@pytest.fixture
def record_property(record_property):
    """pytest's, for plain numbers: tests side by side can hand on no others."""

    def record(name, value):
        plain = json.dumps(value, default=lambda array: array.tolist())
        record_property(name, json.loads(plain))

    return record


NIGHTLY = Path(__file__).with_name("nightly.txt")


def pytest_addoption(parser):
    parser.addoption(
        "--without-nightly",
        action="store_true",
        help=f"leave out the long tests, which are listed in {NIGHTLY.name}, and of "
        "each test with parameters members that repeat others",
    )
    parser.addoption(
        "--rounding-noise",
        type=int,
        metavar="SEED",
        help="disturb tangents by random rounding errors, which no test may depend on",
    )


def pytest_configure(config):
    # Collecting makes items by the thousand, which all stay: to look for garbage among
    # them takes a third of its time
    gc.disable()
    keep_loaded_forms()
    seed = config.getoption("--rounding-noise")
    if seed is not None:
        disturb_tangents(seed)


def pytest_collection_finish():
    gc.freeze()
    gc.enable()


def without_nightly(config, items):
    """Deselect what a push leaves to the night."""
    lines = NIGHTLY.read_text(encoding="utf-8").splitlines()
    long_ones = {line for line in lines if not line.startswith("#")}
    chosen = of_a_push(items, long_ones, COMM.size)
    if COMM.size > 1:
        chosen = of_each_file(chosen, long_ones, COMM.size)
    kept = set(chosen)
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = chosen


@pytest.hookimpl(hookwrapper=True)
def pytest_collection_modifyitems(config, items):
    """Where ``mpi`` says for which parameters, take it off the others. Of what marks
    select then, leave out what is for the night."""
    for item in items:
        for mark in list(item.iter_markers("mpi")):
            where = mark.kwargs.get("where")
            if where and not where(**item.callspec.params):
                item.own_markers.remove(mark)
    yield
    if config.getoption("--without-nightly"):
        without_nightly(config, items)
