"""Random states of two bodies in contact, and their assembled residual and tangent.

Residuals, tangents and unknowns are those of all ranks, on every rank (`gathered`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import permutations, product

from mpi4py import MPI

import gathered
import numpy as np
import ufl
from conditions import dirichlet_dofs
from dolfinx import fem
from mesh_measures import lagrange
from problems import COMM

from meshes.from_arrays import create_mesh
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Contact, Penalty
from raymortar.core import compat

CELLS = ("triangle", "quadrilateral", "tetrahedron", "hexahedron")
DEGREES = ((1, 1), (1, 2), (2, 1), (2, 2))  # of displacement, of geometry
METHODS = ("normal", "vector", "penalty")
MEASURES = ("reference", "current")
GAMMA = 50.0
# Tractions up to TRACTION can neither close nor open a point with |gap| >= CLEARANCE
CLEARANCE, TRACTION = 0.03, 0.8
REGIMES = ("open", "active", "mixed")
NONE, OPEN, CLOSED = 0, 1, 3
# Lower divisions, upper edge, lateral shift of the upper block. "single": all slave
# facets within one master facet; "overhang": part of the slave hangs over the rim
SCENES = {
    "single": (1, 0.44, (0.62, 0.0)),
    "many": (3, 1.2, (0.05, -0.03)),
    "overhang": (2, 1.2, (0.7, 0.55)),
}


def curved(x):
    """Height of an interface without symmetry."""
    return 0.7 + 0.06 * np.sin(1.3 * x[:, 0] + 0.4) - 0.04 * x[:, -1] ** 2


@lru_cache(maxsize=None)
def build_scene(kind, cell, geometry_degree, flat=False):
    """Two blocks, the upper (slave) with two facets per direction."""
    dim = 2 if cell in CELLS[:2] else 3
    divisions, edge, shift = SCENES[kind]
    return two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=(divisions,) * (dim - 1) + (1,),
        upper_divisions=(2,) * (dim - 1) + (1,),
        geometry_degree=geometry_degree,
        lower_size=(2.0,) * (dim - 1) + (0.7,),
        upper_size=(edge,) * (dim - 1) + (0.4,),
        overhang=shift[: dim - 1],
        interface=None if flat else curved,
    )


@dataclass(frozen=True)
class Case:
    """What a contact object is made of."""

    cell: str
    degree: int = 1
    geometry_degree: int = 1
    method: str = "normal"
    measure: str = "reference"

    @property
    def dim(self):
        return 2 if self.cell in CELLS[:2] else 3

    def scene(self, kind, flat=False):
        return build_scene(kind, self.cell, self.geometry_degree, flat)


def name_of(case):
    return (
        f"{case.cell}-P{case.degree}-geometry{case.geometry_degree}-{case.method}"
        f"-{case.measure}"
    )


def is_quick(case):
    return case.degree == case.geometry_degree == 2 and case.measure == "current"


def sampled(case, **others):
    """Whether a case is one of a few for several ranks: for each cell one of each
    method, or a single one in 3D; of two or more scenes that with an overhang."""
    i, k = CELLS.index(case.cell), METHODS.index(case.method)
    return (
        (k == 1 or i < 2)
        and (case.degree, case.geometry_degree) == DEGREES[(i + k) % len(DEGREES)]
        and case.measure == MEASURES[(i + k) % len(MEASURES)]
        and others.get("kind", "overhang") == "overhang"
        and others.get("regime", "mixed") == "mixed"
    )


def make_contact(
    scene, case, gamma=GAMMA, tangent="fixed", condition="points", **options
):
    """Contact between the blocks of a scene, by default with the tangent whose
    identities hold at the integration points of one state: symmetry, balance."""
    u = fem.Function(compat.vector_space(scene.mesh, case.degree))
    if case.method == "penalty":
        method = Penalty(gamma)
    else:
        method = AugmentedLagrangian(gamma, multiplier=case.method, condition=condition)
    pair = (scene.tags["slave"], scene.tags["master"])
    return Contact(
        u,
        scene.facet_tags,
        [pair],
        method,
        measure=case.measure,
        tangent=tangent,
        **options,
    )


def mass_form(V):
    """Cheapest bilinear form with the volume's sparsity."""
    v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
    dx = ufl.dx(metadata={"quadrature_degree": 1})
    return compat.form(ufl.inner(w, v) * dx)


def dof_positions(V):
    """Reference positions of all block dofs, (dofs, gdim)."""
    return V.tabulate_dof_coordinates()[:, : V.mesh.geometry.dim]


def body_dofs(scene, V, number):
    """Block dofs of the body with a number."""
    return np.unique(compat.dofmap_array(V)[scene.cell_tags.find(number)])


