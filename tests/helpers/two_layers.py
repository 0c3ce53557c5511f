"""Two elastic layers under a smooth pressure, and what the multiplier makes of it."""

import dataclasses

import gathered
import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import COMM, SOLVERS, cellwise, fix

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar.core import compat

TAGS = {"bottom": 1, "top": 2, "slave": 3, "master": 4, "sides": 5}


def layers(cell, master, slave):
    """A master of half the height under a slave, with numbers of facets."""
    sides = dict.fromkeys(("left", "right"), TAGS["sides"])
    low = sides | {"bottom": TAGS["bottom"], "top": TAGS["master"]}
    high = sides | {"bottom": TAGS["slave"], "top": TAGS["top"]}
    blocks = [
        Block((master, max(master // 4, 4)), (0.0, 0.0), (1.0, 0.5), tags=low),
        Block((slave, max(slave // 4, 4)), (0.0, 0.5), (1.0, 1.0), tags=high),
    ]
    return Scene(*assemble_blocks(COMM, blocks, cell), TAGS)


@dataclasses.dataclass
class Pressure:
    """Nodal pressures over x, and what they tell."""

    x: np.ndarray
    p: np.ndarray

    def __post_init__(self):
        wave = np.column_stack([np.ones_like(self.x), np.cos(2.0 * np.pi * self.x)])
        self.mean, self.a = np.linalg.lstsq(wave, self.p, rcond=None)[0]
        self.rough = np.abs(self.p - wave @ [self.mean, self.a]).max()
        self.variation = np.abs(np.diff(self.p)).sum()


def press(cell, degree, master, slave, ratio, E=1e6):
    """Pressures at the slave's nodes, on every rank."""
    scene = layers(cell, master, slave)
    mesh = scene.mesh
    V = compat.vector_space(mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    # The softer layer has E: strains are small
    stiff = {"lower": E * max(ratio, 1.0), "upper": E * max(1.0 / ratio, 1.0)}
    moduli = [
        cellwise(scene, {name: lame(e, 0.3)[k] for name, e in stiff.items()})
        for k in (0, 1)
    ]
    load = 1.0 + 0.5 * ufl.cos(2.0 * np.pi * ufl.SpatialCoordinate(mesh)[0])
    metadata = {"quadrature_degree": 8}
    ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags, metadata=metadata)
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    F = ufl.inner(MATERIALS["linear"][0](ufl.grad(u), *moduli), ufl.grad(v)) * dx
    F += load * v[1] * ds(TAGS["top"])
    contact = raymortar.Contact(u, scene.facet_tags, [(TAGS["slave"], TAGS["master"])])
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "sides", 0)]
    SOLVERS[0](raymortar.NonlinearProblem(F, contact, bcs)).solve()
    nodes = contact.zones[0].multiplier_nodes
    lam = contact.multiplier
    x = gathered.concatenated(lam.function_space.tabulate_dof_coordinates()[nodes, 0])
    # Nodes between two ranks are on both
    _, order = np.unique(np.round(x, 9), return_index=True)
    return Pressure(x[order], -gathered.concatenated(lam.x.array[nodes])[order])
