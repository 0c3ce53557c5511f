"""Boundary value problems of blocks in contact, shared by the tests.

All problems with the same cell, degrees and material compile the same two forms:
moduli are functions, loads one constant tensor on one set of facets. Stresses are
evaluated with NumPy from the gradient of the displacement, without further forms.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from mesh_measures import jacobians, lagrange

import raymortar
from meshes.blocks import Block, rotated
from meshes.meshing import Scene, assemble_blocks
from raymortar.core import compat

COMM = MPI.COMM_WORLD
CELLS_2D = ["triangle", "quadrilateral"]
CELLS_3D = ["tetrahedron", "hexahedron"]
CELLS = CELLS_2D + CELLS_3D
DIMENSION = dict.fromkeys(CELLS_2D, 2) | dict.fromkeys(CELLS_3D, 3)
# Newer versions of DOLFINx have no Newton solver
SOLVERS = [raymortar.NewtonSolver, raymortar.SNESSolver]
SOLVERS = SOLVERS if compat.newton_solver_class() else SOLVERS[1:]
# Facets under the tensor of nominal stress `Problem.load`, in tags of their own, and
# slave facets below which a layer is sheared
LOADED, LAYERED = 1, 2


# Scenes beyond meshes.scenes


def stack(
    cell,
    divisions=(3, 4, 2),
    heights=None,
    gaps=None,
    widths=None,
    rotation=None,
    geometry_degree=1,
    **options,
):
    """Blocks on each other, from the lowest up, with unrelated nodes. Collective.

    Block i has tags bottom_i, top_i, left_i, right_i (front_i, back_i): 10 i + 1
    to 10 i + 6. Its lateral extents are [0, widths[i]], with `gaps[i]` below it.
    """
    dim, n = DIMENSION[cell], len(divisions)
    names = ["bottom", "top", "left", "right", "front", "back"][: 2 * dim]
    heights = [1.0] * n if heights is None else heights
    gaps = [0.0] * n if gaps is None else gaps
    widths = [1.0] * n if widths is None else widths
    blocks, tags, z = [], {}, 0.0
    for i in range(n):
        z += gaps[i]
        sides = {name: 10 * (i + 1) + k for k, name in enumerate(names, 1)}
        tags |= {f"{name}_{i}": tag for name, tag in sides.items()}
        lower, upper = (0.0,) * (dim - 1), (widths[i],) * (dim - 1)
        blocks.append(
            Block(
                (divisions[i],) * dim,
                (*lower, z),
                (*upper, z + heights[i]),
                tags=sides,
            )
        )
        z += heights[i]
    mesh, cell_tags, facet_tags = assemble_blocks(
        COMM, rotated(blocks, rotation), cell, geometry_degree, **options
    )
    tags |= {"slave": tags["bottom_1"], "master": tags["top_0"]}
    tags |= {"bottom": tags["bottom_0"], "top": tags[f"top_{n - 1}"]}
    bodies = {f"{i}": i + 1 for i in range(n)}
    return Scene(mesh, cell_tags, facet_tags, tags, bodies)


# Dirichlet conditions


def fix(V, scene, name, component=None, value=0.0):
    """Dirichlet condition on the facets with a tag, or several. Collective.

    Parameters
    ----------
    V
        Space of the displacement.
    scene
        Scene of the mesh.
    name
        Name of a tag, or a list of names.
    component
        Component; None: all of them.
    value
        Number (for all components the same), ``fem.Constant`` (which may change
        later), or callable from points (n, d) to values (n,), (n, d) for all.
    """
    dim = scene.mesh.geometry.dim
    names = [name] if isinstance(name, str) else name
    facets = np.unique(
        np.concatenate([scene.facet_tags.find(scene.tags[n]) for n in names])
    )
    part = V if component is None else V.sub(component)
    if not callable(value) or isinstance(value, fem.Constant):
        if not isinstance(value, fem.Constant):
            shape = () if component is not None else (dim,)
            value = fem.Constant(scene.mesh, np.full(shape, value, PETSc.ScalarType))
        dofs = fem.locate_dofs_topological(part, dim - 1, facets)
        return fem.dirichletbc(value, dofs, part)
    if component is None:
        g = fem.Function(V)
        dofs = fem.locate_dofs_topological(V, dim - 1, facets)
    else:
        W, _ = part.collapse()
        g = fem.Function(W)
        dofs = fem.locate_dofs_topological((part, W), dim - 1, facets)
    # UFL-free, so that it is the same in every version
    g.interpolate(lambda x: np.asarray(value(x[:dim].T)).T)
    return (
        fem.dirichletbc(g, dofs)
        if component is None
        else fem.dirichletbc(g, dofs, part)
    )


def symmetry(V, scene, value=0.0):
    """No normal displacement at x = 0 and y = 0 (3D), of all blocks."""
    sides = ("left", "front")[: scene.mesh.geometry.dim - 1]
    found = [(k, n) for k, s in enumerate(sides) for n in scene.tags if s in n]
    return [fix(V, scene, name, k, value) for k, name in found]


# Problems


@dataclasses.dataclass
class Problem:
    """A boundary value problem with contact; see `build`."""

    scene: Scene
    u: Any
    contact: raymortar.Contact
    problem: raymortar.NonlinearProblem
    material: str
    moduli: tuple[Any, Any]  # mu and lambda, functions constant on each cell
    load: Any  # nominal stress on the loaded facets, fem.Constant (d, d)
    solver: Any = None

    @property
    def dim(self):
        return self.u.function_space.mesh.geometry.dim

    def solve(self, solver=SOLVERS[0], *args, **tolerances):
        """Newton iterations; `raymortar.ConvergenceError` if there are too many.

        Tolerances are those of `tolerate`.
        """
        if self.solver is None:
            self.solver = solver(self.problem, *args)
        tolerate(self.solver, **tolerances)
        iterations, _ = self.solver.solve()
        return iterations

    @property
    def history(self):
        """Norms of the residual of the last solve."""
        return self.problem.history

    def gradient(self):
        """Displacement gradient at points of this rank's cells, (n, points, d, d)."""
        return gradient(self.u, check_points(self.u))

    def stress(self):
        """First Piola-Kirchhoff stress at the same points."""
        law = MATERIALS[self.material][1]
        moduli = [_on_cells(m)[:, None, None, None] for m in self.moduli]
        H = self.gradient()
        return law(H, *(m[: len(H)] for m in moduli))

    def slave_multiplier(self):
        """Multiplier at this rank's dofs on the slave surfaces, (n, components)."""
        contact = self.contact
        values = contact.multiplier.x.array.reshape(-1, contact.layout.components)
        nodes = np.concatenate([zone.multiplier_nodes for zone in contact.zones])
        return values[np.unique(nodes)]

    def slave_displacement_nodes(self):
        """Reference positions (n, d) of the nodes of u on the slave surfaces."""
        V = self.u.function_space
        dofs = [zone.facets.slave_surface.dofs for zone in self.contact.zones]
        return V.tabulate_dof_coordinates()[np.unique(np.concatenate(dofs)), : self.dim]


