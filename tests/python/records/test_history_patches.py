"""Where contact is, torques and the work of supports, along a path: closed forms."""

from __future__ import annotations

import gathered
import numpy as np
import pytest
import ufl
from dolfinx import fem
from load_paths import blocks
from problems import DIMENSION
from problems import build as problem_of
from problems import fix, symmetry
from rigid_scenes import press, solved
from spinning import DEPTH, GAMMA, MU, UP, Scene

from raymortar import (
    AugmentedLagrangian,
    ContactError,
    Coulomb,
    History,
    NonlinearProblem,
    Penalty,
    rigid,
)

pytestmark = pytest.mark.mpi
E, DOWN = 2000.0, 0.01


def pressed(cell, steps=1):
    """Linear elastic blocks of height 1 and area 1, squeezed in steps, and a history."""

    def conditions(V, scene):
        dim = scene.mesh.geometry.dim
        # Held from below, pushed from above; sides free but for symmetry
        bottom = fix(V, scene, "bottom", dim - 1)
        top = fix(V, scene, "top", dim - 1, down)
        return [*symmetry(V, scene), bottom, top]

    scene = blocks(cell)
    down = fem.Constant(scene.mesh, 0.0)
    found = problem_of(
        scene,
        bcs=conditions,
        nu=0.0,
        names=dict(upper=scene.tags["slave"], lower=scene.tags["master"]),
    )
    *sides, bottom, top = found.problem.bcs
    e = ufl.sym(ufl.grad(found.u))
    energy = 0.5 * E * ufl.inner(e, e) * ufl.dx
    history = History(
        found.problem,
        None,
        None,
        energy,
        patches=True,
        works={"top": top, "rest": [bottom, *sides]},
    )
    for k in range(1, steps + 1):
        down.value = -DOWN * k / steps
        found.solve()
        history.record(k / steps)
        found.contact.advance()
    return found, history


@pytest.mark.quick
def test_a_uniform_patch_has_its_area_centre_and_pressure(cell):
    _, history = pressed(cell)
    last, dim = history.rows[-1], DIMENSION[cell]
    assert last.area_upper_lower == pytest.approx(1.0, rel=1e-10)
    assert last.max_pressure_upper_lower == pytest.approx(0.5 * E * DOWN, rel=1e-8)
    centre = history.vectors("centre_upper_lower")[-1]
    expected = [0.5] * (dim - 1) + [1.0 - 0.5 * DOWN]
    np.testing.assert_allclose(centre, expected, rtol=1e-8)


@pytest.mark.parametrize("steps", [1, 3])
def test_the_work_of_a_support_is_what_an_elastic_body_stores(cell_2d, steps):
    _, history = pressed(cell_2d, steps)
    stored = 0.25 * E * DOWN**2
    assert history["energy"][-1] == pytest.approx(stored, rel=1e-9)
    np.testing.assert_allclose(history["work_top"], history["energy"], rtol=1e-8)
    assert np.abs(history["work_rest"]).max() <= 1e-10 * stored


def test_the_centre_is_below_an_eccentric_load():
    """A flat punch, free to sink and to turn: the moment about its middle is the force
    times the distance of the centre of pressure."""
    force, moment = 2.0, 0.1
    punch = rigid.Body(
        rigid.Line((0.5, 1.0), (0.0, -1.0)),
        name="punch",
        free=("y", "r"),
        force=(0.0, -force),
        moment=moment,
    )
    found = press("quadrilateral", punch, n=8, method=AugmentedLagrangian())
    history = History(found.problem, patches=True, axes={"middle": (0.5, 1.0)})
    solved(found)
    history.record(1.0)
    (row,) = history.rows
    assert row.force_1_punch_y == pytest.approx(-force, rel=1e-6)
    assert row.centre_1_punch_x == pytest.approx(0.5 - moment / force, abs=2e-3)
    assert row.torque_middle_1_punch == pytest.approx(moment, abs=2e-3 * force)
    assert 0.0 < row.max_pressure_1_punch and 0.5 < row.area_1_punch <= 1.01


@pytest.mark.parametrize("name", ["axis", "raised"])
def test_the_torque_of_a_spinning_annulus(name):
    """mu p times the integral of r, about its axis wherever the point on it is."""
    scene = Scene("hexahedron", "plane")
    v, (u,) = ufl.TestFunction(scene.u[0].function_space), scene.u
    problem = NonlinearProblem(
        ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx, scene.contact
    )
    axes = {"axis": ((0.0, 0.0, 0.0), UP), "raised": ([0.0, 0.0, 5.0], 3.0 * UP)}
    history = History(problem, axes=axes)
    scene.turn(0.5, 0.0)
    history.record(1.0)
    p = gathered.points(scene.contact)
    r = np.linalg.norm(p["x"][:, :2], axis=1)
    expected = -MU * GAMMA * DEPTH * p["weight"] @ r
    assert history[f"torque_{name}_0"][0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.quick
@pytest.mark.parametrize(
    "options, match",
    [
        ({"patches": 1}, "patches must be True or False, not 1"),
        ({"axes": [1]}, "axes must be axes by name, not"),
        (
            {"axes": {"z": (1.0, 2.0, 3.0)}},
            r"axes\['z'\] = .* must be 2 finite numbers",
        ),
        ({"works": {"top": 3}}, "works has 3 for 'top', which is no"),
        ({"symmetry": 0.0}, "symmetry = 0.0 must be a positive number"),
    ],
)
def test_what_is_no_axis_or_support_is_refused(options, match):
    found = problem_of(blocks("triangle"))
    with pytest.raises(ContactError, match=match):
        History(found.problem, **options)


def test_symmetry_multiplies_sums_and_nothing_else():
    """Works, which go on from the last record, too; and over a restart."""
    ball = rigid.Body(rigid.Circle((0.45, 1.9), 0.9), name="ball")
    law = {"method": Penalty(1000.0), "friction": Coulomb(0.3)}
    found = press("quadrilateral", ball, n=6, **law)
    u, bcs = found.u, found.problem.bcs
    energy = ufl.inner(u, u) * ufl.dx
    given = None, {"held": bcs}, energy, None, True, {"middle": (0.5, 1.0)}
    one, three = (
        History(found.problem, *given, works={"held": bcs}, symmetry=factor)
        for factor in (1.0, 3.0)
    )
    for k in range(1, 4):
        ball.move((0.02 * k, -0.02 * k))
        solved(found)
        one.record(k)
        three.record(k)
        found.contact.advance()
        if k == 2:
            three.resume(three.rows)
    kept = "time", "iterations", "halvings", "active", "min_gap", "max_pressure"
    motions = "translation_", "rotation_", "centre_", "max_pressure_"
    for name in one.columns:
        factor = 1.0 if name.startswith((*kept, *motions)) else 3.0
        np.testing.assert_allclose(three[name], factor * one[name], 1e-13, 1e-15)
    sums = "force_1_ball_y push_ball_x work_ball energy friction_work stored_normal area_1_ball"
    assert all(three[name][-1] != 0.0 for name in sums.split())


def test_nothing_presses_before_contact():
    found = problem_of(blocks("quadrilateral", gap=0.1))
    history = History(found.problem, patches=True)
    found.contact.update()
    history.record(0.0)
    (row,) = history.rows
    assert row.area_0 == row.max_pressure_0 == 0.0
    assert np.isnan(row.centre_0_x)
