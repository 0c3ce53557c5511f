"""Bodies of the paths that blocks do not make: Gmsh models, as a user draws them."""

from __future__ import annotations

from mpi4py import MPI

from meshes.meshing import Scene
from raymortar.io import read_gmsh


def polygon(kernel, points, size):
    """Plane surface of a polygon, and its lines in the order of the points."""
    tags = [kernel.addPoint(x, y, 0.0, size) for x, y in points]
    ends = zip(tags, [*tags[1:], tags[0]])
    lines = [kernel.addLine(a, b) for a, b in ends]
    return kernel.addPlaneSurface([kernel.addCurveLoop(lines)]), lines


def read(draw, dim=2):
    """Scene of a model that `draw` makes on rank 0. Collective.

    It takes Gmsh to the entity of each body and the entities of each side, by name.
    """
    comm = MPI.COMM_WORLD
    if comm.rank > 0:
        found = read_gmsh(None, comm, gdim=dim)
    else:
        import gmsh

        gmsh.initialize(["", "-v", "1"])
        try:
            parts, sides = draw(gmsh)
            gmsh.model.occ.synchronize()
            for name, entity in parts.items():
                _name(gmsh, dim, [entity], name)
            for name, entities in sides.items():
                _name(gmsh, dim - 1, entities, name)
            gmsh.model.mesh.generate(dim)
            found = read_gmsh(gmsh.model, comm, gdim=dim)
        finally:
            gmsh.finalize()
    tags = {name: tag for name, (d, tag) in found.names.items() if d == dim - 1}
    named = {name: tag for name, (d, tag) in found.names.items() if d == dim}
    return Scene(found.mesh, found.cell_tags, found.facet_tags, tags, named)


def _name(gmsh, dim, entities, name):
    """Physical group with a name; Gmsh 4.8 takes it separately."""
    group = gmsh.model.addPhysicalGroup(dim, entities)
    gmsh.model.setPhysicalName(dim, group, name)


def snap_fit(size=0.25):
    """A hook on an arm, left of a latch with the same sharp tooth."""

    def draw(gmsh):
        kernel = gmsh.model.occ
        # The arm is held at the left; its hook points down
        hook = [(0, 1), (10, 1), (11, 0.1), (11.6, 0.1), (11.6, 2), (0, 2)]
        latch = [(12, -2), (18, -2), (18, 0), (13.6, 0)]
        latch += [(13.6, 0.8), (13, 0.8), (12, 0)]
        upper, a = polygon(kernel, hook, size)
        lower, b = polygon(kernel, latch, size)
        kernel.synchronize()
        sides = {
            "slave": a[1:4],
            "master": b[2:6],
            "top": a[5:6],
            "bottom": [b[0], b[1]],
        }
        return {"upper": upper, "lower": lower}, sides

    return read(draw)


def ring_between_plates(inner=0.6, size=0.12, gap=0.0):
    """An elastic ring of radius 1 between two blocks, which it touches or not."""

    def draw(gmsh):
        kernel = gmsh.model.occ
        outer = kernel.addCircle(0, 0, 0, 1.0)
        hole = kernel.addCircle(0, 0, 0, inner)
        ring = kernel.addPlaneSurface(
            [kernel.addCurveLoop([outer]), kernel.addCurveLoop([hole])]
        )
        y = 1.0 + gap
        low = [(-1.6, -y - 0.5), (1.6, -y - 0.5), (1.6, -y), (-1.6, -y)]
        lower, b = polygon(kernel, low, 0.16)
        high = [(-1.6, y), (1.6, y), (1.6, y + 0.5), (-1.6, y + 0.5)]
        upper, t = polygon(kernel, high, 0.16)
        kernel.synchronize()
        circles = gmsh.model.getBoundary([(2, ring)], oriented=False, recursive=True)
        gmsh.model.mesh.setSize(circles, size)
        sides = {
            "slave": [outer],
            "below": b[2:3],
            "above": t[0:1],
            "bottom": b[0:1],
            "top": t[2:3],
        }
        return {"ring": ring, "lower": lower, "upper": upper}, sides

    return read(draw)


def discs_on_block(centres, radius=0.5, size=0.12):
    """Discs around the centres, above the block -2 <= x <= 2, -1 <= y <= 0."""

    def draw(gmsh):
        kernel = gmsh.model.occ
        corners = [(-2.0, -1.0), (2.0, -1.0), (2.0, 0.0), (-2.0, 0.0)]
        lower, lines = polygon(kernel, corners, 0.15)
        parts, sides = {"lower": lower}, {"bottom": lines[:1], "block": lines[2:3]}
        for i, (x, y) in enumerate(centres):
            circle = kernel.addCircle(x, y, 0.0, radius)
            disc = kernel.addPlaneSurface([kernel.addCurveLoop([circle])])
            kernel.synchronize()
            ends = gmsh.model.getBoundary([(2, disc)], oriented=False, recursive=True)
            gmsh.model.mesh.setSize(ends, size)
            parts[f"disc_{i}"], sides[f"circle_{i}"] = disc, [circle]
        return parts, sides

    return read(draw)


def ball_on_block(height, radius=0.5, size=0.3):
    """A ball around (0, 0, height), above the block -1 <= x, y <= 1, -0.6 <= z <= 0."""

    def draw(gmsh):
        kernel = gmsh.model.occ
        lower = kernel.addBox(-1.0, -1.0, -0.6, 2.0, 2.0, 0.6)
        ball = kernel.addSphere(0.0, 0.0, height, radius)
        kernel.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        ends = gmsh.model.getBoundary([(3, lower)], oriented=False)
        heights = {
            surface: gmsh.model.occ.getCenterOfMass(2, surface)[2]
            for _, surface in ends
        }
        sides = {
            "bottom": [s for s, z in heights.items() if abs(z + 0.6) < 1e-6],
            "block": [s for s, z in heights.items() if abs(z) < 1e-6],
            "sphere": [
                s for _, s in gmsh.model.getBoundary([(3, ball)], oriented=False)
            ],
        }
        return {"lower": lower, "ball": ball}, sides

    return read(draw, 3)
