"""Sharp corners on what is flat or smooth: forces in the frame of what is hit (2.14)."""

from __future__ import annotations

import warnings

import corners
import gathered
import numpy as np
import pytest

import raymortar
from raymortar import Coulomb, LoadSteps, NewtonSolver, Penalty, rigid

MU = 0.2


def slid(kind, *tilt, mu=0.0, way=1.0, n=8, cell="quadrilateral", **options):
    """The scene, and tangential over normal force at the steps of the slide."""
    gdim = 2 if len(tilt) == 1 else 3
    friction = Coulomb(mu) if mu else None
    size = options.get("size", 1.0)
    tool = corners.flat_tool(kind, gdim, size)
    turn = corners.turned(gdim, *tilt)
    if kind in ("surface", "mesh"):
        options["frame"] = "master"
    scene = corners.block_on(tool, turn, n=n, cell=cell, friction=friction, **options)
    return scene, scene.pressed(way)


@pytest.mark.parametrize("tilt", (0.0, 5.0, 10.0, 20.0))
@pytest.mark.parametrize("kind", ("line", "surface", "mesh"))
def test_no_force_along_a_flat_without_friction(kind, tilt):
    _, ratio = slid(kind, tilt)
    assert np.abs(ratio).max() < 1e-9


@pytest.mark.parametrize("way", (1.0, -1.0))
@pytest.mark.parametrize("tilt", (0.0, 10.0, 20.0))
@pytest.mark.parametrize("kind", ("line", "surface", "mesh"))
def test_full_slip_gives_the_coefficient_of_friction(kind, tilt, way):
    _, ratio = slid(kind, tilt, mu=MU, way=way)
    assert ratio[-1, 0] == pytest.approx(-way * MU, rel=1e-9)


@pytest.mark.parametrize("kind", ("plane", "mesh"))
def test_a_corner_of_a_cube(kind):
    """Turned about two axes: no force along the plane, and friction against slip."""
    at = dict(n=3, cell="hexahedron")
    _, ratio = slid(kind, 8.0, -6.0, **at)
    assert np.abs(ratio).max() < 1e-9
    scene, ratio = slid(kind, 8.0, -6.0, mu=MU, method=Penalty(), **at)
    assert np.linalg.norm(ratio[-1]) == pytest.approx(MU, rel=1e-3)
    points = gathered.points(scene.contact)
    closed = points["status"] > 1
    t = points["traction"][closed]
    assert np.linalg.norm(t[:, :2], axis=1) == pytest.approx(MU * t[:, 2], rel=1e-9)


@pytest.mark.mpi
def test_ranks_and_units():
    """In SI, on any number of ranks."""
    for kind in ("line", "mesh"):
        _, ratio = slid(kind, 10.0, mu=MU, n=4, size=1e-3, E=2e11)
        assert ratio[-1, 0] == pytest.approx(-MU, rel=1e-9)


def test_springs_hold_at_rest():
    """Friction on a tilted corner that stays: forces do not fade."""
    for method in (None, Penalty()):
        options = {} if method is None else {"method": method}
        scene = corners.block_on(
            corners.flat_tool("line", 2),
            corners.turned(2, 20.0),
            friction=Coulomb(0.6),
            **options,
        )
        down = np.array([0.0, -corners.PRESSED])
        scene.path([down, down + [0.002, 0.0]], steps=2)
        force = scene.contact.resultant(0).force
        assert 0.02 < abs(force[0] / force[1]) < 0.55
        held = scene.path([down + [0.002, 0.0]], steps=3)
        assert held == pytest.approx(np.tile(force, (3, 1)), rel=1e-9)


def test_a_corner_on_a_round_tool():
    """Slip everywhere around the lowest point of a large circle: friction is that of
    the tool's normals, whose mean is upright."""
    tool = rigid.Circle((0.0, -20.0), 20.0)
    ratios = {}
    for frame in ("automatic", "master"):
        scene = corners.block_on(
            tool, corners.turned(2, 12.0), friction=Coulomb(MU), frame=frame
        )
        ratios[frame] = scene.pressed(1.0)[-1, 0]
        p = scene.contact.points(0)
        n = p["master_normal"] if frame == "master" else -p["normal"]
        assert np.array_equal(p["contact_normal"], -n)
    x = scene.u.x.array  # where the corner is on the circle
    assert np.isfinite(x).all()
    assert ratios["master"] == pytest.approx(-MU, abs=0.01)
    assert abs(ratios["automatic"] + MU) > 0.1


def test_work_over_a_closed_path_vanishes():
    """A frictionless corner that is led around a square on a plane."""
    tool = corners.flat_tool("line", 2)
    scene = corners.block_on(tool, corners.turned(2, 15.0), n=4)
    start = np.array([0.0, -0.03])
    places = start + 0.02 * np.array([[1, 0], [1, -1], [0, -1], [0, 0]])
    scene.path([start], steps=2)
    before = scene.contact.resultant(0).force
    forces = np.vstack([before, scene.path(places, steps=1)])
    way = np.diff(np.vstack([start, places]), axis=0)
    work = 0.5 * (forces[1:] + forces[:-1]) * way
    assert abs(work.sum()) < 1e-9 * np.abs(work).max()


def test_where_the_slave_keeps_its_normal_a_warning_tells_the_tilt():
    """Straight facets on a round tool: neither flat nor smooth."""
    angles = np.deg2rad(90.0 + np.array([16.0, 8.0, 0.0, -8.0, -16.0]))
    points = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)]) - [0.0, 3.0]
    facets = np.array([[1, 0], [2, 1], [3, 2], [4, 3]])
    tool = rigid.Surface(points, facets, closed=False)
    scene = corners.block_on(tool, corners.turned(2, 12.0))
    with pytest.warns(
        raymortar.ContactWarning, match=r"tilted against it by \d+"
    ) as all_:
        scene.path([(0.0, -0.02), (0.01, -0.02)], steps=2)
    assert sum("tilted" in str(one.message) for one in all_) == 2  # one for each path
    # A tool cannot be a slave
    assert not any("swap sides" in str(one.message) for one in all_)
    points = scene.contact.points(0)
    assert np.array_equal(points["contact_normal"], points["normal"])
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "the facets of slave")
        slid("line", 12.0, n=4)


@pytest.mark.parametrize("mu", [0.0, MU])
def test_a_flat_slave_below_a_corner_has_the_right_normal(mu):
    """No warning: its facets are flat, however the corner stands on them."""
    friction = Coulomb(mu) if mu else None
    contact, problem, place = corners.corner_on_flat(
        corners.turned(2, 5.0), friction=friction
    )
    forces = []
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for way in ([0.0, -0.02], [0.05, -0.02]):
            start = place.value.copy()

            def apply(t):
                place.value[:] = start + t * (np.array(way) - start)

            for _ in LoadSteps(NewtonSolver(problem), apply, steps=3):
                forces.append(contact.resultant().force)
    assert not any("tilted" in str(one.message) for one in told)
    assert abs(forces[-1][0] / forces[-1][1]) == pytest.approx(mu, abs=0.02)
