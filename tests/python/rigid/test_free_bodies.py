"""Rigid bodies that forces move: unknowns of the coupled system."""

from __future__ import annotations

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import problems
import pytest
import rigid_scenes
from corners import block_on, turned
from problems import SOLVERS
from rigid_scenes import press, shapes, solved

from raymortar import (
    AugmentedLagrangian,
    ContactError,
    Coulomb,
    Penalty,
    SNESSolver,
    rigid,
    solvers,
)
from raymortar.rigid.turning import rotation_matrix, rotation_vector, turning
from raymortar.solvers import automatic
from raymortar.solvers.automatic import linear_options

LAWS = {
    "normal": {"method": AugmentedLagrangian(40.0)},
    "friction": {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(80.0), "friction": Coulomb(0.3)},
    "nodes": {
        "method": AugmentedLagrangian(80.0, condition="nodes"),
        "friction": Coulomb(0.3),
    },
    "deformed": {
        "method": AugmentedLagrangian(40.0),
        "friction": Coulomb(0.3),
        "measure": "current",
    },
}
PLANE = dict(
    free=("x", "y", "r"),
    force=(0.1, -2.0),
    moment=0.2,
    stiffness={"x": 5.0, "r": 0.5},
)
SPACE = dict(
    free=("x", "y", "z", "rx", "ry", "rz"),
    force=(0.1, 0.05, -2.0),
    moment=(0.2, 0.1, 0.3),
    stiffness={"x": 5.0, "y": 5.0, "rx": 0.6, "ry": 0.6, "rz": 0.6},
    damping={"z": 0.2, "rz": 0.1},
)
BALLS = [("triangle", "circle"), ("tetrahedron", "sphere"), ("hexahedron", "sphere")]


def free_ball(cell, name, above=0.1, **options):
    """A ball that starts above the block, and turns about a point beside its own."""
    gdim = problems.DIMENSION[cell]
    shape = shapes(gdim, -above)[name]
    centre = np.array(shape.centre) + 0.1 * np.arange(1, gdim + 1)
    return rigid.Body(shape, centre, **(PLANE if gdim == 2 else SPACE) | options)


@pytest.mark.parametrize("size", (0.0, 1e-4, 0.9, 1.1, 3.0, 6.0))
def test_turns_have_their_derivatives(size):
    theta = size * np.array([2.0, -1.0, 2.0]) / 3.0
    R, first, second = turning(theta)
    assert R == pytest.approx(rotation_matrix(theta), abs=1e-14)
    h = 1e-5
    for i, e in enumerate(h * np.eye(3)):
        ahead, behind = turning(theta + e), turning(theta - e)
        assert (ahead[0] - behind[0]) / (2 * h) == pytest.approx(first[i], abs=1e-9)
        assert (ahead[1] - behind[1]) / (2 * h) == pytest.approx(second[:, i], abs=1e-9)
    if size < np.pi:
        assert rotation_vector(R) == pytest.approx(theta, abs=1e-9)


def turned_far(body):
    """Turn a ball by most of a right angle in this step, and leave it where it is."""
    free = body.freedom
    theta = np.array([0.0, 0.0, 0.9]) if body.shape.gdim == 2 else (0.5, -0.4, 0.7)
    middle = np.zeros(3)
    middle[: body.shape.gdim] = body.shape.centre
    R, shift = body.pose_of(body.motion())
    place = R @ middle + shift
    values = free.values.copy()
    values[free.is_turn] = np.asarray(theta)[free.axis[free.is_turn]]
    free.values = values
    R, shift = body.pose_of(body.motion())
    free.values = free.values + np.where(
        free.is_turn, 0.0, (place - R @ middle - shift)[free.axis]
    )


@pytest.mark.mpi(where=lambda cell, name, law: law == "friction")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell, name", BALLS)
def test_the_tangent_is_the_derivative_at_large_angles(cell, name, law):
    body = free_ball(cell, name)
    found = press(cell, body, n=2, degree=2, **LAWS[law])
    solved(found)
    found.contact.advance()
    turned_far(body)
    assert gathered.points(found.contact)["status"].max() > 1
    aways = (0.001, 0.002, 0.004)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 2e-8


@pytest.mark.parametrize("cell, name", (("triangle", "wedge"), ("tetrahedron", "cone")))
def test_a_tool_with_edges_has_it_too(cell, name):
    gdim = problems.DIMENSION[cell]
    body = rigid.Body(shapes(gdim, -0.1)[name], **(PLANE if gdim == 2 else SPACE))
    found = press(cell, body, n=3, degree=2, **LAWS["friction"])
    solved(found)
    aways = (0.001, 0.002, 0.004)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 2e-8