def tolerate(solver, **tolerances):
    """Set rtol or max_it of either solver."""
    if isinstance(solver, raymortar.SNESSolver):
        solver.snes.setTolerances(**tolerances)
        return
    for name, value in tolerances.items():
        setattr(solver, name, value)


def _on_cells(function):
    """Values of a function constant on each cell, ghosts included."""
    return function.x.array[compat.dofmap_array(function.function_space)[:, 0]]


def cellwise(scene, values):
    """Function constant on each body: a number, or numbers by body name."""
    W = compat.space(scene.mesh, "DG", 0)
    function = fem.Function(W)
    dofs = compat.dofmap_array(W)[:, 0]
    if np.isscalar(values):
        values = dict.fromkeys(scene.bodies, values)
    for name, value in values.items():
        cells = scene.cell_tags.indices[scene.cell_tags.values == scene.bodies[name]]
        function.x.array[dofs[cells]] = value
    return function


def quadrature_degree(mesh, p):
    """Integrates a constant stress times a test gradient exactly on any cell."""
    g = compat.geometry_degree(mesh)
    affine = g == 1 and compat.cell_name(mesh) in ("triangle", "tetrahedron")
    return max(2 * (p - 1), 1) if affine else 2 * (p + g - 1)


def residual(scene, u, material="linear", E=2000.0, nu=0.3, loaded=(), layer=None):
    """UFL residual without contact, with its moduli and its load.

    Parameters
    ----------
    scene, u
        Scene and displacement.
    material
        Key of `MATERIALS`.
    E, nu
        Number, or numbers by body name.
    loaded
        Names of the tags under the load.
    layer
        ``fem.Constant`` (d, d), which works on the gradient along the slave: lateral
        tractions of a layer below it, integrated by parts.

    Returns
    -------
    F, (mu, lambda), load
        The load is a ``fem.Constant`` S (d, d), zero at first: traction S N.
    """
    mesh, dim = scene.mesh, scene.mesh.geometry.dim
    p = compat.element_info(u.function_space).degree
    E, nu = (
        of_body if isinstance(of_body, dict) else dict.fromkeys(scene.bodies, of_body)
        for of_body in (E, nu)
    )
    mu, lmbda = (
        cellwise(scene, {body: lame(E[body], nu[body])[k] for body in E})
        for k in (0, 1)
    )
    find = scene.facet_tags.find
    facets = [find(scene.tags[name]) for name in loaded] or [np.empty(0, np.int32)]
    facets = np.unique(np.concatenate(facets)).astype(np.int32)
    layered = find(scene.tags["slave"]) if layer is not None else facets[:0]
    tags = compat.meshtags(
        mesh,
        dim - 1,
        np.concatenate([facets, layered]),
        np.repeat([LOADED, LAYERED], [len(facets), len(layered)]),
    )
    degree = quadrature_degree(mesh, p)
    dx = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": degree})
    ds = ufl.Measure(
        "ds",
        domain=mesh,
        subdomain_data=tags,
        metadata={"quadrature_degree": 2 * (p + compat.geometry_degree(mesh))},
    )
    load = fem.Constant(mesh, np.zeros((dim, dim), dtype=PETSc.ScalarType))
    v = ufl.TestFunction(u.function_space)
    P = MATERIALS[material][0](ufl.grad(u), mu, lmbda)
    F = ufl.inner(P, ufl.grad(v)) * dx
    F -= ufl.inner(load * ufl.FacetNormal(mesh), v) * ds(LOADED)
    if layer is not None:
        F -= ufl.inner(layer, ufl.grad(v)) * ds(LAYERED)
    return F, (mu, lmbda), load


