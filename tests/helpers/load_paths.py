"""Blocks of the large compression A3 whose top moves in load steps."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import COMM, DIMENSION, SOLVERS, build, cellwise, fix, residual, worst
from squeezing import homogeneous, squeezed

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Contact, Coulomb, LoadSteps, NonlinearProblem
from raymortar.core import compat


def divisions(cell):
    """Cells per direction of the lower and of the upper block."""
    return (5, 4) if DIMENSION[cell] == 2 else (3, 2)


def blocks(cell, **options):
    """Two blocks."""
    return two_blocks(COMM, DIMENSION[cell], cell, *divisions(cell), **options)


def top_moves(cell, solver=SOLVERS[0], steps=4, share=0.2, gap=0.0, **options):
    """LoadSteps over A3 with a top that may be moved."""
    dim = DIMENSION[cell]
    scene = blocks(cell, gap=gap)
    down = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))

    def conditions(V, scene):
        fixed = squeezed(V, scene)[:-1]
        return [*fixed, fix(V, scene, "top", dim - 1, down)]

    problem = build(scene, material="neo-hookean", bcs=conditions)
    problem.solver = solver(problem.problem)

    def apply(t):
        down.value = -share * 2.0 * t

    return problem, LoadSteps(problem.solver, apply, steps, **options)


def exact(problem):
    F = homogeneous(problem.dim)
    return worst(problem.gradient() + np.eye(problem.dim) - F) <= 1e-8


def sticking(cell, solver=SOLVERS[0], gamma=1e3, **options):
    """LoadSteps over a punch with much friction and gamma, whose full steps wander."""
    dim = DIMENSION[cell]
    scene = blocks(cell, upper_size=(0.6,) * (dim - 1) + (1.0,))
    top = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))

    def conditions(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    problem = build(
        scene, material="neo-hookean", bcs=conditions, friction=Coulomb(1.0)
    )
    problem.contact.set_gamma(gamma * problem.contact.gamma)
    problem.solver = solver(problem.problem)

    def apply(t):
        top.value[-1] = -0.1 * t

    return problem, LoadSteps(problem.solver, apply, 2, **options)


def cycling(cell, solver=SOLVERS[0]):
    """Bodies far apart under forces u^3 - 2 u + 2, component by component: from u = 0
    Newton's method goes to 1 and back for ever."""
    scene = blocks(cell, gap=10.0)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    v = ufl.TestFunction(u.function_space)
    force = sum((-u[i] ** 3 + 2 * u[i] - 2) * v[i] for i in range(len(u)))
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = Contact(u, scene.facet_tags, pairs, AugmentedLagrangian(1.0))
    problem = NonlinearProblem(force * ufl.dx, contact)
    return solver(problem)


def resting(
    cell,
    gap,
    friction=None,
    solver=SOLVERS[0],
    degree=1,
    force=1.0,
    lean=0.0,
    aside=0.0,
    sinks=0.0,
    method=None,
    **options,
):
    """LoadSteps of two steps over a block under its weight, which nothing but contact
    holds, above a wider one; `force` is the unit of forces. With `lean` the
    weight, the same in all, is off the middle, so that points touch one by one; `aside`
    is the share of it that acts along x besides. The lower block `sinks` by so much.

    Returns
    -------
    problem, LoadSteps, weight (force).
    """
    dim = DIMENSION[cell]
    size = (0.6,) * (dim - 1) + (1.0,)
    scene = blocks(cell, upper_size=size, gap=gap)
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    form, _, _ = residual(scene, u, "neo-hookean", 2000.0 * force)
    density = cellwise(scene, {"lower": 0.0, "upper": 20.0 * force})
    x = ufl.SpatialCoordinate(scene.mesh)[0]
    density *= 1.0 + lean * (2.0 * x - 1.0)
    factor = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    v = ufl.TestFunction(V)
    form += factor * density * (v[dim - 1] - aside * v[0]) * ufl.dx
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    given = {} if method is None else {"method": method}
    contact = Contact(u, scene.facet_tags, pairs, friction=friction, **given)
    bottom = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))
    problem = NonlinearProblem(form, contact, [fix(V, scene, "bottom", None, bottom)])

    def apply(t):
        factor.value, bottom.value[-1] = t, -sinks * t

    steps = LoadSteps(solver(problem), apply, 2, **options)
    return problem, steps, 20.0 * force * float(np.prod(size))


def body_above(contact, zone):
    """Number of the body whose facets are the slave of a zone: partitions change it."""
    of, slave = contact.system.bodies, contact.zones[zone].facets.slave_surface
    mine = of.dofs[slave.dofs].max(initial=0)
    return contact.layout.comm.allreduce(mine, MPI.MAX)


def nodal(problem):
    """Displacements of this rank's nodes, (n, d)."""
    u = problem.contact.u
    return u.x.array.reshape(-1, u.function_space.dofmap.index_map_bs)


def under_a_press(gap, push=0.05, size=1.0, E=10.0, **options):
    """LoadSteps over a press that comes down through a gap onto a loose block, which
    rests on a bed.

    Returns
    -------
    contact, LoadSteps.
    """
    bed = Block((8, 4), (0, 0), (2, 1), tags={"bottom": 1, "top": 2})
    loose = Block((5, 5), (0.5, 1), (1.5, 2), tags={"bottom": 3, "top": 4})
    press = Block((8, 4), (0, 2 + gap), (2, 3 + gap), tags={"bottom": 5, "top": 6})
    mesh, _, tags = assemble_blocks(COMM, [bed, loose, press], "quadrilateral")
    mesh.geometry.x[:] *= size
    V = compat.vector_space(mesh, 1)
    u = fem.Function(V)
    stress = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(E, 0.3))
    form = ufl.inner(stress, ufl.grad(ufl.TestFunction(V))) * ufl.dx
    down = fem.Constant(mesh, np.zeros(2, PETSc.ScalarType))
    held = {1: np.zeros(2, PETSc.ScalarType), 6: down}
    bcs = [
        fem.dirichletbc(value, fem.locate_dofs_topological(V, 1, tags.find(tag)), V)
        for tag, value in held.items()
    ]
    contact = Contact(u, tags, [(3, 2), (4, 5)], friction=Coulomb(0.3))

    def apply(t):
        down.value[1] = -(gap + push) * size * t

    solver = SOLVERS[0](NonlinearProblem(form, contact, bcs))
    return contact, LoadSteps(solver, apply, stabilize=True, **options)
