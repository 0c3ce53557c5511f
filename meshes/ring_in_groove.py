"""A rubber ring in a groove under a lid, 2D: curved triangles of degree 2.

A cut through an O-ring, 5 mm thick, in a groove 6.8 mm wide and as deep as the ring.
Unit: mm.
"""

import gmsh
from gmsh_tools import curves_where, generate, main, mesh_sizes, name_groups

R = 2.5


def draw() -> None:
    """Bodies, groups and mesh."""
    occ = gmsh.model.occ
    outer = occ.addRectangle(-6.0, -3.0, 0.0, 12.0, 7.0)
    inner = occ.addRectangle(-3.4, 0.0, 0.0, 6.8, 5.0)
    ((_, housing),), _ = occ.cut([(2, outer)], [(2, inner)])
    ring = occ.addDisk(0.0, R, 0.0, R, R)
    lid = occ.addRectangle(-3.2, 2 * R, 0.0, 6.4, 1.0)
    occ.synchronize()
    name_groups(
        {
            "housing": (2, [housing]),
            "ring": (2, [ring]),
            "lid": (2, [lid]),
            "groove": (1, curves_where(housing, lambda x, y: abs(x) < 3.5 and y > -1)),
            "bottom": (1, curves_where(housing, lambda x, y: y < -2.9)),
            "skin": (1, curves_where(ring, lambda x, y: True)),
            "under_lid": (1, curves_where(lid, lambda x, y: y < 2 * R + 0.1)),
            "top": (1, curves_where(lid, lambda x, y: y > 2 * R + 0.9)),
        }
    )
    mesh_sizes(0.6)
    generate(2, degree=2)


if __name__ == "__main__":
    main(draw, __file__)
