"""Surfaces that meet themselves: strips folded to a U, and tags that are joined."""

from __future__ import annotations

import dataclasses

import numpy as np
from dolfinx import mesh as dmesh
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar.core import compat

SKIN = 77
# Of a U: length of its legs, radius of its middle line, thickness
LEG, RADIUS, WALL = 2.0, 0.5, 0.2


def joined(scene, names=("slave", "master")):
    """The scene with the facets of some tags under one, which is slave and master."""
    numbers = [scene.tags[name] for name in names]
    tags, mesh = scene.facet_tags, scene.mesh
    values = np.where(np.isin(tags.values, numbers), SKIN, tags.values)
    return dataclasses.replace(
        scene,
        facet_tags=compat.meshtags(mesh, mesh.topology.dim - 1, tags.indices, values),
        tags={**scene.tags, "slave": SKIN, "master": SKIN, "skin": SKIN},
    )


def folded(x, middle=RADIUS):
    """Points of a straight strip, along and across it, on a U that opens upward."""
    s, across = x[:, 0] - LEG, x[:, -1]
    angle = np.clip(s / middle, 0.0, np.pi)
    # Beyond the ends of the arc the strip is straight
    rest = s - middle * angle
    radius = middle - across
    y = x.copy()
    y[:, 0] = -radius * np.cos(angle)
    y[:, -1] = -radius * np.sin(angle) + np.abs(rest)
    return y


def u_strip(
    cell,
    along=24,
    through=2,
    geometry_degree=1,
    wall=WALL,
    deep=1,
    share=1.0,
    middle=RADIUS,
    comm=COMM,
):
    """A strip that is folded to a U, or a share of it from the left end on: its inner
    side is the skin. The middle line has the given radius. Collective."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    whole = share * (2.0 * LEG + np.pi * middle)
    depth = ((0.0, 0.4),) * (dim - 2)
    lower, upper = zip((0.0, whole), *depth, (-0.5 * wall, 0.5 * wall))
    divisions = (along, *(deep,) * (dim - 2), through)
    sides = {"left": 1, "right": 2, "bottom": 3, "top": SKIN}
    block = Block(
        divisions,
        lower,
        upper,
        mapping=lambda x: folded(x, middle),
        tags=sides,
        pattern="alternate",
    )
    mesh = assemble_blocks(comm, [block], cell, geometry_degree)
    tags = {"left": 1, "right": 2, "outer": 3, "skin": SKIN}
    return Scene(*mesh, {**tags, "slave": SKIN, "master": SKIN}, {"strip": 1})


def pinched(X, depth):
    """Displacement (n, d) of the legs of a U that overlap by a depth near their ends."""
    u = np.zeros_like(X)
    gap = 2.0 * RADIUS - WALL
    share = np.clip(1.4 * X[:, -1] / LEG, 0.0, 1.0) ** 2
    u[:, 0] = -0.5 * np.sign(X[:, 0]) * (gap + depth) * share
    return u


def only_legs(scene):
    """The scene with a skin on the ends of the straight legs alone."""
    tags, mesh = scene.facet_tags, scene.mesh
    dim = mesh.topology.dim - 1
    legs = dmesh.locate_entities_boundary(mesh, dim, lambda x: x[dim] > 0.75 * LEG)
    keep = (tags.values != SKIN) | np.isin(tags.indices, legs)
    found = compat.meshtags(mesh, dim, tags.indices[keep], tags.values[keep])
    return dataclasses.replace(scene, facet_tags=found)


def hinge(cell, geometry_degree=1, deep=1):
    """Two cells side by side, whose tops are the skin and share the middle. Collective."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    lower = (-1.0,) + (0.0,) * (dim - 2) + (-0.4,)
    upper = (1.0,) + (0.4,) * (dim - 2) + (0.0,)
    cells = (2,) + (deep,) * (dim - 2) + (1,)
    block = Block(cells, lower, upper, tags={"top": SKIN}, body="hinge")
    return Scene(*assemble_blocks(COMM, [block], cell, geometry_degree), {"skin": SKIN})


def closed_hinge(X, beyond):
    """Displacement that turns both halves up by a right angle, and by an angle beyond."""
    turn = 0.5 * np.pi + beyond
    far, up = np.abs(X[:, 0]), X[:, -1]
    u = np.zeros_like(X)
    u[:, 0] = np.sign(X[:, 0]) * (far * np.cos(turn) - up * np.sin(turn)) - X[:, 0]
    u[:, -1] = far * np.sin(turn) + up * np.cos(turn) - up
    return u