def upper_dofs(scene, V):
    """Block dofs of the upper body."""
    return body_dofs(scene, V, scene.bodies["upper"])


def in_upper(scene, V):
    """Whether each unknown dof of all ranks is of the upper body."""
    mask = np.zeros(len(dof_positions(V)), dtype=bool)
    mask[upper_dofs(scene, V)] = True
    return gathered.owned(V, mask)


def smooth_field(rng, x, amplitude):
    """Random sum of waves longer than the blocks, at x (n, d)."""
    d = x.shape[1]
    u = np.zeros_like(x)
    for _ in range(4):
        k, phase = rng.normal(0.0, 1.2, d), rng.uniform(0.0, 2.0 * np.pi)
        u += np.sin(x @ k + phase)[:, None] * rng.normal(0.0, 0.5, d)
    return amplitude * u


def rough_field(rng, V):
    """Random values at all dofs between -1 and 1, (dofs, gdim)."""
    n, dim = V.dofmap.index_map.size_global, V.mesh.geometry.dim
    f, owned = fem.Function(V), V.dofmap.index_map.local_range
    values = rng.uniform(-1.0, 1.0, (n, dim))[slice(*owned)]
    f.x.array[: values.size] = values.ravel()
    compat.scatter_forward(f.x)
    return f.x.array.reshape(-1, dim)


def set_multiplier(contact, rng, size=TRACTION):
    """Random multiplier, components between -size and size."""
    if contact.multiplier is None:
        return
    U, n = unknowns(contact), gathered.size_u(contact)
    U[n:] = size / contact.assembly.gamma_scale * rng.uniform(-1, 1, U.size - n)
    set_unknowns(contact, U)


def set_state(contact, scene, regime, seed, amplitude=0.05, noise=0.0):
    """Deform both bodies at random, with a random multiplier, and pair.

    The upper body is then shifted so that all points are open, all closed by
    penetration, or some of each, whatever the multiplier.
    """
    rng = np.random.default_rng(seed)
    V = contact.u.function_space
    X, upper = dof_positions(V), upper_dofs(scene, V)
    u = smooth_field(rng, X, amplitude)
    u[upper] = smooth_field(rng, X[upper], amplitude)
    u += noise * rough_field(rng, V)
    set_multiplier(contact, rng)
    for _ in range(3):  # the points change a little as the body is shifted
        contact.u.x.array[:] = u.ravel()
        contact.update()
        points = gathered.points(contact)
        gap = points["gap"][points["status"] != NONE]
        shift = {
            "open": 1.2 * CLEARANCE - gap.min(),
            "active": -1.2 * CLEARANCE - gap.max(),
            "mixed": -0.5 * (gap.min() + gap.max()),
        }
        u[upper, -1] += shift[regime]
    contact.u.x.array[:] = u.ravel()
    contact.update()


def in_regime(contact, regime):
    """Whether the points' statuses are those of a regime."""
    status = gathered.points(contact)["status"]
    hit = status[status != NONE]
    closed = np.count_nonzero(hit == CLOSED) / len(hit)
    return {
        "open": closed == 0.0,
        "active": closed == 1.0,
        "mixed": 0.1 < closed < 0.9,
    }[regime]


def unknowns(contact):
    """U = [u, multiplier / gamma_scale] as an array."""
    x = contact.create_vector()
    contact.layout.to_vector(x, contact.assembly.gamma_scale)
    return gathered.vector(contact, x)


def set_unknowns(contact, U):
    x = contact.create_vector()
    gathered.set_vector(contact, x, U)
    contact.layout.from_vector(x, contact.assembly.gamma_scale)


def assembled(contact, bcs=()):
    """Residual at the last update, as an array."""
    b = contact.create_vector()
    contact.assemble_vector(b, bcs)
    b.assemble()
    return gathered.vector(contact, b)


def residual_at(contact, U, rays_only=True):
    """Residual at the unknowns U, with the integration points where they are or,
    not rays_only, paired anew."""
    set_unknowns(contact, U)
    contact.update(pair=not rays_only)
    return assembled(contact)


def dense(contact, A):
    """Entries of an assembled matrix of the unknowns."""
    rows = gathered.rows(contact)
    return gathered.dense(A)[np.ix_(rows, rows)]


def tangent(contact, form, bcs=()):
    """Dense tangent at the present state, paired anew."""
    A = contact.create_matrix(form)
    contact.assemble_matrix(A, bcs)
    A.assemble()
    return dense(contact, A)


