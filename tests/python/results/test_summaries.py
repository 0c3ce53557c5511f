"""What `repr` says of the objects of a user, and what `dir` lists."""

import numpy as np
import pytest
from load_paths import top_moves
from problems import COMM, build, stack

import raymortar
from meshes.scenes import two_blocks
from raymortar.core.options.friction import Coulomb
from raymortar.results import Status


@pytest.mark.quick
@pytest.mark.mpi
def test_contact_says_what_it_is_before_and_after_the_first_pairing():
    scene = stack("quadrilateral", (3, 4))
    names = {"punch": scene.tags["bottom_1"], "plate": scene.tags["top_0"]}
    u = build(scene, 1).u
    contact = raymortar.Contact(
        u, scene.facet_tags, [("punch", "plate")], names=names, friction=Coulomb(0.25)
    )
    said = repr(contact)
    facets = sum(len(zone.facets.slave_surface.facet_ids) for zone in contact.zones)
    assert said.startswith("<Contact of ('punch', 'plate'); AugmentedLagrangian(), ")
    assert "Coulomb(mu=0.25), gamma not yet set" in said
    assert f"; {facets} slave facets, not yet paired" in said
    contact.set_gamma(12.5)
    contact.update()
    status = contact.points()["status"]
    closed = np.count_nonzero(status >= Status.STICK)
    said = repr(contact)
    assert ", gamma 12.5; " in said
    assert f"{len(status)} of {len(status)} points hit, {closed} closed" in said
    assert ("on rank" in said) == (COMM.size > 1)


def test_options_that_are_no_defaults_are_said():
    scene = stack("quadrilateral", (3, 4))
    u = build(scene, 1).u
    pairs = [(scene.tags["bottom_1"], raymortar.rigid.Line((0.0, 0.0), (0.0, 1.0)))]
    contact = raymortar.Contact(
        u, scene.facet_tags, pairs, raymortar.Penalty(gamma=3.0)
    )
    said = repr(contact)
    assert "'Line'" in said and "Penalty(gamma=3), no friction, gamma 3;" in said


@pytest.mark.quick
@pytest.mark.mpi
def test_problem_steps_and_history_say_what_they_are():
    problem, steps = top_moves("quadrilateral", steps=2)
    history = raymortar.History(problem.problem)
    assert "at load factor 0, 0 halvings" in repr(steps)
    for _ in steps:
        history.record(1.0)
    assert f"from 0 to 1 in 2 steps with {type(steps.solver).__name__}" in repr(steps)
    assert "at load factor 1, 0 halvings" in repr(steps)
    said = repr(problem.problem)
    size = problem.contact.layout.size_global
    assert said.startswith("<NonlinearProblem for ") and f"{size} unknowns" in said
    assert f"{len(problem.problem.bcs)} Dirichlet condition" in said
    assert repr(problem.contact) in said
    assert repr(history).startswith("<History of 2 records, no file, columns time, ")


@pytest.mark.quick
def test_dir_lists_what_is_public_alone():
    assert set(dir(raymortar)) == {*raymortar.__all__, "__version__"}
    assert not {"discretization", "interface", "compat", "diagnose"} & set(
        dir(raymortar)
    )
    assert all(hasattr(raymortar, name) for name in dir(raymortar))


@pytest.mark.quick
@pytest.mark.mpi
def test_signs_and_statuses_are_those_of_the_table():
    """docs/api/results.md, on a block that is pressed on another and shears it."""
    problem, steps = top_moves("quadrilateral", steps=2)
    steps.run()
    contact, points = problem.contact, problem.contact.points()
    counts, force = contact.statistics, contact.resultant()
    closed = points["status"] >= Status.STICK
    assert COMM.allreduce(np.count_nonzero(closed)) == counts.active_points > 0
    assert np.all(points["pressure"][closed] > 0.0) and counts.max_pressure > 0.0
    assert np.all(points["pressure"][~closed] == 0.0)
    # The slave is the upper block: it is pushed up, along its inward normal
    assert force.force[1] > 0.0 and force.normal @ force.force > 0.0
    assert np.all(points["normal"][closed][:, 1] < 0.0)
    nodes = contact.status().x.array
    assert set(np.unique(nodes)) <= set(map(float, Status))
    on_slave = contact.results.coverage().x.array > 0.0
    assert np.all((nodes == Status.NO_HIT) == ~on_slave)
    assert COMM.allreduce(np.any(nodes >= Status.STICK))


@pytest.mark.quick
@pytest.mark.mpi
def test_weights_add_up_to_the_area_and_are_negative_without_hit_alone():
    """On a slave that reaches over its master by 0.37 on each side."""
    scene = two_blocks(COMM, 2, "quadrilateral", (5, 5), (4, 4), upper_size=(1.74, 1.0))
    problem = build(scene)
    problem.contact.set_gamma(1.0)
    problem.contact.update()
    points = problem.contact.points()
    hit = points["status"] >= Status.OPEN
    for name in ("weight", "area"):
        total = COMM.allreduce(points[name].sum())
        covered = COMM.allreduce(points[name][hit].sum())
        assert total == pytest.approx(1.74, rel=1e-12)
        assert covered == pytest.approx(1.0, rel=1e-12)
        assert np.all(points[name][hit] > 0.0)
    negative = points["weight"] < 0.0
    assert COMM.allreduce(np.count_nonzero(negative)) > 0
    assert np.all(points["seed"][negative] == -1)