@pytest.mark.parametrize("law", ("normal", "penalty"))
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_start_without_contact_ends_in_balance(solver, law):
    """Newton's method is quadratic from the first touch on."""
    cell = "tetrahedron"
    body = rigid.Body(shapes(3, -0.7)["sphere"], free=("z",), force=(0.0, 0.0, -2.0))
    found = press(cell, body, n=3, **LAWS[law])
    assert solver(found.problem).solve()[0] <= 8
    on = found.contact.results.resultant_on(body)
    assert on.force[2] == pytest.approx(2.0, rel=1e-9)
    assert on.force == pytest.approx(-found.contact.resultant().force, rel=1e-12)
    *_, before, last, end = found.problem.history
    assert end <= max(last**1.5, 1e-9) and last < before


@pytest.mark.parametrize("offset", (0.15, -0.02))
@pytest.mark.parametrize("method", (AugmentedLagrangian(), Penalty()))
def test_a_free_body_flies_to_where_its_offset_ends(offset, method):
    """A flat tool rests as far from a flat block as the offset says."""
    places = []
    for added in (0.0, offset):
        line = rigid.Line((0.0, -0.3), (0.0, 1.0))
        body = rigid.Body(line, free=("y",), force=(0.0, 0.0025))
        block = block_on(body, turned(2, 0.0), offset=added, method=method)
        assert SNESSolver(block.problem).solve()[0] <= 8
        places.append(body.translation[1])
    assert places[1] - places[0] == pytest.approx(offset, abs=1e-8)


@pytest.mark.parametrize("cell, name", BALLS[:2])
def test_forces_are_in_balance(cell, name):
    body = free_ball(cell, name, damping=None)
    found = press(cell, body, n=3, **LAWS["friction"])
    solved(found)
    on, gdim = found.contact.results.resultant_on(body), body.shape.gdim
    turns = np.atleast_1d(body.rotation[2] if gdim == 2 else body.cpp.theta())
    springs = np.array([5.0, 5.0, 0.0])[:gdim] * [1, gdim == 3, 0][:gdim]
    pull = springs * body.translation[:gdim]
    assert on.force + body.force - pull == pytest.approx(0.0, abs=1e-9)
    # A spring's moment works on theta, which is no turn about a fixed axis
    spin = np.array(body.freedom.rates()[1][-len(turns) :])
    lever = body.freedom.lever
    axes = lever * np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    total = np.atleast_1d(on.moment) + np.atleast_1d(body.moment)
    whole = np.array([0.0, 0.0, total[0]]) if gdim == 2 else total
    stiffness = 0.5 if gdim == 2 else 0.6
    assert axes @ whole == pytest.approx(stiffness * turns, abs=1e-9)


@pytest.mark.parametrize("cell, name", BALLS[:2])
def test_what_turns_with_the_scene_changes_nothing(cell, name):
    """Frame indifference, with a body that turns."""
    gdim = problems.DIMENSION[cell]
    turn = np.array([0.0, 0.0, 0.8]) if gdim == 2 else np.array([0.5, -0.9, 0.7])
    R, shift = rotation_matrix(turn), np.array([3.0, -2.0, 0.0 if gdim == 2 else 1.0])

    def case(R, shift, move):
        free = (PLANE if gdim == 2 else SPACE)["free"]
        middle = np.array(shapes(gdim, -0.1)[name].centre)
        at = (R[:gdim, :gdim] @ middle) + shift[:gdim]
        beside = at + R[:gdim, :gdim] @ (0.1 * np.arange(1, gdim + 1))
        force = R[:gdim, :gdim] @ np.array((0.2, -2.0) if gdim == 2 else (0.2, 0.1, -2))
        moment = R @ np.array([0.2, 0.1, 0.3])
        springs = {k: 0.6 if k.startswith("r") else 3.0 for k in free}
        body = rigid.Body(
            rigid.Sphere(at, 0.9),
            beside,
            free=free,
            force=force,
            moment=0.3 if gdim == 2 else moment,
            stiffness=springs,
        )
        found = press(cell, body, move=move, **LAWS["friction"])
        solved(found)
        return body, found.contact.results.resultant_on(body)

    here, on = case(np.eye(3), np.zeros(3), None)
    there, other = case(R, shift, (turn, shift))
    assert np.linalg.norm(here.rotation) > 0.01
    assert there.translation == pytest.approx(R @ here.translation, rel=1e-7)
    assert there.rotation == pytest.approx(R @ here.rotation, rel=1e-7)
    assert other.force == pytest.approx(R[:gdim, :gdim] @ on.force, rel=1e-7)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, name", [pytest.param(*BALLS[0], marks=pytest.mark.many_ranks), BALLS[1]]
)
def test_ranks_agree(cell, name, monkeypatch):
    def moved():
        body = free_ball(cell, name)
        found = press(cell, body, n=3, degree=2, **LAWS["friction"])
        solved(found)
        found.contact.advance()
        body.force = 1.5 * body.force
        solved(found)
        on = found.contact.results.resultant_on(body)
        return np.concatenate([body.translation, body.rotation, on.force])

    found = moved()
    with monkeypatch.context() as patch:
        for module in (problems, hosts, rigid_scenes.boxes):
            patch.setattr(module, "COMM", MPI.COMM_SELF)
        assert moved() == pytest.approx(found, rel=1e-9, abs=1e-10)


