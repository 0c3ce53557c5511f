"""A quarter of a shaft in a quarter of a hub, meshed to touch: the interference is an
offset. Lame's solution of thick rings has the pressure between them."""

from __future__ import annotations

import numpy as np
from problems import COMM, build, fix, worst

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks

SHAFT, HUB = 50.0, 100.0  # outer radii
TAGS = {"slave": 1, "master": 2, "bottom": 3, "left": 4}


def _arc(radius, angle):
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _core(x):
    """From the unit square to the middle of a quarter disc of radius 1."""
    corners = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.4, 0.4]])
    s, t = x[:, :1], x[:, 1:]
    a, b, c, d = corners
    return (1 - s) * (1 - t) * a + s * (1 - t) * b + (1 - s) * t * c + s * t * d


def _rim(first):
    """From the unit square, outwards and around, to an eighth of the rim."""

    def mapping(x):
        around = x[:, 1]
        inner = _core(
            np.column_stack([np.ones_like(around), around])
            if first
            else np.column_stack([1.0 - around, np.ones_like(around)])
        )
        outer = _arc(1.0, np.pi / 4 * (around if first else 1.0 + around))
        return (1.0 - x[:, :1]) * inner + x[:, :1] * outer

    return mapping


def scene_of(around=8, hub_around=10, cell="quadrilateral"):
    """Quarters with so many facets on the arcs of shaft and hub. Collective."""
    n = around // 2

    def scaled(mapping):
        return lambda x: SHAFT * mapping(x)

    def ring(x):
        radius = SHAFT + (HUB - SHAFT) * x[:, :1]
        return radius * _arc(1.0, np.pi / 2 * x[:, 1])

    unit = (0.0, 0.0), (1.0, 1.0)
    core = {"bottom": TAGS["bottom"], "left": TAGS["left"]}
    blocks = [
        Block((n, n), *unit, mapping=scaled(_core), tags=core, body="shaft"),
        Block(
            (3, n),
            *unit,
            mapping=scaled(_rim(True)),
            tags={"right": TAGS["slave"], "bottom": TAGS["bottom"]},
            body="shaft",
        ),
        Block(
            (3, n),
            *unit,
            mapping=scaled(_rim(False)),
            tags={"right": TAGS["slave"], "top": TAGS["left"]},
            body="shaft",
        ),
        Block(
            (6, hub_around),
            *unit,
            mapping=ring,
            tags={
                "left": TAGS["master"],
                "bottom": TAGS["bottom"],
                "top": TAGS["left"],
            },
            body="hub",
        ),
    ]
    mesh, cells, facets = assemble_blocks(COMM, blocks, cell, geometry_degree=2)
    return Scene(mesh, cells, facets, TAGS, {"shaft": 1, "hub": 2})


def plane_strain_equivalent(E, nu):
    """Moduli that make plane strain of plane stress."""
    return E * (1.0 + 2.0 * nu) / (1.0 + nu) ** 2, nu / (1.0 + nu)


def pressure(interference, E_shaft, E_hub, nu_shaft, nu_hub):
    """Lame's pressure in plane stress, per radial interference. Stress."""
    b, c = SHAFT, HUB
    hub = (c**2 + b**2) / (c**2 - b**2) + nu_hub
    return interference / b / ((1.0 - nu_shaft) / E_shaft + hub / E_hub)


def press_fit(scene, E, nu, interference, **options):
    """Problem with the interference as an offset, not yet solved. Collective."""

    def symmetric(V, scene):
        return [fix(V, scene, "bottom", 1), fix(V, scene, "left", 0)]

    return build(scene, 2, E=E, nu=nu, bcs=symmetric, offset=-interference, **options)


def mean_pressure(contact):
    """Normal traction over the slave surface, and its largest deviation. Collective."""
    points = contact.points()
    p = -np.einsum("qi,qi->q", points["traction"], points["normal"])
    sums = np.array([points["weight"] @ p, points["weight"].sum()])
    mean = float(np.divide(*COMM.allreduce(sums)))
    return mean, worst(p - mean)
