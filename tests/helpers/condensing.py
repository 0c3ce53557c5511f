"""The same problem with dual multipliers as unknowns, and condensed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem, mesh
from problems import COMM, DIMENSION, fix, residual
from tangents import remainders_in_petsc

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    CondensedProblem,
    Contact,
    Coulomb,
    NonlinearProblem,
    rigid,
)
from raymortar.core import compat

DUAL = AugmentedLagrangian(condition="nodes", multiplier="dual")
DIRECT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}


@dataclass
class Pressed:
    """A soft block that is pressed on a stiffer one and dragged."""

    u: Any
    contact: Contact
    load: fem.Constant
    F: Any
    bcs: list[Any]
    scene: Any

    def coupled(self):
        return NonlinearProblem(self.F, self.contact, self.bcs)

    def condensed(self):
        return CondensedProblem(self.F, self.u, self.contact, self.bcs)


def pressed(
    cell,
    degree=1,
    mu=None,
    material="neo-hookean",
    overhang=0.0,
    lower=1.3,
    upper=1.0,
    divisions=(3, 4),
    stiff=5.0,
    method=DUAL,
    law=None,
    **options,
):
    """Make the blocks; overhang is how far the upper one is beside the lower, of a
    width."""
    dim, sizes = DIMENSION[cell], {"lower_size": lower, "upper_size": upper}
    scene = two_blocks(COMM, dim, cell, *divisions, overhang=overhang, **sizes)
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    F, _, _ = residual(scene, u, material, {"lower": stiff, "upper": 1.0})
    load = fem.Constant(scene.mesh, np.zeros(dim))
    tags = (scene.tags["slave"], scene.tags["master"])
    friction = law if mu is None else Coulomb(mu)
    contact = Contact(u, scene.facet_tags, [tags], method, friction, **options)
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, load)]
    return Pressed(u, contact, load, F, bcs, scene)


def indented(degree=1, mu=None, centres=(0.5,), radius=0.5, **options):
    """A block that rigid circles are pressed into; and the circles."""
    scene = two_blocks(COMM, 2, "quadrilateral", 3, 10)
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    F, _, _ = residual(scene, u, "neo-hookean", 1.0)
    tips = [rigid.Body(rigid.Circle((x, 2.0 + radius), radius)) for x in centres]
    friction = None if mu is None else Coulomb(mu)
    pairs = [(scene.tags["top"], tip) for tip in tips]
    contact = Contact(u, scene.facet_tags, pairs, DUAL, friction, **options)
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "slave")]
    load = fem.Constant(scene.mesh, np.zeros(2))
    return Pressed(u, contact, load, F, bcs, scene), tips


def cantilever(method=DUAL):
    """A neo-Hookean beam of hexahedra above a plane; its load is of its volume."""
    ends = [np.zeros(3), np.array([10.0, 1.0, 1.0])]
    beam = mesh.create_box(COMM, ends, [20, 2, 2], mesh.CellType.hexahedron)
    V = compat.vector_space(beam, 1)
    u, v, load = fem.Function(V), ufl.TestFunction(V), fem.Constant(beam, np.zeros(3))
    lam, shear = 1e4 * 0.3 / (1.3 * 0.4), 1e4 / 2.6
    F = ufl.variable(ufl.Identity(3) + ufl.grad(u))
    log = ufl.ln(ufl.det(F))
    energy = shear / 2 * (ufl.tr(F.T * F) - 3 - 2 * log) + lam / 2 * log**2
    dx = ufl.Measure("dx", domain=beam, metadata={"quadrature_degree": 3})
    form = ufl.inner(ufl.grad(v), ufl.diff(energy, F)) * dx - ufl.inner(v, load) * dx
    find = mesh.locate_entities_boundary
    below = find(beam, 2, lambda x: np.isclose(x[2], 0.0))
    tags = mesh.meshtags(beam, 2, below, np.ones(len(below), np.int32))
    left = find(beam, 2, lambda x: np.isclose(x[0], 0.0))
    at = fem.locate_dofs_topological(V, 2, left)
    bcs = [fem.dirichletbc(np.zeros(3), at, V)]
    plane = rigid.Plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0))
    contact = Contact(u, tags, [(1, plane)], method)
    return Pressed(u, contact, load, form, bcs, None)


def iterates(problem, share=1.0, count=10):
    """Owned displacements of Newton's iterates from the present state, with a share of
    each step, by the coupled problem or the condensed one."""
    x, b, A = problem.create_vector(), problem.create_vector(), problem.create_matrix()
    dx, n = x.duplicate(), problem.contact.layout.n
    whole = problem.contact.layout.create_vector()
    problem.contact.to_vector(whole)
    x.array[:] = whole.array_r[: x.getLocalSize()]
    ksp = PETSc.KSP().create(COMM)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    found = []
    for _ in range(count):
        problem.F(x, b)
        found.append(x.array_r[:n].copy())
        problem.J(x, A)
        ksp.reset()
        ksp.setOperators(A)
        ksp.solve(b, dx)
        x.axpy(-share, dx)
    return found


def newton(problem, rtol=1e-12, most=25):
    """Newton's method in the user's unknowns by a direct solver; norms of the
    residuals. As DOLFINx's solver does, it starts with the conditions not met."""
    x, b, A = problem.create_vector(), problem.create_vector(), problem.create_matrix()
    dx = x.duplicate()
    n = x.getLocalSize()
    x.array[:] = problem.u.x.array[:n]
    ksp = PETSc.KSP().create(COMM)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    norms = []
    while len(norms) < most:
        problem.F(x, b)
        norms.append(b.norm())
        if norms[-1] <= rtol * max(norms):
            break
        problem.J(x, A)
        ksp.setOperators(A)
        ksp.solve(b, dx)
        x.axpy(-1.0, dx)
    return norms


def taylor_order(problem, aside=0.0, seed=0):
    """Order of what the tangent leaves of the residual, along a random direction that
    the state has gone by `aside`; and what it leaves. Slave nodes are in balance there:
    out of it, J is that of the coupled system, where displacements and multipliers vary
    together."""
    x = problem.create_vector()
    n = x.getLocalSize()
    x.array[:] = problem.u.x.array[:n]
    d = x.duplicate()
    rng = np.random.default_rng(seed + COMM.rank)
    d.array[:] = rng.normal(size=n) * ~problem.coupled.prescribed
    x.axpy(aside, d)
    problem.F(x, x.duplicate())
    balanced = problem.contact.layout.create_vector()
    balanced.array[:] = np.append(x.array_r, problem._lam + problem._change)
    problem.contact.from_vector(balanced)
    steps = 10.0 ** -np.arange(5.0, 7.0, 0.5)
    rest = remainders_in_petsc(problem, x, d, steps)
    return np.polyfit(np.log(steps), np.log(rest), 1)[0], rest
