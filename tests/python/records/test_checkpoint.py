"""Paths that stop and go on from a file, on any number of ranks."""

from __future__ import annotations

from mpi4py import MPI

import hosts
import numpy as np
import pytest
import restarts
from dolfinx import fem
from partitions import scattered
from problems import COMM, worst

from raymortar import AugmentedLagrangian, Checkpoint, ContactError
from raymortar.core import compat
from raymortar.io.partitions import strips
from raymortar.records.facet_tables import _Slots
from raymortar.records.tables import MARK

pytestmark = pytest.mark.mpi


def by_place(model):
    """Unknowns at the nodes of all ranks, by place."""
    functions = model.problem.contact.unknowns.functions
    return hosts.by_place(*functions)


def assert_same_path(one, other, tolerance=1e-10):
    """Records of two histories, each over the largest of its column."""
    a, b = (np.array(model.history.rows)[:, 3:] for model in (one, other))
    size = np.nanmax(np.abs(a), axis=0, initial=0.0)
    # A column of rounding errors is as exact as the largest other one
    off = np.nan_to_num(np.abs(a - b)) / (size + 1e-2 * size.max())
    assert off.max() <= tolerance


@pytest.mark.parametrize("name", [*restarts.CASES, *restarts.FIXED])
def test_a_path_goes_on_as_if_it_had_not_stopped(name, folder):
    path, stops = folder / "path.chk", restarts.STEPS // 2
    through = restarts.model(name, COMM)
    checkpoint, iterations = through.checkpoint(path), []
    assert not checkpoint.exists()
    for step in through.steps(0, restarts.STEPS):
        iterations.append(step.iterations)
        if step.number == stops:
            checkpoint.write(stops / restarts.STEPS)
            assert checkpoint.exists()
    restarted = restarts.model(name, COMM)
    assert restarted.checkpoint(path).read() == stops / restarts.STEPS
    assert restarted.problem.steps_accepted == stops
    steps = restarted.follow(stops, restarts.STEPS)
    assert [step.iterations for step in steps] == iterations[stops:]
    assert [step.number for step in steps][-1] == restarts.STEPS
    assert_same_path(through, restarted)
    a, b = (m.problem.contact.unknowns.values() for m in (through, restarted))
    assert worst(a - b) <= 1e-10 * worst(a)


@pytest.mark.parametrize("rolled_back", [False, True])
def test_friction_that_nothing_feels_goes_on(rolled_back, folder):
    """From a file, and after a step that has been gone back from, to rounding."""
    through, other = (restarts.model("held along the surface", COMM) for _ in "ab")
    half = restarts.STEPS // 2
    through.follow(0, half)
    contact = through.problem.contact
    through.checkpoint(folder / "path.chk").write(0.5)
    expected = contact.resultant(0).force.copy()
    assert expected[0] == pytest.approx(-0.3 * expected[1], rel=1e-3)
    through.follow(half, restarts.STEPS)
    if rolled_back:
        other.follow(0, half)
        state = other.problem.contact.state()
        other.follow(half, restarts.STEPS)
        other.problem.contact.restore(state)
    else:
        other.checkpoint(folder / "path.chk").read()
    other.follow(half, restarts.STEPS)
    assert contact.resultant(0).force[0] == pytest.approx(expected[0], rel=1e-10)
    one, two = (m.problem.contact.multiplier.x.array for m in (through, other))
    assert worst(one - two) <= 1e-12 * worst(one)


