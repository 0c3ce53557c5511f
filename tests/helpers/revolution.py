"""Solids of revolution, meshed in the half plane (r, z): forms, supports, scenes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import locate_entities_boundary
from materials import MATERIALS, lame
from problems import COMM, SOLVERS, cellwise

from meshes.blocks import Block, mirrored
from meshes.graded import PoleGrid, box_blocks
from meshes.meshing import Scene, assemble_blocks
from raymortar import Contact, NonlinearProblem
from raymortar.core import compat

HALF_SPACE = {"slave": 1, "bottom": 2, "left": 3, "side": 4}
BESIDE = 5  # tag of the surface beside a punch


def gradient(v, r):
    """Displacement gradient with the hoop stretch, in the order (r, z, hoop)."""
    H = ufl.grad(v)
    return ufl.as_tensor(
        [[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, v[0] / r]]
    )


def residual(u, mu, lmbda, material="linear", degree=None):
    """Virtual work of the stresses over a full turn."""
    V = u.function_space
    v, r = ufl.TestFunction(V), ufl.SpatialCoordinate(V.mesh)[0]
    if degree is None:
        degree = 2 * compat.element_info(V).degree + 2
    P = MATERIALS[material][0](gradient(u, r), mu, lmbda)
    dx = ufl.dx(metadata={"quadrature_degree": degree})
    return ufl.inner(P, gradient(v, r)) * 2 * ufl.pi * r * dx


def moved(scene, radius):
    """A scene shifted away from the axis."""
    scene.mesh.geometry.x[:, 0] += radius
    return scene


def disc(cell, n, radius=0.0, side=lambda z: 1.0 + 0.0 * z, slave="top"):
    """A disc, or a ring, 1 high; `slave` is one of its sides."""
    tags = {name: k for k, name in enumerate(("bottom", "top", "left", "right"), 1)}

    def shaped(x):
        width = side(x[:, 1])
        return np.column_stack([radius + width * x[:, 0], x[:, 1]])

    block = Block(
        (n, n), (0.0, 0.0), (1.0, 1.0), mapping=shaped, tags=tags, body="disc"
    )
    mesh, cells, facets = assemble_blocks(COMM, [block], cell)
    return Scene(mesh, cells, facets, tags | {"slave": tags[slave]}, {"disc": 1})


def half_space(a, facets, punch=False):
    """A cylinder of 400 contact radii a, fine near its pole; in the plane half of a half
    plane. Of a punch the slave ends at the contact radius."""
    grid = PoleGrid(a, a / facets, 1.3)
    names = {"surface": "slave", "left": "left", "far": "bottom", "side": "side"}
    tags = {place: HALF_SPACE[name] for place, name in names.items()}
    blocks = box_blocks((400.0 * a,) * 2, grid, tags, "half-space")
    mesh, cells, facets = assemble_blocks(COMM, [mirrored(b, 1) for b in blocks],
                                          "quadrilateral")  # fmt: skip
    if punch:
        below = locate_entities_boundary(
            mesh, 1, lambda x: (abs(x[1]) < 1e-9 * a) & (x[0] < a * (1.0 + 1e-9))
        )
        beside = (facets.values == HALF_SPACE["slave"]) & ~np.isin(
            facets.indices, below
        )
        values = np.where(beside, BESIDE, facets.values)
        facets = compat.meshtags(mesh, 1, facets.indices, values)
    return Scene(mesh, cells, facets, HALF_SPACE, {"half-space": 1})


def build(
    scene, degree=1, material="linear", *, E=2000.0, nu=0.3, bcs=None, master=None,
    pairs=None, kind=Contact, **options
):  # fmt: skip
    """Problem of a scene. Collective.

    Parameters
    ----------
    scene, degree, material
        Scene, degree of the displacement, key of `MATERIALS`.
    E, nu
        Number, or numbers by body name.
    bcs
        Takes (V, scene) to a list of Dirichlet conditions.
    master
        In place of the scene's master: a shape or a body of `rigid`.
    kind
        `raymortar.Contact` or `raymortar.Tie`.
    options
        Of it.
    """
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    E, nu = (
        x if isinstance(x, dict) else dict.fromkeys(scene.bodies, x) for x in (E, nu)
    )
    mu, lmbda = (
        cellwise(scene, {body: lame(E[body], nu[body])[k] for body in E})
        for k in (0, 1)
    )
    master = scene.tags.get("master") if master is None else master
    pairs = [(scene.tags["slave"], master)] if pairs is None else pairs
    contact = kind(u, scene.facet_tags, pairs, axisymmetric=True, **options)
    conditions = bcs(V, scene) if bcs else []
    problem = NonlinearProblem(residual(u, mu, lmbda, material), contact, conditions)
    return SimpleNamespace(scene=scene, u=u, contact=contact, problem=problem)


def solve(found):
    """Newton iterations of the scene's problem."""
    found.solver = SOLVERS[-1](found.problem)
    return found.solver.solve()[0]


def on_axis(V, scene):
    """No radial displacement at r = 0."""
    W = V.sub(0)
    dofs = fem.locate_dofs_geometrical(
        (W, W.collapse()[0]), lambda x: np.isclose(x[0], 0.0)
    )
    zero = fem.Function(W.collapse()[0])
    return fem.dirichletbc(zero, dofs, W)
