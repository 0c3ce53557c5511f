"""A shaft in a hub, 2D: rings of structured, curved quadrilaterals of degree 2.

Their radii overlap by 0.002: the shaft reaches from 0.5 to 1.002, the hub from 1 to 2.
"""

import gmsh
from gmsh_tools import generate, main, name_groups, structured

INNER, SEAM, OUTER, OVERLAP = 0.5, 1.0, 2.0, 0.002


def ring(
    inner: float, outer: float, around: int, across: int, turn: int
) -> tuple[list[int], list[int], list[int]]:
    """Four quarters of a ring: surfaces, inner and outer arcs.

    `turn` is 0 or 1: whether the quarters begin on the axes or at 45 degrees.
    """
    geo = gmsh.model.geo
    s = 0.5**0.5
    corners = ([(1, 0), (0, 1), (-1, 0), (0, -1)], [(s, s), (-s, s), (-s, -s), (s, -s)])
    centre = geo.addPoint(0.0, 0.0, 0.0)
    circles = [
        [geo.addPoint(r * x, r * y, 0.0) for x, y in corners[turn]]
        for r in (inner, outer)
    ]
    inside, outside = (
        [geo.addCircleArc(a, centre, b) for a, b in zip(c, c[1:] + c[:1])]
        for c in circles
    )
    spokes = [geo.addLine(a, b) for a, b in zip(*circles)]
    surfaces = []
    for k in range(4):
        sides = [spokes[k], outside[k], -spokes[(k + 1) % 4], -inside[k]]
        surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
        structured(surface, sides, (across, around // 4), quads=True)
        surfaces.append(surface)
    return surfaces, inside, outside


def draw() -> None:
    """Bodies, groups and mesh."""
    shaft, bore, skin = ring(INNER, SEAM + OVERLAP, around=40, across=5, turn=0)
    hub, seat, outside = ring(SEAM, OUTER, around=48, across=5, turn=1)
    gmsh.model.geo.synchronize()
    name_groups(
        {
            "shaft": (2, shaft),
            "hub": (2, hub),
            "bore": (1, bore),
            "shaft_outside": (1, skin),
            "hub_inside": (1, seat),
            "hub_outside": (1, outside),
        }
    )
    generate(2, degree=2)


if __name__ == "__main__":
    main(draw, __file__)
