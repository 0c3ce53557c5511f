"""Rigid tools that are given wrongly are told, by name."""

from __future__ import annotations

import warnings

import boxes
import numpy as np
import pytest
from dolfinx import fem
from rigid_scenes import TOP, press

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ContactWarning,
    Coulomb,
    NewtonSolver,
    NonlinearProblem,
    SNESSolver,
    rigid,
)
from raymortar.core import compat
from raymortar.core.errors import SetUpError

LAW = {"method": AugmentedLagrangian(40.0)}


@pytest.mark.parametrize("hollow", ("no", 1, None))
def test_hollow_is_true_or_false(hollow):
    for make in (
        lambda: rigid.Sphere((0.0, 0.0), 1.0, hollow),
        lambda: rigid.Cylinder((0.0,) * 3, (1.0, 0.0, 0.0), 1.0, hollow),
        lambda: rigid.Cone((0.0,) * 3, (1.0, 0.0, 0.0), 1.0, hollow),
        lambda: rigid.Torus((0.0,) * 3, (1.0, 0.0, 0.0), 1.0, 0.5, hollow),
    ):
        with pytest.raises(ContactError, match="hollow = .* must be True or False"):
            make()


def test_what_is_free_is_named_once():
    line = rigid.Line((0.0, 1.0), (0.0, -1.0))
    with pytest.raises(ContactError, match="has 'y' more than once"):
        rigid.Body(line, free=("y", "x", "y"))


@pytest.mark.parametrize("size", (1e160, 1e-200))
def test_axes_may_have_any_length(size):
    forces = []
    for length in (1.0, size):
        normal = length * np.array([0.1, -1.0])
        found = press("triangle", rigid.Line((0.5, 0.95), normal), **LAW)
        SNESSolver(found.problem).solve()
        forces.append(found.contact.resultant().force)
    assert forces[0] == pytest.approx(forces[1], rel=1e-10)


def test_a_class_is_no_shape():
    mesh = boxes.box("triangle", 2)
    u = fem.Function(compat.vector_space(mesh, 1))
    tags = boxes.tag_sides(mesh, (1, 1.0), (1, 0.0))
    with pytest.raises(ContactError, match="the class rigid.Circle, not a shape"):
        Contact(u, tags, [(TOP, rigid.Circle)])


def test_a_shape_of_two_pairs_is_one_body_and_two_bodies_have_two_names():
    mesh, line = boxes.box("triangle", 2), rigid.Line((0.5, 1.0), (0.0, -1.0))
    u = fem.Function(compat.vector_space(mesh, 1))
    tags = boxes.tag_sides(mesh, (1, 1.0), (1, 0.0))

    def contact(*tools):
        return Contact(u, tags, [*zip(np.unique(tags.values), tools)])

    one, other = (pair.master for pair in contact(line, line).pairs)
    assert one is other
    punches = [rigid.Body(line, name="punch") for _ in range(2)]
    assert len(contact(punches[0], punches[0]).pairs) == 2
    with pytest.raises(ContactError, match="two rigid bodies are named 'punch'"):
        contact(*punches)


@pytest.mark.parametrize("wrong", ("gradient", "hessian"))
def test_derivatives_that_are_none_are_noticed(wrong):
    """A parabola, one of whose derivatives has the wrong size."""
    size = {"gradient": 1.0, "hessian": 1.0} | {wrong: 2.0}

    def phi(x):
        return 0.95 + (x[0] - 0.5) ** 2 - x[1]

    def gradient(x):
        return size["gradient"] * np.array([2.0 * (x[0] - 0.5), -np.ones(x.shape[1])])

    def hessian(x):
        bend = np.zeros((2, 2, x.shape[1]))
        bend[0, 0] = 2.0
        return size["hessian"] * bend

    found = press("triangle", rigid.Implicit(phi, gradient, hessian), **LAW)
    with pytest.raises(ContactError, match=f"{wrong} is not the derivative"):
        found.contact.update()


def test_slaves_that_are_held_throughout_are_refused():
    found = press("triangle", rigid.Line((0.5, 0.95), (0.0, -1.0)), **LAW)
    V = found.u.function_space
    everywhere = fem.locate_dofs_geometrical(V, lambda x: np.full(x.shape[1], True))
    bcs = [fem.dirichletbc(np.zeros(2), everywhere, V)]
    F, _ = found.problem.forms
    with pytest.raises(SetUpError, match="tag 1 is prescribed throughout"):
        SNESSolver(NonlinearProblem(F, found.contact, bcs)).solve()


