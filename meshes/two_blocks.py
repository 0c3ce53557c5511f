"""A block on a wider one, 3D: structured hexahedra that do not match.

The lower block is 1 x 1 x 1, the upper one 0.7 x 0.7 x 0.7 in its middle.
"""

import gmsh
from gmsh_tools import box, generate, main, name_groups


def draw() -> None:
    """Bodies, groups and mesh."""
    lower, below = box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (4, 4, 4))
    upper, above = box((0.15, 0.15, 1.0), (0.7, 0.7, 0.7), (3, 3, 3))
    gmsh.model.geo.synchronize()
    name_groups(
        {
            "lower": (3, [lower]),
            "upper": (3, [upper]),
            "bottom": (2, [below["bottom"]]),
            "top": (2, [above["top"]]),
            "lower_top": (2, [below["top"]]),
            "upper_bottom": (2, [above["bottom"]]),
        }
    )
    generate(3)


if __name__ == "__main__":
    main(draw, __file__)