def build(
    scene,
    degree=1,
    material="linear",
    method=None,
    *,
    E=2000.0,
    nu=0.3,
    pairs=None,
    swap=False,
    bcs: Callable | None = None,
    loaded=(),
    load=None,
    layer=None,
    **options,
):
    """Problem of a scene. Collective.

    Parameters
    ----------
    scene
        Scene.
    degree
        Of the displacement.
    material, E, nu, loaded, layer
        See `residual`.
    method
        Of contact, the augmented Lagrangian by default.
    pairs
        Names of (slave, master) tags; by default [("slave", "master")].
    swap
        Exchange slave and master.
    bcs
        Takes (V, scene) to a list of Dirichlet conditions.
    load
        Nominal stress (d, d), or a number: that times the identity.
    options
        Of `raymortar.Contact`.
    """
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    F, moduli, S = residual(scene, u, material, E, nu, loaded, layer)
    if load is not None:
        S.value[:] = load * np.eye(len(S.value)) if np.isscalar(load) else load
    pairs = [("slave", "master")] if pairs is None else pairs
    named = [pair[::-1] if swap else pair for pair in pairs]
    tags = [tuple(scene.tags[name] for name in pair) for pair in named]
    contact = raymortar.Contact(u, scene.facet_tags, tags, method, **options)
    conditions = [] if bcs is None else bcs(V, scene)
    problem = raymortar.NonlinearProblem(F, contact, conditions)
    return Problem(scene, u, contact, problem, material, moduli, S)


# Evaluation


def check_points(u):
    """Reference points of a cell, inside and at the vertices."""
    cell = compat.cell_name(u.function_space.mesh)
    points, _ = compat.quadrature(cell, 3)
    return np.vstack([points, compat.basix_element(cell, 1).points])


def gradient(u, points):
    """Gradient of a displacement at reference points of this rank's owned cells.

    Returns
    -------
    ndarray
        du_i/dX_j, shape (cells, points, d, d).
    """
    V = u.function_space
    mesh = V.mesh
    J = jacobians(mesh, points)
    table = compat.dofmap_array(V)[: len(J)]
    nodal = u.x.array.reshape(-1, mesh.geometry.dim)[table]
    shape = lagrange(compat.cell_name(mesh), compat.element_info(V).degree, points)[1:]
    by_reference = np.einsum("aqn,cni->cqia", shape, nodal)
    return by_reference @ np.linalg.inv(J)


def worst(values):
    """Largest magnitude on any rank. Collective."""
    local = float(np.max(np.abs(values), initial=0.0))
    return COMM.allreduce(np.inf if np.isnan(local) else local, op=MPI.MAX)
