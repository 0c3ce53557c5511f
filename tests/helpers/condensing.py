"""The same problem with dual multipliers as unknowns, and condensed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
from dolfinx import fem
from problems import COMM, DIMENSION, fix, residual
from tangents import remainders_in_petsc

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    CondensedProblem,
    Contact,
    Coulomb,
    NonlinearProblem,
    compat,
    rigid,
)

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
    the state has gone by `aside`; and what it leaves."""
    x = problem.create_vector()
    n = x.getLocalSize()
    x.array[:] = problem.u.x.array[:n]
    d = x.duplicate()
    rng = np.random.default_rng(seed + COMM.rank)
    d.array[:] = rng.normal(size=n) * ~problem.coupled.prescribed
    x.axpy(aside, d)
    steps = 10.0 ** -np.arange(5.0, 7.0, 0.5)
    rest = remainders_in_petsc(problem, x, d, steps)
    return np.polyfit(np.log(steps), np.log(rest), 1)[0], rest
