"""A pin in the grooves of a base and a jaw, by the Gmsh kernel: half of a clamp."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["model"]

# Lengths in mm
RADIUS, WIDTH, HEIGHT, STOP, SLOT = 12.0, 45.0, 25.0, 30.0, 0.3
# The groove's flanks, at 45 degrees, touch the pin in the middle of its quadrants
FLANK = RADIUS * np.sqrt(2.0)
OPENING = 12.0  # of half the groove
MOUTH = FLANK - OPENING  # height of the jaws' faces from the pin's centre


def outline(kernel: Any, points: Any, sizes: Any) -> tuple[int, list[int]]:
    """Plane surface of a polygon; its lines are numbered in the order of the points."""
    tags = [kernel.addPoint(x, y, 0.0, h) for (x, y), h in zip(points, sizes)]
    lines = [
        kernel.addLine(a, b) for a, b in zip(tags, [*tags[1:], tags[0]], strict=True)
    ]
    return kernel.addPlaneSurface([kernel.addCurveLoop(lines)]), lines


def jaw_points(sign: int) -> list[tuple[float, float]]:
    """Half a jaw: groove, face, step up to the stop, stop, outer sides."""
    gap = 0.5 * SLOT
    step, far = MOUTH, MOUTH + HEIGHT
    points = [
        (0.0, FLANK), (OPENING, step), (STOP, step), (STOP, gap), (WIDTH, gap),
        (WIDTH, far), (0.0, far),
    ]  # fmt: skip
    return [(x, sign * y) for x, y in points]


def name_group(gmsh: Any, dim: int, entities: list[int], name: str) -> None:
    """Physical group with a name; Gmsh 4.8 takes it separately."""
    group = gmsh.model.addPhysicalGroup(dim, entities)
    gmsh.model.setPhysicalName(dim, group, name)


def model(gmsh: Any, size: int) -> None:
    """Build the clamp in Gmsh, with a name for every surface that is needed."""
    kernel, fine = gmsh.model.occ, RADIUS * 0.25 * np.pi / size
    sizes = [fine, fine, 2 * fine, 2 * fine, 3 * fine, 4 * fine, 4 * fine]
    base, base_lines = outline(kernel, jaw_points(-1), sizes)
    jaw, jaw_lines = outline(kernel, jaw_points(1), sizes)
    corner = RADIUS * np.sqrt(0.5)
    at = [(0, -RADIUS), (corner, -corner), (RADIUS, 0), (corner, corner), (0, RADIUS)]
    points = [kernel.addPoint(x, y, 0.0, fine) for x, y in at]
    centre = kernel.addPoint(0.0, 0.0, 0.0, 2 * fine)
    arcs = [kernel.addCircleArc(a, centre, b) for a, b in zip(points, points[1:])]
    cuts = [kernel.addLine(points[-1], centre), kernel.addLine(centre, points[0])]
    pin = kernel.addPlaneSurface([kernel.addCurveLoop(arcs + cuts)])
    kernel.synchronize()
    for name, surface in {"base": base, "pin": pin, "jaw": jaw}.items():
        name_group(gmsh, 2, [surface], name)
    for name, lines in {
        "pin below": arcs[:2],
        "pin above": arcs[2:],
        "groove of the base": base_lines[:1],
        "groove of the jaw": jaw_lines[:1],
        "stop of the base": base_lines[3:4],
        "stop of the jaw": jaw_lines[3:4],
        "held": base_lines[5:6],
        "moved": jaw_lines[5:6],
        "symmetry": cuts + base_lines[6:] + jaw_lines[6:],
    }.items():
        name_group(gmsh, 1, lines, name)
    gmsh.model.mesh.generate(2)