def test_what_nothing_pushes_stays():
    """A plate that may slide and spin without friction, and has no reason to."""
    body = rigid.Body(
        rigid.Plane((0.5, 0.5, 1.1), (0.0, 0.0, -1.0)),
        free=("x", "z", "rz"),
        force=(0.0, 0.0, -1.0),
    )
    found = press("tetrahedron", body, n=3, **LAWS["normal"])
    solved(found)
    assert body.rotation == pytest.approx(0.0, abs=1e-9)
    assert body.translation[0] == pytest.approx(0.0, abs=1e-9)
    assert found.contact.results.resultant_on(body).force[2] == pytest.approx(
        1.0, rel=1e-8
    )


def pushed(law, name, n=4, **options):
    """A ball on a block, after its first touch, by a solver that is told."""
    body = free_ball("tetrahedron", "sphere", above=0.0)
    found = press("tetrahedron", body, n=n, degree=2, **LAWS[law])
    solver, steps = SNESSolver(found.problem, solvers.direct() | options), []
    if options:
        solver.krylov_solver.setMonitor(lambda ksp, i, norm: steps.append(i))
    problems.tolerate(solver, rtol=1e-10)
    newton, _ = solver.solve()
    krylov = [a for a, b in zip(steps, [*steps[1:], 0]) if b == 0]
    return found, body, newton, krylov


def sorted_by_place(u):
    """Values at the nodes of all ranks, by their places."""
    V = u.function_space
    x = gathered.owned(V, V.tabulate_dof_coordinates())
    values = gathered.owned(V, u.x.array.reshape(-1, V.mesh.geometry.dim))
    return values[np.lexsort(np.round(x.T, 9))]


@pytest.mark.mpi(where=lambda law: law == "friction")
@pytest.mark.parametrize("law", ["normal", "friction", "penalty"])
def test_multigrid_for_the_bodies_takes_it(law):
    found, body, newton, _ = pushed(law, "direct")
    # Blocks of each tangent: iterations are those of the preconditioner as it is
    options = solvers.iterative("bodies", ksp_rtol=1e-10, bodies_most=-1)
    same, other, again, krylov = pushed(law, "bodies", **options)
    assert abs(newton - again) <= 1
    assert other.freedom.values == pytest.approx(body.freedom.values, abs=1e-8)
    # Partitions may differ
    u, v = (sorted_by_place(one.problem.u) for one in (found, same))
    assert v == pytest.approx(u, abs=1e-8 * abs(u).max())
    assert max(krylov) <= 30


def test_large_problems_with_it_get_multigrid(monkeypatch):
    found = press("tetrahedron", free_ball("tetrahedron", "sphere"), **LAWS["penalty"])
    assert linear_options(found.problem, None, "none_") == solvers.direct()
    monkeypatch.setattr(automatic, "MOST_DIRECT", {1: 0, 2: 0})
    assert "ksp_python_type" in linear_options(found.problem, None, "none_")


@pytest.mark.parametrize(
    "options, message",
    [
        ({"free": "z"}, "names in a tuple"),
        ({"free": ("rz",)}, "in 2D a body is free along x, y, r"),
        ({"force": (0.0, 1.0)}, "along y, and the Circle is not free"),
        ({"free": ("y",), "moment": 1.0}, "about z, and the Circle is not free"),
        ({"free": ("y",), "stiffness": {"x": 1.0}}, "not in free"),
        ({"free": ("y",), "damping": -1.0}, "must not be negative"),
        ({"free": ("y",), "force": (1.0,)}, "2 finite numbers"),
    ],
)
def test_wrong_input_is_told(options, message):
    with pytest.raises(ContactError, match=message):
        rigid.Body(rigid.Circle((0.0, 0.0), 1.0), **options)


def test_what_is_free_is_not_prescribed():
    body = rigid.Body(rigid.Circle((0.0, 0.0), 1.0), free=("y",))
    body.move((1.0, 0.0))
    with pytest.raises(ContactError, match="prescribes y"):
        body.move((0.0, 1.0))


def test_states_hold_where_free_bodies_are():
    body = free_ball("triangle", "circle")
    found = press("triangle", body, n=3, degree=2, **LAWS["friction"])
    solved(found)
    found.contact.advance()
    begin, place = found.contact.state(), body.motion()
    body.force = (0.3, -3.0)
    solved(found)
    after = body.motion()
    assert np.abs(after - place).max() > 1e-3
    found.contact.advance()
    found.contact.restore(begin)
    assert body.motion() == pytest.approx(place, abs=1e-15)
    solved(found)
    assert body.motion() == pytest.approx(after, abs=1e-9)
