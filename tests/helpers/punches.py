"""Flat punches that end inside slave facets: as facets of a rigid tool, and meshed."""

from __future__ import annotations

import boxes
import numpy as np
from rigid_scenes import press, press_by

from raymortar import rigid

HEIGHT = 0.5  # of punches


def corners_of(ends):
    """Corners of the face, (2, 2) or (4, 3): around it, the solid on the left, and
    seen from below counter-clockwise."""
    lower, upper = np.asarray(ends, dtype=float)
    if len(lower) == 1:
        return np.array([[lower[0], 1.0], [upper[0], 1.0]])
    (a, c), (b, d) = lower, upper
    return np.array([[a, c, 1.0], [a, d, 1.0], [b, d, 1.0], [b, c, 1.0]])


def face(cell, ends):
    """An open surface, the face of a punch that stands on the unit box.

    Parameters
    ----------
    cell
        Of a meshed punch with these facets.
    ends
        Least and largest coordinates along the surface, (2, gdim - 1).
    """
    x = corners_of(ends)
    facets = {
        "triangle": [[0, 1]],
        "quadrilateral": [[0, 1]],
        "tetrahedron": [[0, 1, 2], [0, 2, 3]],
        "hexahedron": [[0, 1, 2, 3]],
    }
    return rigid.Surface(x, np.array(facets[cell]), closed=False)


def solid(ends):
    """The closed surface of such a punch, of intervals or quadrilaterals."""
    x = corners_of(ends)
    n = len(x)
    points = np.vstack([x, x + HEIGHT * np.eye(x.shape[1])[-1]])
    if n == 2:
        return rigid.Surface(points, np.array([[0, 1], [1, 3], [3, 2], [2, 0]]))
    sides = [[i, i + n, (i + 1) % n + n, (i + 1) % n] for i in range(n)]
    return rigid.Surface(
        points, np.array([[0, 1, 2, 3], [7, 6, 5, 4], *sides]), orient=True
    )


def by_tool(cell, ends, way, shape=face, n=8, degree=1, turn=None, **options):
    """The block below a punch that has moved.

    Parameters
    ----------
    shape
        `face` or `solid`.
    """
    tool = shape(cell, ends) if shape is face else shape(ends)
    body = rigid.Body(tool)
    found = press(cell, body, n=n, degree=degree, **options)
    body.move(way) if turn is None else body.move(way, turn)
    found.contact.update()
    return found


def by_mesh(cell, ends, way, n=8, degree=1, **options):
    """The block below the same punch of one cell whose dofs are all prescribed."""
    lower, upper = np.asarray(ends, dtype=float)

    def place(x):
        along = lower + (upper - lower) * x[:, :-1]
        return np.column_stack([along, 1.0 + HEIGHT * x[:, -1]])

    punch = boxes.box(cell, 1, move=place)
    return press_by(punch, cell, way, n, degree, **options)