@pytest.mark.parametrize("name", restarts.CASES)
@pytest.mark.parametrize("first", [True, False])
def test_other_ranks_go_on_from_it(name, first, folder):
    """Rank 0 alone writes and all read, or the other way round; on one rank alone there
    is nothing to exchange."""
    path, stops = folder / "path.chk", restarts.STEPS // 2
    alone = COMM.Split(COMM.rank)
    comms = (alone, COMM) if first else (COMM, alone)
    models = []
    for comm, partition, ends in zip(comms, (strips, scattered), ((0, stops), None)):
        mine = comm is COMM or COMM.rank == 0
        model = restarts.model(name, comm, partition) if mine else None
        if ends and model:
            model.follow(*ends)
            model.checkpoint(path).write(0.5)
        elif model:
            assert model.checkpoint(path).read() == 0.5
            points = model.more[0] if model.more else None
            if points is not None:  # places of the points
                exact = restarts.points_of(points.function_space.mesh)
                np.testing.assert_allclose(points.x.array, exact.x.array, atol=1e-14)
            model.follow(stops, restarts.STEPS)
        COMM.barrier()
        models.append(model)
    through = restarts.model(name, COMM)
    through.follow(0, restarts.STEPS)
    if models[1] is not None:
        assert_same_path(through, models[1], 1e-9)


def test_meshes_of_their_own_in_other_parts(folder):
    """Each with its cells on other ranks."""
    path, results = folder / "path.chk", []
    for partition in (strips, scattered):
        found = hosts.apart(hosts.meshes(partition=partition), degree=2)
        model = restarts.pushed(found)
        if partition is strips:
            model.follow(0, 2)
            model.checkpoint(path).write(0.5)
        else:
            model.checkpoint(path).read()
        model.follow(2, restarts.STEPS)
        results.append(by_place(model))
    assert worst(results[0] - results[1]) <= 1e-10 * worst(results[0])


def test_coefficients_that_a_path_has_changed_are_kept(folder):
    model = restarts.model("springs", COMM)
    model.problem.contact.set_gamma(0.3e5)
    model.checkpoint(folder / "path.chk").write(0.0)
    other = restarts.model("springs", COMM)
    other.checkpoint(folder / "path.chk").read()
    assert other.problem.contact.gamma == 0.3e5


@pytest.mark.parametrize("name", [*restarts.CASES, *restarts.FIXED])
def test_it_has_all_that_a_state_has(name, folder):
    """Who extends a state extends the file."""
    path, one, other = folder / "path.chk", *(restarts.model(name, COMM) for _ in "ab")
    one.follow(0, 2)
    one.checkpoint(path).write(0.5)
    other.checkpoint(path).read()
    states = one.problem.contact.state(), other.problem.contact.state()
    assert states[0].keys() == states[1].keys()
    for name, array in states[0].items():
        assert np.array_equal(array, states[1][name]), name


