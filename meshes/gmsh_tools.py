"""What the Gmsh scripts beside it share: structured pieces, groups, a command line.

Each script draws its bodies with Gmsh's Python interface and names them, and the
surfaces that matter, by physical groups. Run by itself it writes a ``.msh`` file of its
own name beside it::

    scripts/python meshes/two_blocks.py            # writes meshes/two_blocks.msh
    scripts/python meshes/two_blocks.py --show     # opens Gmsh's window
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gmsh


def polygon(corners: Sequence[Sequence[float]]) -> tuple[int, list[int]]:
    """A surface between straight lines: its number, and those of its lines in order."""
    geo = gmsh.model.geo
    points = [geo.addPoint(x, y, 0.0) for x, y in corners]
    lines = [geo.addLine(a, b) for a, b in zip(points, points[1:] + points[:1])]
    return geo.addPlaneSurface([geo.addCurveLoop(lines)]), lines


def structured(
    surface: int, curves: Sequence[int], divisions: Sequence[int], quads: bool
) -> None:
    """Mesh a surface of four sides by rows and columns.

    Parameters
    ----------
    surface, curves
        Its number and its sides in order.
    divisions
        Cells along the first side and along the second one.
    quads
        Quadrilaterals, else triangles.
    """
    for curve, n in zip(curves, (*divisions, *divisions)):
        gmsh.model.geo.mesh.setTransfiniteCurve(curve, n + 1)
    gmsh.model.geo.mesh.setTransfiniteSurface(surface)
    if quads:
        gmsh.model.geo.mesh.setRecombine(2, surface)


def rectangle(
    corner: Sequence[float],
    size: Sequence[float],
    divisions: Sequence[int],
    quads: bool = False,
) -> tuple[int, dict[str, int]]:
    """A structured rectangle: its surface, and its sides by name."""
    (x, y), (a, b) = corner, size
    surface, lines = polygon([(x, y), (x + a, y), (x + a, y + b), (x, y + b)])
    structured(surface, lines, divisions, quads)
    return surface, dict(zip(("bottom", "right", "top", "left"), lines))


def box(
    corner: Sequence[float], size: Sequence[float], divisions: Sequence[int]
) -> tuple[int, dict[str, int]]:
    """A structured box of hexahedra: its volume, and its sides by name."""
    bottom, _ = rectangle(corner[:2], size[:2], divisions[:2], quads=True)
    geo = gmsh.model.geo
    geo.translate([(2, bottom)], 0.0, 0.0, corner[2])
    layers = [divisions[2]]
    pulled = geo.extrude([(2, bottom)], 0.0, 0.0, size[2], layers, recombine=True)
    # The far end, the volume, the sides over the lines of the rectangle
    top, volume, front, right, back, left = (tag for _, tag in pulled)
    sides = {"bottom": bottom, "top": top, "front": front, "back": back}
    return volume, {**sides, "left": left, "right": right}


def name_groups(groups: Mapping[str, tuple[int, Sequence[int]]]) -> None:
    """Make physical groups of (dimension, entities) by name."""
    for tag, (name, (dim, entities)) in enumerate(groups.items(), 1):
        # Gmsh before 4.9 takes no name here
        gmsh.model.addPhysicalGroup(dim, list(entities), tag)
        gmsh.model.setPhysicalName(dim, tag, name)


def curves_where(surface: int, chosen: Callable[[float, float], bool]) -> list[int]:
    """Curves around a plane surface whose middle (x, y) is chosen."""
    found = []
    for _, curve in gmsh.model.getBoundary([(2, surface)], oriented=False):
        low, high = gmsh.model.getParametrizationBounds(1, curve)
        x, y, _ = gmsh.model.getValue(1, curve, [0.5 * (low[0] + high[0])])
        if chosen(x, y):
            found.append(curve)
    return found


def fine_around(point: Sequence[float], radius: float, near: float, far: float) -> None:
    """Size of cells: `near` within a radius of a point, and growing to `far`."""
    field = gmsh.model.mesh.field
    ball = field.add("Ball")
    for name, value in zip(("XCenter", "YCenter", "ZCenter"), point):
        field.setNumber(ball, name, value)
    field.setNumber(ball, "Radius", radius)
    field.setNumber(ball, "Thickness", 4.0 * radius)
    field.setNumber(ball, "VIn", near)
    field.setNumber(ball, "VOut", far)
    field.setAsBackgroundMesh(ball)
    for option in ("FromPoints", "FromCurvature", "ExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)


def mesh_sizes(size: float) -> None:
    """One size of cells everywhere."""
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)


def generate(dim: int, degree: int = 1) -> None:
    """Mesh the model, with cells of degree 1 or 2 that follow curved surfaces."""
    gmsh.model.mesh.generate(dim)
    gmsh.model.mesh.setOrder(degree)


def main(draw: Callable[[], None], script: str) -> None:
    """Command line of a script.

    Parameters
    ----------
    draw
        Fills the current Gmsh model with bodies, groups and mesh.
    script
        Path of the script.
    """
    file = Path(script).with_suffix(".msh")
    parser = argparse.ArgumentParser(description=f"Writes {file.name}.")
    parser.add_argument("--output", type=Path, default=file, help="file to write")
    parser.add_argument("--show", action="store_true", help="open Gmsh's window")
    options = parser.parse_args()
    gmsh.initialize(["", "-v", "1"])
    try:
        gmsh.model.add(file.stem)
        draw()
        _write(options.output)
        if options.show:
            gmsh.fltk.run()
    finally:
        gmsh.finalize()


def _write(file: Path) -> None:
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.write(str(file))
    print(f"{file}: {', '.join(_counts())}")


def _counts() -> list[str]:
    """How many nodes and cells, and the names of the groups."""
    model: Any = gmsh.model
    dim = model.getDimension()
    _, tags, nodes = model.mesh.getElements(dim)
    names = [model.getPhysicalName(*group) for group in model.getPhysicalGroups()]
    return [
        f"{len(set().union(*nodes))} nodes",
        f"{sum(map(len, tags))} cells",
        f"groups {' '.join(names)}",
    ]