def test_a_held_slave_meets_a_tool_that_is_free():
    """The tool comes to rest on it."""
    body = rigid.Body(
        rigid.Line((0.5, 1.05), (0.0, -1.0)), free=("y",), force=(0.0, -1.0)
    )
    found = press("triangle", body, **LAW)
    V = found.u.function_space
    everywhere = fem.locate_dofs_geometrical(V, lambda x: np.full(x.shape[1], True))
    bcs = [fem.dirichletbc(np.zeros(2), everywhere, V)]
    F, _ = found.problem.forms
    assert NewtonSolver(NonlinearProblem(F, found.contact, bcs)).solve()[1]
    assert body.translation[1] == pytest.approx(-0.05, abs=1e-9)
    assert found.contact.resultant().force[1] == pytest.approx(-1.0, rel=1e-9)


@pytest.mark.parametrize(
    "make, message",
    (
        (
            lambda: rigid.Sphere((0, 0, 0), 0.0),
            "radius = 0.0 must be a positive number",
        ),
        (lambda: rigid.Plane((0, 0, 0), (0, 0, 0)), "normal is zero"),
        (lambda: rigid.Plane((0, 0), (0, 0, 1)), "vectors of different lengths"),
        (lambda: rigid.Cone((0, 0, 0), (0, 0, 1), 2.0), "less than pi / 2"),
        (lambda: rigid.Torus((0, 0, 0), (0, 0, 1), 1.0, 1.5), "less than major"),
        (lambda: rigid.Circle((0, np.nan), 1.0), "2 or 3 finite numbers"),
        (lambda: rigid.Body("ball"), "shape must be one of rigid"),
        (
            lambda: rigid.Body(rigid.Circle((0, 0), 1.0)).move((1, 0, 0)),
            "translation = (1, 0, 0) must be 2 finite numbers",
        ),
        (
            lambda: rigid.Body(rigid.Sphere((0, 0, 0), 1.0)).move(rotation=0.3),
            "vector along the axis in 3D",
        ),
    ),
)
def test_what_makes_no_shape_is_told(make, message):
    with pytest.raises(ContactError) as caught:
        make()
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "make",
    (
        lambda: rigid.Circle((0.0, 0.0, 0.0), 1.0),
        lambda: rigid.Line((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        lambda: rigid.Wedge((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.3),
    ),
)
def test_shapes_of_the_plane_have_places_of_two_numbers(make):
    with pytest.raises(ContactError, match="of a .* must be 2 numbers: .* in 3D"):
        make()


@pytest.mark.parametrize(
    "pairs, message",
    (
        ([(1, rigid.Sphere((0, 0, 0), 1.0))], "made for 3D, the mesh is in 2D"),
        ([(rigid.Circle((0, 0), 1.0), 1)], "can be a master only"),
        ([(1, rigid.Circle((0, 3), 1.0)), (1, 2)], "a Contact of its own"),
    ),
)
def test_pairs_that_cannot_be_are_told(pairs, message):
    mesh = boxes.box("triangle")
    tags = boxes.tag_sides(mesh, (1, 1.0), (1, 0.0))
    with pytest.raises(ContactError) as caught:
        Contact(boxes.displacement(mesh), tags, pairs)
    assert message in str(caught.value)


def test_what_would_change_nothing_is_refused():
    ball = rigid.Body(rigid.Circle((0.0, 0.0), 1.0), free=("y",), stiffness=2.0)
    with pytest.raises(ValueError, match="read-only"):
        ball.force[1] = -5.0
    for name in ("free", "stiffness"):
        with pytest.raises(AttributeError):
            setattr(ball, name, None)
    assert ball.free == ("y",) and ball.stiffness == {"y": 2.0}


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_turns_of_round_bodies_need_resistance(cell):
    """A moment about an axis of symmetry is refused before the solve; without one the
    turn is told. Friction or a spring resists it."""
    plane = cell == "triangle"
    if plane:
        free, force, moment = ("y", "r"), (0.0, -0.5), 0.1
        shape = rigid.Circle((0.5, 1.45), 0.5)
    else:
        free, force, moment = ("z", "rz"), (0.0, 0.0, -0.5), (0.0, 0.0, 0.1)
        shape = rigid.Sphere((0.5, 0.5, 1.45), 0.5)
    about, turn = {"moment": moment}, free[1]

    def start(friction=None, **options):
        body = rigid.Body(shape, name="roller", free=free, force=force, **options)
        problem = press(cell, body, n=2, friction=friction, **LAW).problem
        problem.create_matrix()
        problem.start()

    message = f"roller is turned about an axis of its symmetry.*leave '{turn}' out"
    with pytest.raises(SetUpError, match=message):
        start(**about)
    with pytest.warns(ContactWarning, match="roller may turn about an axis"):
        start()
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        warnings.filterwarnings("ignore", message=".* starts .* deep in the rigid")
        start(**about, friction=Coulomb(0.3))
        start(**about, stiffness={turn: 1.0})
