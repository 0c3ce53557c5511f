"""The multiplier follows a smooth pressure without oscillating.

Two layers with rollers on their sides under the pressure 1 + cos(2 pi x) / 2 on top: in
linear elasticity the contact pressure is 1 + a cos(2 pi x) with some a, of total
variation 4 a. Stiffness of the layers a thousand times apart, either way, and the
slave's facets eight times finer or coarser than the master's.
"""

import dataclasses

import gathered
import numpy as np
import pytest
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import CELLS_2D, COMM, SOLVERS, cellwise, fix

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import compat

TAGS = {"bottom": 1, "top": 2, "slave": 3, "master": 4, "sides": 5}
RATIOS = [1.0, 1e3, 1e-3]  # of the master's modulus to the slave's
FINER, COARSER = 8, -8


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


# A slave that is finer and not softer than a master of few facets follows their edges
SMOOTH = [(1.0, COARSER), (1e3, FINER), (1e3, COARSER), (1e-3, COARSER)]


@pytest.mark.mpi(where=lambda ratio, finer, **_: (ratio, finer) == (1e3, FINER))
@pytest.mark.parametrize("ratio, finer", SMOOTH)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS_2D)
def test_total_variation_is_that_of_the_wave(
    cell, degree, ratio, finer, record_property
):
    master, slave = (8, 64) if finer == FINER else (64, 8)
    found = press(cell, degree, master, slave, ratio)
    record_property("variation", [found.variation, 4.0 * found.a, found.rough])
    assert abs(found.mean - 1.0) < 1e-3
    # Eight triangles across a wave have errors of their own
    off = 0.03 if cell == "quadrilateral" or finer == FINER else 0.15
    assert abs(found.variation / (4.0 * found.a) - 1.0) < off


@pytest.mark.mpi(where=lambda degree, ratio, **_: (degree, ratio) == (1, 1.0))
@pytest.mark.parametrize("ratio", [1.0, 1e-3])
@pytest.mark.parametrize("degree, least", [(1, 0.8), (2, 2.0)])
def test_edges_of_a_coarse_master_show_less_as_it_is_refined(
    degree, least, ratio, record_property
):
    """What a finer and stiffer slave feels of them is an error of the master's mesh:
    an instability of the multiplier's would stay."""
    found = [press("quadrilateral", degree, n, 8 * n, ratio).rough for n in (4, 8)]
    record_property("roughness", found)
    assert np.log2(found[0] / found[1]) > least
