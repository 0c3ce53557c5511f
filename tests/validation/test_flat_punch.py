"""A flat punch on an elastic half-space, a quarter in 3D, against the closed form (H3).

Sneddon: F = 2 E* a d, p(r) = F / (2 pi a sqrt(a^2 - r^2)).
"""

from __future__ import annotations

import dataclasses

import gathered
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import locate_entities_boundary
from materials import MATERIALS, lame
from problems import COMM, fix

from meshes.blocks import mirrored
from meshes.graded import PoleGrid, box_blocks
from meshes.meshing import Scene, assemble_blocks
from raymortar import Contact, NonlinearProblem, SNESSolver, rigid
from raymortar.core import compat

E, NU, RADIUS, DEPTH = 1000.0, 0.3, 1.0, 1e-3
E_STAR = E / (1.0 - NU**2)
FORCE = 2.0 * E_STAR * RADIUS * DEPTH
SIZE = 200.0 * RADIUS
TAGS = {"slave": 1, "bottom": 2, "left": 3, "front": 4, "side": 5}
BESIDE = 6


def rounded(x):
    """Squares around the axis as circles: from the punch's rim on as they are, towards
    the axis less and less, so that no cell is flat. Cells are small at the rim."""
    s, r = np.abs(x[:, :2]).max(axis=1), np.linalg.norm(x[:, :2], axis=1)
    share = s / RADIUS
    within = share * (2.0 - share)
    radial = np.where(share < 1.0, within, 1.0 + from_the_rim(share - 1.0))
    circle = np.divide(s, r, out=np.ones_like(r), where=r > 0.0)
    round_ = 1.0 + np.minimum(radial, 1.0) * (circle - 1.0)
    graded = np.divide(radial, share, out=np.ones_like(r), where=s > 0.0)
    down = -RADIUS * from_the_rim(-x[:, 2] / RADIUS)
    return np.column_stack([x[:, :2] * (round_ * graded)[:, None], down])


def from_the_rim(distance):
    """Distances that grow as squares at first, in radii."""
    near = np.maximum(distance, 0.0)
    return near**2 / (near + 0.25)


def half_space(facets, whole):
    """A quarter of a cylinder; the slave is the whole surface, or what is below the
    punch, whose rim goes along edges."""
    grid = PoleGrid(RADIUS, RADIUS / facets, 1.3, 1.0)
    places = {"surface": "slave", "left": "left", "front": "front"}
    places |= {"far": "bottom", "side": "side"}
    tags = {place: TAGS[name] for place, name in places.items()}
    blocks = [mirrored(b, 2) for b in box_blocks((SIZE,) * 3, grid, tags, "half-space")]
    blocks = [
        dataclasses.replace(b, mapping=lambda p, m=b.mapping: rounded(m(p)))
        for b in blocks
    ]
    mesh, cells, found = assemble_blocks(COMM, blocks, "hexahedron", 1)
    below = locate_entities_boundary(
        mesh,
        2,
        lambda x: (np.abs(x[2]) < 1e-9 * RADIUS)
        & (np.hypot(x[0], x[1]) < RADIUS * (1.0 + 1e-9)),
    )
    beside = (found.values == TAGS["slave"]) & ~np.isin(found.indices, below)
    values = np.where(beside & (not whole), BESIDE, found.values)
    found = compat.meshtags(mesh, 2, found.indices, values)
    return Scene(mesh, cells, found, TAGS, {"half-space": 1})


def prism(facets):
    """A punch of facets with its rim at the slave's nodes."""
    # Nodes of the slave's rim are not at equal angles
    along = np.linspace(0.0, 1.0, facets + 1)
    eighth = np.arctan2(along, 1.0)
    quarter = np.concatenate([eighth, 0.5 * np.pi - eighth[-2:0:-1]])
    angles = np.concatenate([quarter + 0.5 * np.pi * k for k in range(4)])
    n = len(angles)
    ring = RADIUS * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])
    up = np.array([0.0, 0.0, 1.0])
    points = np.vstack([ring, ring + up, [0.0 * up, up]])
    k, following = np.arange(n), np.roll(np.arange(n), -1)
    triangles = [
        (following, k, 0 * k + 2 * n),
        (k + n, following + n, 0 * k + 2 * n + 1),
        (k, following, following + n),
        (k, following + n, k + n),
    ]
    return rigid.Surface(points, np.vstack([np.column_stack(t) for t in triangles]))


def press(shape, facets, whole):
    scene = half_space(facets, whole)
    V = compat.vector_space(scene.mesh, 2)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress = MATERIALS["linear"][0](ufl.grad(u), *lame(E, NU))
    dx = ufl.dx(metadata={"quadrature_degree": 4})
    F = ufl.inner(stress, ufl.grad(v)) * dx
    bcs = [fix(V, scene, "left", 0), fix(V, scene, "front", 1)]
    bcs += [fix(V, scene, name) for name in ("bottom", "side")]
    punch = rigid.Body(shape)
    punch.move((0.0, 0.0, -DEPTH))
    contact = Contact(u, scene.facet_tags, [(TAGS["slave"], punch)])
    SNESSolver(NonlinearProblem(F, contact, bcs)).solve()
    return contact


@pytest.mark.parametrize("tool, allowed", (("plane", 0.02), ("facets", 0.05)))
def test_a_flat_punch_in_space(tool, allowed, record_property):
    """A plane over a slave that ends at the rim; and a prism with the rim itself, next to
    which multipliers of the slave's facets reach over it."""
    n = 6
    plane = rigid.Plane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    contact = press(plane if tool == "plane" else prism(n), n, tool == "facets")
    p = gathered.points(contact)
    r = np.hypot(p["x"][:, 0], p["x"][:, 1])
    inner = r < 0.8 * RADIUS
    pressure, weight = p["pressure"][inner], p["weight"][inner]
    exact = FORCE / (2.0 * np.pi * RADIUS * np.sqrt(RADIUS**2 - r[inner] ** 2))
    force = -4.0 * contact.resultant().force[2]
    off = np.sqrt(weight @ (pressure - exact) ** 2 / (weight @ exact**2))
    record_property("force", force / FORCE - 1.0)
    record_property("load", weight @ pressure / (weight @ exact) - 1.0)
    record_property("L2", off)
    assert force == pytest.approx(FORCE, rel=0.02)
    assert weight @ pressure == pytest.approx(weight @ exact, rel=allowed)
    assert tool == "facets" or off < 0.02
