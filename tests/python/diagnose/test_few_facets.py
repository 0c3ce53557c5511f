"""Contact of few facets, whose forces depend on gamma: found, and told once at the end of
a path where they change by 10 %."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import slender
from dolfinx import fem
from problems import COMM, fix, residual
from rigid_scenes import E, press

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactWarning,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    rigid,
)
from raymortar.core import compat
from raymortar.results import Status


def indented(cell, n, depth=0.03, factor=1.0, unit=1.0, **options):
    """A block below a ball, with the automatic gamma times a factor."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    centre = (0.45, 1.3, 0.0) if dim == 2 else (0.45, 0.5, 1.3)
    ball = rigid.Circle if dim == 2 else rigid.Sphere
    body = rigid.Body(ball(unit * np.array(centre[:dim]), 0.3 * unit), name="ball")
    scene = press(cell, body, n, unit=unit, **options)
    down = unit * np.eye(dim)[-1]
    if factor != 1.0:
        scene.contact.set_gamma(factor * scene.contact.gamma)
    return scene, lambda t: body.move(-depth * t * down)


def few(caught):
    """Those of the warnings that are of few facets."""
    return [str(one.message) for one in caught if "depend on gamma" in str(one.message)]


def told(problem, apply, steps=3):
    """What is told of few facets on a path."""
    return on_path(problem, apply, steps)[1]


