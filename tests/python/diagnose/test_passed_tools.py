"""Tools and slaves that go through each other in one step, and those that do not."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from problems import DIMENSION, SOLVERS
from rigid_scenes import implicit, press

from raymortar import ContactWarning, ConvergenceError, LoadSteps, Penalty, rigid

CELLS = ("triangle", "tetrahedron")
RADIUS = 0.4


def ball(gdim, height=1.6, radius=RADIUS):
    return rigid.Sphere((0.5,) * (gdim - 1) + (height,), radius)


def disc(radius, corners=24):
    """A circle about the origin as straight facets."""
    turns = 2.0 * np.pi * np.arange(corners) / corners
    points = radius * np.column_stack([np.cos(turns), np.sin(turns)])
    numbers = np.arange(corners)
    return rigid.Surface(points, np.column_stack([numbers, (numbers + 1) % corners]))


def jump(found, *, tool=(0.0, 0.0), base=(0.0, 0.0), turn=None):
    """Warnings of a solve after tool and base went across and up, from an accepted
    state."""
    gdim = len(found.base.value)
    solver = SOLVERS[-1](found.problem)
    solver.solve()
    found.contact.advance()
    begin = found.body.translation[:gdim]

    def way(across, up):
        return np.array([across, *([0.0] * (gdim - 2)), up])

    found.body.move(begin + way(*tool), turn)
    found.base.value[:] = way(*base)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        solver.solve()
    assert (found.contact.points(0)["status"] < 2).all()
    return [str(w.message) for w in caught if "gone through" in str(w.message)]


def scene(cell, shape=None, **options):
    shape = ball(DIMENSION[cell]) if shape is None else shape
    return press(cell, shape, n=4, material="linear", **options)


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize(
    "tool, base",
    (
        ((0.0, 0.0), (0.0, 3.0)),
        ((0.0, -1.5), (0.0, 1.5)),
        ((0.0, -0.1), (0.0, 2.9)),
        ((0.0, 7.0), (0.0, 10.0)),
        ((0.0, -1000.0), (0.0, 0.0)),
        ((0.0, -50.0), (0.0, 900.0)),
    ),
)
def test_a_tool_goes_through_whichever_moves(cell, tool, base):
    assert len(jump(scene(cell), tool=tool, base=base)) == 1


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize(
    "tool, base",
    (
        ((0.0, 10.0), (0.0, 10.0)),  # together
        ((0.0, 10.0), (0.0, 7.0)),
        ((3.0, 0.0), (0.0, 0.0)),  # past the block's top
        ((3.0, -2.0), (-9.0, 0.0)),  # beside it
        ((0.0, 0.0), (30.0, 2.0)),
    ),
)
def test_what_goes_another_way_is_no_loss(cell, tool, base):
    assert jump(scene(cell), tool=tool, base=base) == []


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("radius", (0.1, 1.5))
def test_the_way_may_be_long_against_the_tool(cell, radius):
    far = ball(DIMENSION[cell], 300.0, radius)
    assert len(jump(scene(cell, far), tool=(0.0, -700.0))) == 1
    aside = ball(DIMENSION[cell], 300.0, radius)
    assert jump(scene(cell, aside), tool=(2.5, -700.0), base=(-20.0, 0.0)) == []


@pytest.mark.parametrize("method", (None, Penalty(100.0)))
@pytest.mark.parametrize(
    "tool, base, count",
    (
        ((0.0, 2.0), (0.0, 1.5), 0),  # it lifts off, the block follows less
        ((3.0, 0.0), (0.0, 0.0), 0),  # drawn off over the edge, as deep as it was
        ((3.0, 3.0), (-0.5, 0.0), 0),
        ((0.0, -3.0), (0.0, 0.0), 1),
        ((0.0, -3.0), (0.0, 0.3), 1),
    ),
)
def test_a_tool_that_was_in_contact(method, tool, base, count):
    options = {} if method is None else {"method": method}
    found = scene("quadrilateral", ball(2, 1.3), **options)
    assert len(jump(found, tool=tool, base=base)) == count


@pytest.mark.parametrize(
    "shape",
    (
        disc(RADIUS),
        rigid.Wedge((0.0, 0.0), (0.0, 1.0), 0.4),
        rigid.Surface(
            [[-0.6, 0], [0.6, 0], [0.6, 0.01], [-0.6, 0.01]],
            [[0, 1], [1, 2], [2, 3], [3, 0]],
        ),
    ),
    ids=("facets", "wedge", "thin plate"),
)
def test_every_kind_of_tool_is_seen(shape):
    """A wedge has no end: the block goes through beside its tip."""
    body = rigid.Body(shape)
    is_wedge = isinstance(shape, rigid.Wedge)
    body.move((10.0, 0.0) if is_wedge else (0.5, 1.6))
    way = {"base": (20.0, 0.0)} if is_wedge else {"tool": (0.0, -3.0)}
    assert len(jump(scene("quadrilateral", body), **way)) == 1


def test_a_function_of_the_users_is_seen():
    found = scene("triangle", implicit(2, -0.2))
    assert len(jump(found, tool=(0.0, -4.0))) == 1
    assert jump(scene("triangle", implicit(2, -0.2)), tool=(0.0, 4.0)) == []


@pytest.mark.mpi
@pytest.mark.parametrize("turn, count", ((np.pi, 1), (-0.2 * np.pi, 0)))
def test_a_tool_that_swings_through(turn, count):
    """About a centre beside the block; half a turn the other way would be clear."""
    body = rigid.Body(rigid.Circle((0.5, 1.8), 0.3), centre=(-1.0, 0.5))
    assert len(jump(scene("triangle", body), turn=-turn)) == count


@pytest.mark.mpi
def test_a_load_step_through_the_slave_fails():
    found = scene("quadrilateral")

    def lift(t):
        found.base.value[1] = 3.0 * t

    steps = LoadSteps(SOLVERS[-1](found.problem), lift, 1, 0, strategy="halve")
    with pytest.raises(ConvergenceError, match="rigid body .Sphere. has gone through"):
        steps.run()


@pytest.mark.mpi
def test_the_contact_is_the_same_afterwards():
    found = scene("triangle")
    assert len(jump(found, tool=(0.0, -3.0))) == 1
    before = found.contact.points(0)
    found.contact.update()
    after = found.contact.points(0)
    for name in ("x", "gap", "status"):
        assert np.array_equal(before[name], after[name])
