"""A block on a wider one, 2D: structured triangles that do not match.

The lower block is 1 x 1, the upper one 0.6 x 0.6 in its middle.
"""

import gmsh
from gmsh_tools import generate, main, name_groups, rectangle


def draw() -> None:
    """Bodies, groups and mesh."""
    lower, below = rectangle((0.0, 0.0), (1.0, 1.0), (20, 16))
    upper, above = rectangle((0.2, 1.0), (0.6, 0.6), (13, 12))
    gmsh.model.geo.synchronize()
    name_groups(
        {
            "lower": (2, [lower]),
            "upper": (2, [upper]),
            "bottom": (1, [below["bottom"]]),
            "top": (1, [above["top"]]),
            "lower_top": (1, [below["top"]]),
            "upper_bottom": (1, [above["bottom"]]),
        }
    )
    generate(2)


if __name__ == "__main__":
    main(draw, __file__)
