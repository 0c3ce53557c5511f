"""Half a cylinder on a block, 2D: curved triangles of degree 2, fine at the contact.

The cylinder has the radius 1 and touches the block, 4 x 2, at the origin.
"""

import gmsh
from gmsh_tools import curves_where, fine_around, generate, main, name_groups

R = 1.0


def draw() -> None:
    """Bodies, groups and mesh."""
    occ = gmsh.model.occ
    block = occ.addRectangle(-2.0, -2.0, 0.0, 4.0, 2.0)
    disc = occ.addDisk(0.0, R, 0.0, R, R)
    above = occ.addRectangle(-2.0, R, 0.0, 4.0, 2.0)
    ((_, cylinder),), _ = occ.cut([(2, disc)], [(2, above)])
    occ.synchronize()
    name_groups(
        {
            "block": (2, [block]),
            "cylinder": (2, [cylinder]),
            "bottom": (1, curves_where(block, lambda x, y: y < -1.99)),
            "table": (1, curves_where(block, lambda x, y: y > -0.01)),
            "cut": (1, curves_where(cylinder, lambda x, y: y > R - 0.01)),
            "arc": (1, curves_where(cylinder, lambda x, y: y < R - 0.01)),
        }
    )
    fine_around((0.0, 0.0, 0.0), 0.2, near=0.05, far=0.5)
    generate(2, degree=2)


if __name__ == "__main__":
    main(draw, __file__)
