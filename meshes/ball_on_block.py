"""A quarter of half a ball on a quarter of a block, 3D: curved tetrahedra of degree 2.

The ball has the radius 1 and touches the block, 1.5 x 1.5 x 1, at the origin. The planes
x = 0 and y = 0 are planes of symmetry.
"""

import math

import gmsh
from gmsh_tools import fine_around, generate, main, name_groups

R, EDGE, DEPTH = 1.0, 1.5, 1.0


def draw() -> None:
    """Bodies, groups and mesh."""
    occ = gmsh.model.occ
    block = occ.addBox(0.0, 0.0, -DEPTH, EDGE, EDGE, DEPTH)
    # Latitudes from the south pole to the equator, a quarter of all longitudes
    ball = occ.addSphere(0.0, 0.0, R, R, -1, -math.pi / 2, 0.0, math.pi / 2)
    occ.synchronize()
    on_x, on_y = (faces(ball, axis, 0.0) + faces(block, axis, 0.0) for axis in (0, 1))
    cut = faces(ball, 2, R)
    round_faces = set(faces(ball)) - set(on_x) - set(on_y) - set(cut)
    name_groups(
        {
            "block": (3, [block]),
            "ball": (3, [ball]),
            "bottom": (2, faces(block, 2, -DEPTH)),
            "table": (2, faces(block, 2, 0.0)),
            "cut": (2, cut),
            "sphere": (2, sorted(round_faces)),
            "symmetry_x": (2, on_x),
            "symmetry_y": (2, on_y),
        }
    )
    fine_around((0.0, 0.0, 0.0), 0.25, near=0.12, far=0.7)
    generate(3, degree=2)


def faces(body: int, axis: int = 0, at: float | None = None) -> list[int]:
    """Faces of a body, or those in a plane across an axis."""
    found = [f for _, f in gmsh.model.getBoundary([(3, body)], oriented=False)]
    if at is None:
        return found
    bounds = {f: gmsh.model.getBoundingBox(2, f) for f in found}
    return [
        f
        for f, bound in bounds.items()
        if max(abs(bound[axis] - at), abs(bound[axis + 3] - at)) < 1e-5
    ]


if __name__ == "__main__":
    main(draw, __file__)
