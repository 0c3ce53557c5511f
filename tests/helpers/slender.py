"""Paths of thin bodies on rigid circles: strips that bend, and a belt on a pulley."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from pathing import Path
from problems import COMM
from strips import strip as mesh_of_strip
from strips import tag_where

import raymortar
from meshes.blocks import SIDES, Block
from meshes.meshing import assemble_blocks
from raymortar import rigid
from raymortar.core import compat

# Of the belt: lengths in m, N/m and Pa
PULLEY, THICK, STRAIGHT = 0.05, 1e-3, 0.02
TIGHT, PULL, RUBBER, LOOSE_NU, BELT_FRICTION = 1000.0, 0.012, 2e8, 0.45, 0.3


def coulomb(mu):
    """The law, None without friction."""
    return raymortar.Coulomb(mu) if mu else None


def problem_of(mesh, tags, moduli, pairs, conditions, mu, load=None, **options):
    """Neo-Hookean problem of degree 2; `conditions` takes the space, `load` the test
    function."""
    V = compat.vector_space(mesh, 2)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress, _ = MATERIALS["neo-hookean"]
    dx = ufl.dx(mesh, metadata={"quadrature_degree": 4})
    form = ufl.inner(stress(ufl.grad(u), *moduli), ufl.grad(v)) * dx
    if load is not None:
        form -= load(v)
    contact = raymortar.Contact(u, tags, pairs, friction=coulomb(mu), **options)
    return raymortar.NonlinearProblem(form, contact, conditions(V))


def held(V, mesh, tags, tag, value):
    """Condition on the facets with a tag."""
    dofs = fem.locate_dofs_topological(V, mesh.topology.dim - 1, tags.find(tag))
    return fem.dirichletbc(value, dofs, V)


def held_strip(mesh, tags, moduli, circles, mu, **options):
    """Problem of a strip whose tag 2 is held, and whose tag 1 meets rigid circles."""
    zero = fem.Constant(mesh, np.zeros(2, PETSc.ScalarType))

    def conditions(V):
        return [held(V, mesh, tags, 2, zero)]

    pairs = [(1, circle) for circle in circles]
    return problem_of(mesh, tags, moduli, pairs, conditions, mu, **options)


def bent(slenderness, mu=0.0, push=2.0, cells=(60, 2), steps=4, **options):
    """A strip of length 20 whose ends are held, below a circle of radius 5."""
    length, thick = 20.0, 20.0 / slenderness
    mesh = mesh_of_strip(*cells, length, thick)
    sides = [lambda x: np.isclose(x[1], thick)]
    sides += [lambda x: np.isclose(x[0], 0.0) | np.isclose(x[0], length)]
    tags = tag_where(mesh, *sides)
    circle = rigid.Body(rigid.Circle((0.5 * length, thick + 5.0), 5.0))
    problem = held_strip(mesh, tags, lame(100.0, 0.3), [circle], mu, **options)
    return Path(
        problem,
        lambda t: circle.move((0.0, -push * t)),
        steps,
        lambda: problem.contact.results.resultant_on(circle).force,
    )


def belt(cells=134, pull=PULL, steps=(4, 24), **options):
    """A belt around half a pulley, tightened, then pulled along it.

    Its tensions are those of the two ends.
    """
    arc = np.pi * PULLEY
    length = arc + 2.0 * STRAIGHT

    def around(x):
        s, r = x[:, 0] - STRAIGHT, PULLEY + x[:, 1]
        angle = np.pi * np.clip(s / arc, 0.0, 1.0)
        below = np.where(s < 0.0, s, np.where(s > arc, arc - s, 0.0))
        return np.column_stack([r * np.cos(angle), r * np.sin(angle) + below])

    mesh = mesh_of_strip(cells, 2, length, THICK, around)
    end = STRAIGHT - 1e-9

    def inside(x):
        r = np.where(x[1] > 0.0, np.hypot(x[0], x[1]), abs(x[0]))
        return r < PULLEY + 0.1 * THICK

    def low(x, side):
        return (x[1] < -end) & (side * x[0] > 0.0)

    tags = tag_where(mesh, inside, lambda x: low(x, 1), lambda x: low(x, -1))
    pulley = rigid.Body(rigid.Circle((0.0, 0.0), PULLEY))
    moved = fem.Constant(mesh, np.zeros(2, PETSc.ScalarType))
    tension = fem.Constant(mesh, PETSc.ScalarType(0.0))
    ds = ufl.Measure("ds", mesh, subdomain_data=tags)
    problem = problem_of(
        mesh,
        tags,
        lame(RUBBER, LOOSE_NU),
        [(1, pulley)],
        lambda V: [held(V, mesh, tags, 2, moved)],
        BELT_FRICTION,
        lambda v: -tension * v[1] * ds(3),
        **options,
    )
    tight, pulled = steps
    share = tight / (tight + pulled)

    def apply(t):
        tension.value = TIGHT / THICK * min(t / share, 1.0)
        moved.value[1] = -pull * max(t - share, 0.0) / (1.0 - share)

    def ratio():
        pull = problem.reactions({"end": problem.bcs[0]})["end"][1]
        return np.array([abs(pull) / (tension.value * THICK)])

    return Path(problem, apply, tight + pulled, ratio)


def leaves(count=3, share=0.25, steps=1, **options):
    """Leaves of a spring that lie on each other, clamped at the left, the top one loaded
    at its end; the result is the end's deflection over that of beams."""
    length, thick, young, nu, force = 0.3, 5e-3, 206e9, 0.3, 6e3
    blocks = [
        Block(
            (25 + 6 * i, 2),
            (0.0, i * thick),
            (length, (i + 1) * thick),
            tags={k: 10 * i + n for n, k in enumerate(SIDES[2], 1)},
        )
        for i in range(count)
    ]
    mesh, _, tags = assemble_blocks(COMM, blocks, "quadrilateral")
    left, right, bottom, top = range(1, 5)
    load = fem.Constant(mesh, PETSc.ScalarType(0.0))
    ds = ufl.Measure("ds", mesh, subdomain_data=tags)
    last, zero = 10 * (count - 1) + right, fem.Constant(mesh, np.zeros(2))
    problem = problem_of(
        mesh,
        tags,
        lame(young, nu),
        [(10 * i + 10 + bottom, 10 * i + top) for i in range(count - 1)],
        lambda V: [held(V, mesh, tags, 10 * i + left, zero) for i in range(count)],
        0.0,
        lambda v: -load * v[1] * ds(last),
        **options,
    )

    def apply(t):
        load.value = share * force / thick * t

    def deflection():
        form = compat.form(problem.contact.u[1] * ds(last))
        mean = COMM.allreduce(fem.assemble_scalar(form)) / thick
        stiffness = count * young / (1.0 - nu**2) * thick**3 / 4.0 / length**3
        return -mean * stiffness / (share * force)

    return Path(problem, apply, steps, deflection)
