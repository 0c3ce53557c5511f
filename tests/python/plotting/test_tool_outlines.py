"""Rigid tools in pictures: what is drawn lies on the shape, and in the picture."""

from __future__ import annotations

import numpy as np
import pytest
from rigid_scenes import nearest_along, press, shapes

from raymortar import AugmentedLagrangian, rigid
from raymortar.plotting.tools import curves

pytest.importorskip("matplotlib")

LOWER, UPPER = np.array([-0.1, -0.1]), np.array([1.1, 1.2])


def square(degree):
    """With sides that bulge, if they are of degree 2."""
    corners = np.array([[0.2, 0.9], [0.8, 0.9], [0.8, 1.5], [0.2, 1.5]])
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    if degree == 1:
        return rigid.Surface(corners, ends)
    middles = 0.5 * corners[ends].sum(axis=1)
    middles += 0.1 * (middles - corners.mean(axis=0))
    return rigid.Surface(
        np.vstack([corners, middles]), np.column_stack([ends, np.arange(4, 8)])
    )


TOOLS = shapes(2) | {"straight": square(1), "curved": square(2)}
TOOLS["nearly flat"] = rigid.Circle((0.5, 1e3 + 0.95), 1e3)


@pytest.mark.parametrize("name", TOOLS)
def test_outlines_are_on_the_shape(name):
    """Of a tool that has been moved and turned: no way from a point to the surface."""
    body = rigid.Body(TOOLS[name])
    body.move((0.03, -0.04), 0.2)
    R, shift = body.pose_of(body.motion())
    found = curves(body, LOWER, UPPER)
    drawn = np.vstack(found)
    inside = ((drawn >= LOWER) & (drawn <= UPPER)).all(axis=1)
    if "line" not in name and name != "wedge":
        assert inside.sum() >= 2
    # Between the points of a line there are more
    sides = [0.5 * (a[1:] + a[:-1]) for a in found if len(a) <= 3]
    x = np.vstack([drawn, *sides])
    x = (np.pad(x, ((0, 0), (0, 1))) - shift) @ R
    away = nearest(body, x)
    tolerance = 1e-3 if name == "implicit" else 1e-9  # a grid has found it
    assert away.max() <= tolerance * max(1.0, 1e-3 * np.abs(x).max())


def test_a_small_circle_is_drawn_round():
    """Its pieces are chords of less than ten degrees, whatever else is in the picture."""
    (outline,) = curves(rigid.Body(rigid.Circle((0.52, 0.47), 0.02)), LOWER, UPPER)
    chords = np.linalg.norm(np.diff(outline, axis=0), axis=1)
    assert chords.max() < 0.02 * np.radians(10.0)
    assert chords.sum() == pytest.approx(0.04 * np.pi, rel=1e-2)


def test_a_line_that_passes_is_drawn():
    """However long it is beside the picture."""
    body = rigid.Body(rigid.Polyline([(-1e4, 1.0), (1e4, 1.2)], inside=(0.0, 2.0)))
    (outline,) = curves(body, LOWER, UPPER)
    assert outline[0, 0] < LOWER[0] and outline[-1, 0] > UPPER[0]


def nearest(body, x):
    """Distance from the tool along the nearest of a fan of rays."""
    angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False) + 0.01
    ways = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(48)])
    return nearest_along(body, x, ways)


@pytest.mark.mpi
def test_a_picture_shows_the_tools_next_to_the_bodies(draw):
    ball = rigid.Body(shapes(2)["circle"])
    found = press(
        "triangle", ball, method=AugmentedLagrangian(40.0, condition="points")
    )
    left = draw(found)
    if left is None:
        return
    (line,) = left.lines
    x = np.column_stack(line.get_data())
    centre, radius = np.array(ball.shape.centre), ball.shape.radius
    assert np.linalg.norm(x - centre, axis=1) == pytest.approx(radius)
    assert left.get_ylim() == pytest.approx((-0.15, 1.15), abs=0.05)