# What is refused


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A file of a path, and its bytes."""
    path = COMM.bcast(tmp_path_factory.mktemp("checkpoint"), root=0) / "path.chk"
    model = restarts.model("springs", COMM)
    model.follow(0, 1)
    model.checkpoint(path).write(0.25)
    return path, path.read_bytes()


def refused(path, match, **options):
    """A problem whose checkpoint is refused, and stays as it was."""
    model = restarts.model("springs", COMM)
    before = model.problem.u.x.array.copy()
    with pytest.raises(ContactError, match=match):
        model.checkpoint(path, **options).read()
    assert np.array_equal(model.problem.u.x.array, before)


@pytest.mark.quick
@pytest.mark.parametrize("share", [0.0, 0.001, 0.01, 0.1, 0.9])
def test_a_file_that_is_cut_short_is_refused(written, folder, share):
    path = folder / "cut.chk"
    if COMM.rank == 0:
        path.write_bytes(written[1][: int(share * len(written[1]))])
    COMM.barrier()
    refused(path, "is cut short|no checkpoint of raymortar")


@pytest.mark.quick
def test_what_is_no_checkpoint_is_refused(folder):
    refused(folder / "none.chk", "none.chk cannot be read")
    if COMM.rank == 0:
        (folder / "other.chk").write_text("time,iterations\n" * 20)
    COMM.barrier()
    refused(folder / "other.chk", "is no checkpoint of raymortar")


def changed(**options):
    """The blocks of the file in another way."""
    given = {"friction": None} | options
    return restarts.blocks(COMM, strips, **given)


@pytest.mark.quick
@pytest.mark.parametrize(
    "options, match",
    [
        (
            {"cell": "triangle"},
            "mesh 0 has 25 cells with 12 values, here are 50 with 9",
        ),
        ({"degree": 2}, "unknown.* has 25 cells with 8 values, here are 25 with 18"),
        ({}, "it has slip 0, here is multiplier 0"),
    ],
)
def test_another_problem_is_named(written, options, match):
    model = changed(**options)
    with pytest.raises(ContactError, match=match):
        model.checkpoint(written[0], history=None).read()


def nodes(multiplier):
    """The blocks with a law at nodes."""
    return changed(method=AugmentedLagrangian(condition="nodes", multiplier=multiplier))


def test_another_law_is_named_where_the_file_knows(folder):
    path, kept = folder / "points.chk", b', "law": "condition=\'points\'"'
    changed().checkpoint(path).write(0.0)
    for multiplier, said in ((None, ""), ("dual", "multiplier='dual' and ")):
        match = rf"contact\[0\] has condition='points', here is {said}condition='nodes'"
        with pytest.raises(ContactError, match=match):
            nodes(multiplier).checkpoint(path).read()
    if COMM.rank == 0:
        whole = path.read_bytes()
        assert whole.count(kept) == 1
        start = len(MARK)
        size = int.from_bytes(whole[start : start + 8], "little") - len(kept)
        head = MARK + size.to_bytes(8, "little")
        path.write_bytes(head + whole[start + 8 :].replace(kept, b""))
    COMM.barrier()
    assert nodes(None).checkpoint(path).read() == 0.0


@pytest.mark.quick
def test_a_mesh_that_has_other_places_is_named(written):
    model = restarts.model("springs", COMM)
    model.problem.u.function_space.mesh.geometry.x[:, 0] *= 1.001
    with pytest.raises(ContactError, match="cell 0 of mesh 0 is at another place"):
        model.checkpoint(written[0]).read()


@pytest.mark.quick
def test_other_functions_and_columns_are_named(written):
    refused(written[0], r"it has more\[0\] .*, which is not here", more=[])
    model = restarts.model("springs", COMM)
    model.history.include({"extra": lambda: 0.0})
    with pytest.raises(ContactError, match="its history has the columns"):
        model.checkpoint(written[0]).read()


@pytest.mark.quick
def test_functions_that_a_file_cannot_have_are_refused(folder):
    model, path = restarts.model("springs", COMM), folder / "path.chk"
    mesh = model.problem.u.function_space.mesh
    for thing in (3, fem.Function(compat.scalar_space(hosts.blocks().mesh, 1))):
        with pytest.raises(ContactError, match="no Function on the mesh of a displac"):
            Checkpoint(model.problem, path, more=[thing])
    cubic = fem.Function(compat.scalar_space(mesh, 3), name="cubic")
    with pytest.raises(ContactError, match="cubic is in a space whose dofs depend on"):
        Checkpoint(model.problem, path, more=[cubic])
    with pytest.raises(ContactError, match="history must be a History, not 3"):
        Checkpoint(model.problem, path, history=3)
    with pytest.raises(ContactError, match="time must be a load factor, not 'end'"):
        model.checkpoint(path).write("end")
    with pytest.raises(ContactError, match="nowhere/path.chk.* cannot be written"):
        model.checkpoint(folder / "nowhere" / "path.chk").write(0.0)


@pytest.mark.quick
@pytest.mark.parametrize("facets", [0, 2])
def test_rows_of_a_rank_have_as_many_columns_with_facets_as_without(facets):
    """Some partitions leave a rank without slave facets."""
    dofs = np.tile([1, 2], (facets, 1))
    slots = _Slots(None, np.arange(facets), dofs, 4)
    for width in ((), (2,)):
        rows = slots.row(np.ones((facets, 2, *width)))
        assert rows.shape == (facets, 4 * np.prod(width, dtype=int))