def on_path(problem, apply, steps=3):
    """Findings of few facets at the end of a path, and what is told of them."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        LoadSteps(SNESSolver(problem), apply, steps, progress=False).run()
    found = [one for one in problem.check() if "depend on gamma" in one.text]
    return found, few(caught)


def spread(*scene, **options):
    """Change of the force with a tenth and ten times the automatic gamma, the larger."""
    forces = []
    for factor in (1.0, 0.1, 10.0):
        made, apply = indented(*scene, factor=factor, **options)
        told(made.problem, apply)
        forces.append(
            np.linalg.norm(made.contact.results.resultant_on(made.body).force)
        )
    return np.abs(np.array(forces[1:]) / forces[0] - 1.0).max()


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, n, options",
    [
        ("quadrilateral", 6, {}),
        ("quadrilateral", 6, {"friction": Coulomb(0.3)}),
        ("triangle", 8, {}),
        ("triangle", 4, {"degree": 2}),
        ("tetrahedron", 4, {}),
    ],
)
def test_few_facets_are_found_with_number_and_place(cell, n, options):
    scene, apply = indented(cell, n, **options)
    (found,), texts = on_path(scene.problem, apply)
    facets = COMM.allreduce(carrying(scene.contact))
    assert found.text.startswith(f"{facets} facet"), found
    assert found.pair == "(1, 'ball')" and found.place
    assert "at least 4 lie across" in found.remedy
    assert found.is_wrong is (found.size > 0.1)
    assert texts == [f"{found} (docs/messages/warnings.md)"] * found.is_wrong
    assert told(scene.problem, apply) == []  # said once


def carrying(contact):
    """Slave facets of this rank that have a closed point."""
    points = contact.points()
    return len(np.unique(points["slave"][points["status"] >= Status.STICK]))


@pytest.mark.parametrize("n, many", [(4, True), (6, True), (16, False), (24, False)])
def test_it_is_found_where_the_force_depends_on_gamma(n, many):
    scene, apply = indented("quadrilateral", n)
    found, texts = on_path(scene.problem, apply)
    assert bool(found) is many
    change = spread("quadrilateral", n)
    assert change > 0.03 if many else change < 0.01
    assert not (texts and change < 0.1)


@pytest.mark.parametrize("cell, n", [("quadrilateral", 3), ("triangle", 4)])
def test_it_is_told_where_the_force_changes_by_a_tenth(cell, n):
    scene, apply = indented(cell, n)
    assert len(told(scene.problem, apply)) == 1
    assert spread(cell, n) > 0.1


@pytest.mark.parametrize("unit, stiffer", [(1e-3, 1e9), (1e4, 1e-4)])
def test_it_has_no_unit(unit, stiffer):
    sizes = []
    for scale, factor in ((1.0, 1.0), (unit, stiffer)):
        scene, apply = indented("quadrilateral", 6, unit=scale, stiffer=factor)
        (found,), _ = on_path(scene.problem, apply)
        sizes.append(found.size)
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-6)


@pytest.mark.mpi
def test_first_touches_of_a_path_are_not_told():
    """A step with one facet is, where it stays the last one."""
    scene, apply = indented("quadrilateral", 24, depth=0.04)
    assert told(scene.problem, apply, 16) == []
    scene, apply = indented("quadrilateral", 24, depth=0.002)
    assert len(on_path(scene.problem, apply, 1)[0]) == 1


@pytest.mark.parametrize(
    "options",
    [
        {"method": AugmentedLagrangian(condition="nodes")},  # does not depend on it
        {"method": Penalty(10.0 * E)},  # is known to
        {"depth": -0.01},  # does not touch
    ],
)
def test_what_has_no_such_force_is_not_told(options):
    scene, apply = indented("quadrilateral", 6, **options)
    assert told(scene.problem, apply) == []


def test_bodies_that_bend_are_not_told():
    path = slender.bent(20, cells=(16, 2))
    assert told(path.problem, path.apply, 2) == []


@pytest.mark.mpi
def test_a_lone_solve_is_told():
    scene, apply = indented("quadrilateral", 3)
    apply(1.0)
    for expected in (1, 0):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ContactWarning)
            SNESSolver(scene.problem).solve()
        assert len(few(caught)) == expected


def on_blocks(scene, pairs, held, E=1.0):
    """Problem of blocks, of which sides are held by values, by name."""
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    form, *_ = residual(scene, u, "neo-hookean", E)
    contact, V = Contact(u, scene.facet_tags, pairs), u.function_space
    bcs = [fix(V, scene, name, value=value) for name, value in held.items()]
    return NonlinearProblem(form, contact, bcs)


def test_other_bodies_do_not_count():
    """A hard body that is hardly touched, beside a soft one with facets enough."""
    scene = two_blocks(COMM, 2, "quadrilateral", (24, 24), (24, 24), gap=1.0)
    soft, hard = (rigid.Body(rigid.Circle((0.42, y), 0.3)) for y in (1.3, 3.3))
    pairs = [(scene.tags["master"], soft), (scene.tags["top"], hard)]
    E = {"lower": 1.0, "upper": 1e5}
    problem = on_blocks(scene, pairs, {"bottom": 0.0, "slave": 0.0}, E)

    def apply(t):
        soft.move((0.0, -0.03 * t))
        hard.move((0.0, -1e-6 * t))

    assert told(problem, apply) == []


@pytest.mark.parametrize("angle", [40.0, 180.0])
def test_a_body_that_has_turned_is_told_alike(angle):
    found = []
    for degrees in (0.0, angle):
        scene = two_blocks(COMM, 2, "quadrilateral", (6, 6), (2, 2), gap=1.0)
        c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
        R = np.array([[c, -s], [s, c]])
        body = rigid.Body(rigid.Circle(tuple(R @ (0.42, 1.3)), 0.3))

        def turned(x, R=R):
            return x @ (R - np.eye(2)).T

        held = dict.fromkeys(("bottom", "slave", "top"), turned)
        problem = on_blocks(scene, [(scene.tags["master"], body)], held)
        problem.u.interpolate(lambda x, R=R: (R - np.eye(2)) @ x[:2])
        (one,), _ = on_path(problem, lambda t, R=R: body.move(-0.03 * t * R[:, 1]))
        found.append(one.size)
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_forces_that_are_rounding_errors_are_not_told():
    """Blocks that touch, at an angle, are moved together."""
    scene = two_blocks(COMM, 2, "quadrilateral", (4, 4), (3, 3), rotation=0.4)
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    move = fem.Constant(scene.mesh, np.zeros(2))
    problem = on_blocks(scene, pairs, {"bottom": move, "top": move})

    def apply(t):
        move.value[:] = 0.3 * t, 0.2 * t

    assert told(problem, apply) == []
    assert np.linalg.norm(problem.contact.resultant().force) < 1e-12