def constraints(contact, bcs):
    """Whether each of the unknowns is constrained, and the increment to where."""
    V, n = contact.u.function_space, gathered.size_u(contact)
    marker, g = dirichlet_dofs(bcs, V)
    change = np.where(marker == 1, g - contact.u.x.array, 0.0)
    dim = V.mesh.geometry.dim
    fixed = np.zeros(COMM.allreduce(contact.layout.size), dtype=bool)
    increment = np.zeros(len(fixed))
    fixed[:n] = gathered.owned(V, marker.reshape(-1, dim) == 1).ravel()
    increment[:n] = gathered.owned(V, change.reshape(-1, dim)).ravel()
    return fixed, increment


def moved_scene(kind, case, Q=None, eta=1.0):
    """Scene turned by Q and in another unit of length, numbered as it was."""
    scene = build_scene.__wrapped__(kind, case.cell, case.geometry_degree)
    x = scene.mesh.geometry.x[:, : case.dim]
    x[:] = eta * x @ (np.eye(case.dim) if Q is None else Q).T
    return scene


def cell_symmetries(cell):
    """Some orders of a cell's vertices that describe the same cell."""
    if cell in ("triangle", "tetrahedron"):
        return np.array(list(permutations(range(3 if cell == "triangle" else 4))))
    d = 2 if cell == "quadrilateral" else 3
    bits = (np.arange(2**d)[:, None] >> np.arange(d)) & 1
    return np.array(
        [
            ((bits[:, list(axes)] ^ np.array(flip)) << np.arange(d)).sum(axis=1)
            for axes in permutations(range(d))
            for flip in product((0, 1), repeat=d)
        ]
    )


def node_symmetries(cell, degree):
    """The same for all nodes of a cell of degree 1 or 2."""
    vertices, points = (compat.basix_element(cell, p).points for p in (1, degree))
    mapped = lagrange(cell, 1, points)[0] @ vertices[cell_symmetries(cell)]
    apart = np.linalg.norm(mapped[:, :, None] - points, axis=3)
    return apart.argmin(axis=2)


def facet_midpoints(mesh):
    """Facets of every cell and the means of their vertices, (cells, n[, 3])."""
    tdim = mesh.topology.dim
    vertices = compat.basix_element(compat.cell_name(mesh), 1).facet_vertices
    x = mesh.geometry.x[compat.geometry_dofmap(mesh)]
    middle = np.stack([x[:, list(v)].mean(axis=1) for v in vertices], axis=1)
    facets = compat.connectivity_table(mesh, tdim, tdim - 1)
    return facets.reshape(middle.shape[:2]), middle


def renumbered(scene, seed):
    """The same bodies with cells, nodes and the order of the vertices within each
    cell shuffled."""
    rng, mesh = np.random.default_rng(seed), scene.mesh
    cell, tdim = compat.cell_name(mesh), mesh.topology.dim
    cells, x = compat.geometry_dofmap(mesh), mesh.geometry.x
    node, order = rng.permutation(len(x)), rng.permutation(len(cells))
    points = np.empty((len(x), mesh.geometry.dim))
    points[node] = x[:, : mesh.geometry.dim]
    degree = compat.geometry_degree(mesh)
    symmetry = rng.choice(node_symmetries(cell, degree), len(cells))
    shuffled = node[np.take_along_axis(cells, symmetry, axis=1)[order]]
    new = create_mesh(MPI.COMM_SELF, shuffled, points, cell, degree)
    old_cell = order[np.asarray(new.topology.original_cell_index)]
    numbers = np.arange(len(cells), dtype=np.int32)
    bodies = np.empty(len(cells), dtype=np.int32)
    bodies[scene.cell_tags.indices] = scene.cell_tags.values
    old_facets, old_middle = facet_midpoints(mesh)
    facets, middle = facet_midpoints(new)
    apart = middle[:, :, None] - old_middle[old_cell][:, None]
    match = np.linalg.norm(apart, axis=3).argmin(axis=2)
    tags = np.zeros(old_facets.max() + 1, dtype=np.int32)
    tags[scene.facet_tags.indices] = scene.facet_tags.values
    tags = tags[np.take_along_axis(old_facets[old_cell], match, axis=1)]
    tagged, first = np.unique(facets[tags > 0], return_index=True)
    return replace(
        scene,
        mesh=new,
        cell_tags=compat.meshtags(new, tdim, numbers, bodies[old_cell]),
        facet_tags=compat.meshtags(new, tdim - 1, tagged, tags[tags > 0][first]),
    )


def by_place(x, other):
    """For each point of `other` the nearest of x, all of them different."""
    nearest = np.linalg.norm(x[None] - other[:, None], axis=2).argmin(axis=1)
    assert len(np.unique(nearest)) == len(x)
    return nearest
