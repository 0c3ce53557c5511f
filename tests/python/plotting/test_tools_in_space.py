"""Rigid tools in pictures of space: what is drawn lies on the shape, and in the box."""

from __future__ import annotations

import numpy as np
import pytest
from rigid_scenes import nearest_along, press, shapes

from raymortar import AugmentedLagrangian, rigid
from raymortar.plotting.tools import curves

pytest.importorskip("matplotlib")

LOWER, UPPER = np.full(3, -0.1), np.array([1.1, 1.1, 1.3])


def brick(divisions=1, curved=False):
    """A cuboid of triangles, or of quadrilaterals of degree 2 whose tops bulge."""
    low, high = np.array([0.2, 0.3, 0.9]), np.array([0.7, 0.8, 1.5])
    if curved:
        t = np.linspace(0.0, 1.0, 3)
        x, y = (a.ravel() for a in np.meshgrid(t, t))
        z = 0.95 + 0.2 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)
        order = [0, 2, 8, 6, 1, 5, 7, 3, 4]
        points = np.column_stack([x, y, z])
        return rigid.Surface(points, [order[:4][::-1] + [7, 5, 1, 3, 4]], closed=False)
    t = np.linspace(0.0, 1.0, divisions + 1)
    points, facets = [], []
    for axis in range(3):
        for end in (0.0, 1.0):
            a, b = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
            face = np.insert(np.column_stack([a, b]), axis, end, axis=1)
            start, n = sum(map(len, points)), divisions + 1
            i, j = (a.ravel() for a in np.indices((divisions, divisions)))
            k = start + i * n + j
            facets.append(np.column_stack([k, k + n, k + 1]))
            facets.append(np.column_stack([k + n, k + n + 1, k + 1]))
            points.append(low + (high - low) * face)
    return rigid.Surface(np.vstack(points), np.vstack(facets), orient=True)


TOOLS = shapes(3) | {"brick": brick(), "curved": brick(curved=True)}
TOOLS["nearly flat"] = rigid.Sphere((0.5, 0.5, 1e3 + 0.95), 1e3)


@pytest.mark.parametrize("name", TOOLS)
def test_wires_are_on_the_shape_and_in_the_box(name):
    """Of a tool that has been moved and turned."""
    body = rigid.Body(TOOLS[name])
    body.move((0.03, -0.04, 0.02), (0.1, 0.2, -0.1))
    R, shift = body.pose_of(body.motion())
    found = curves(body, LOWER, UPPER)
    assert len(found) >= 3
    drawn = np.vstack(found)
    assert ((drawn >= LOWER) & (drawn <= UPPER)).all()
    rng = np.random.default_rng(0)
    x = (rng.permutation(drawn)[:300] - shift) @ R
    tolerance = 2e-3 if name == "implicit" else 1e-8  # a grid has found it
    assert nearest(body, x).max() <= tolerance


def nearest(body, x):
    """Distance from the tool along the nearest of a fan of rays."""
    ways = np.random.default_rng(1).normal(size=(60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return nearest_along(body, x, ways)


def test_of_many_facets_the_edges_of_the_body_are_drawn():
    few = curves(rigid.Body(brick(2)), LOWER, UPPER + 1.0)
    many = curves(rigid.Body(brick(20)), LOWER, UPPER + 1.0)
    assert len(few) == 6 * 8 * 3 // 2
    assert len(many) == 12 * 20


@pytest.mark.mpi
def test_a_picture_of_space_shows_the_tools(draw):
    ball = rigid.Body(shapes(3)["sphere"])
    found = press("hexahedron", ball, n=2, method=AugmentedLagrangian(40.0))
    left = draw(found)
    if left is None:
        return
    assert left.get_zlim()[1] == pytest.approx(1.4, abs=0.05)
    assert len(left.artists) == len(left.collections) == 1
