"""Blocks in contact whose displacement is solved for beside other unknowns.

The same problem in several ways: the displacement alone, as a part of a mixed Function,
and as one of several Functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION, fix, stack

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import versions
from raymortar.core import compat
from raymortar.io.partitions import strips

MU = 10.0
WAYS = ("mixed", "blocked")


@dataclass
class Hosted:
    """A problem, and where its unknowns are."""

    scene: Any
    contact: Any
    problem: Any
    functions: list[Any]  # one for each part, of a mixed Function collapsed copies
    move: Any = None  # Constants of the top's displacement

    def parts(self):
        """Values of each part on a space of its own, owned dofs of all ranks, by
        place."""
        return [by_place(f) for f in self.collapsed()]

    def collapsed(self):
        """The parts as Functions of their own."""
        (given,) = self.contact.unknowns.displacements
        if len(self.functions) > 1 or given.component is None:
            return self.functions
        (w,) = self.functions
        n = compat.num_parts(w.function_space)
        return [w.sub(i).collapse() for i in range(n)]

    def push(self, *values):
        """Displacement of the top."""
        for constant, value in zip(self.move, values):
            constant.value = value


def by_place(*functions):
    """Values of all ranks, (nodes, components), sorted by place."""
    found = [_with_places(f) for f in functions]
    rows = np.concatenate(COMM.allgather(np.concatenate(found)))
    # A node of two bodies has the same place twice: their values tell them apart
    keys = np.round(rows, 6)
    dim = functions[0].function_space.mesh.geometry.dim
    return rows[np.lexsort(keys.T[::-1])][:, dim:]


def _with_places(f):
    """Places and values at the owned nodes."""
    V = f.function_space
    bs, n = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    dim = V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:n, :dim]
    values = f.x.array[: n * bs].reshape(-1, bs)
    return np.hstack([x, values])


def neo_hookean(u, p, kappa):
    """Nominal stress and constraint of a nearly incompressible body in plane strain."""
    d = len(u)
    F = ufl.Identity(d) + ufl.grad(u)
    J, inverse = ufl.det(F), ufl.inv(F).T
    isochoric = MU * (F - inverse)
    return isochoric + p * J * inverse, (J - 1.0) - p / kappa


def blocks(cell="triangle", divisions=(4, 3), **options):
    """Two blocks on each other, the upper one narrower than the lower."""
    return stack(cell, divisions, widths=[1.0, 0.6], **options)


def conditions(V, scene, top):
    """Bottom held, the top moved, on a displacement's space or a part of a mixed one.

    Component by component, which both take alike.
    """
    held = [fix(V, scene, "bottom", i) for i in range(scene.mesh.geometry.dim)]
    return held + [fix(V, scene, "top", i, value) for i, value in enumerate(top)]


def hosted(way, scene, parts, residual, conditions_of, **options):
    """A problem with several unknowns, the displacement first.

    Parameters
    ----------
    way
        ``"mixed"``: one mixed Function; ``"blocked"``: a Function for each.
    parts
        Name of each unknown, and (family, degree, shape) of its space.
    residual
        From the unknowns and the test functions to a residual for each.
    conditions_of
        From the spaces of the unknowns to Dirichlet conditions.
    options
        Of `Contact`.
    """
    mesh = scene.mesh
    if way == "mixed":
        w = fem.Function(versions.mixed_space(mesh, *parts.values()), name="w")
        functions, given = [w], w.sub(0)
        unknowns = ufl.split(w)
        tests = ufl.split(ufl.TestFunction(w.function_space))
        spaces = [w.function_space.sub(i) for i in range(len(parts))]
    else:
        unknowns = functions = [
            fem.Function(compat.space(mesh, *part), name=name)
            for name, part in parts.items()
        ]
        given = functions[0]
        spaces = [f.function_space for f in functions]
        tests = [ufl.TestFunction(V) for V in spaces]
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(given, scene.facet_tags, pairs, **options)
    F, bcs = residual(unknowns, tests), conditions_of(spaces)
    several = {} if way == "mixed" else {"u": functions}
    problem = raymortar.NonlinearProblem(
        sum(F[1:], F[0]) if way == "mixed" else F, contact, bcs, **several
    )
    return Hosted(scene, contact, problem, functions)


def moving_top(scene):
    """Constants of the top's displacement."""
    dim = scene.mesh.geometry.dim
    return [fem.Constant(scene.mesh, PETSc.ScalarType(0.0)) for _ in range(dim)]


def taylor_hood(way, kappa=2000.0 * MU, scene=None, unit=1.0, **options):
    """Two nearly incompressible blocks, the upper pressed on the lower and sheared.

    Parameters
    ----------
    way
        ``"mixed"`` or ``"blocked"``.
    kappa
        Bulk modulus.
    unit
        Stress that the pressure is measured in, and its equation is divided by.
    options
        Of `Contact`.
    """
    scene = blocks() if scene is None else scene
    mesh, dim = scene.mesh, scene.mesh.geometry.dim
    parts = {"u": ("Lagrange", 2, (dim,)), "p": ("Lagrange", 1, ())}
    dx = ufl.dx(metadata={"quadrature_degree": 4})
    top = moving_top(scene)

    def residual(unknowns, tests):
        (u, p), (v, q) = unknowns, tests
        stress, constraint = neo_hookean(u, unit * p, kappa)
        return [
            ufl.inner(stress, ufl.grad(v)) * dx(mesh),
            constraint / unit * q * dx(mesh),
        ]

    found = hosted(
        way,
        scene,
        parts,
        residual,
        lambda spaces: conditions(spaces[0], scene, top),
        **options,
    )
    found.move = top
    return found


def swelling(way, degree=1, **options):
    """Elastic blocks that swell with what diffuses into them from the bottom, the
    faster the more they are stretched: a third field that contact does not know."""
    scene = blocks()
    mesh, dim = scene.mesh, scene.mesh.geometry.dim
    parts = {"u": ("Lagrange", degree, (dim,)), "c": ("Lagrange", 1, ())}
    dx = ufl.dx(metadata={"quadrature_degree": 4})
    top = moving_top(scene)

    def residual(unknowns, tests):
        (u, c), (v, q) = unknowns, tests
        F = ufl.Identity(dim) + ufl.grad(u)
        J, inverse = ufl.det(F), ufl.inv(F).T
        grown = (1.0 + 0.3 * c) ** dim
        stress = MU * (F - inverse) + 2.0 * MU * ufl.ln(J / grown) * inverse
        flux = (1.0 + ufl.inner(ufl.grad(u), ufl.grad(u))) * ufl.grad(c)
        return [
            ufl.inner(stress, ufl.grad(v)) * dx(mesh),
            (ufl.inner(flux, ufl.grad(q)) + (c + c**3) * q) * dx(mesh),
        ]

    def conditions_of(spaces):
        wet = fem.Constant(mesh, PETSc.ScalarType(0.2))
        bottom = scene.facet_tags.find(scene.tags["bottom"])
        dofs = fem.locate_dofs_topological(spaces[1], dim - 1, bottom)
        return [
            *conditions(spaces[0], scene, top),
            fem.dirichletbc(wet, dofs, spaces[1]),
        ]

    found = hosted(way, scene, parts, residual, conditions_of, **options)
    found.move = top
    return found


LOWER, UPPER = 10, 20  # first tags of the bodies' sides
SIDES = ("bottom", "top", "left", "right", "front", "back")


def meshes(
    cells=("triangle", "triangle"),
    divisions=(4, 3),
    gap=0.0,
    widths=(1.0, 0.6),
    geometry_degrees=(1, 1),
    mapping=None,
    partition=strips,
):
    """The two blocks of `blocks`, each a scene of its own."""
    scenes = []
    for k, first in enumerate((LOWER, UPPER)):
        cell, dim = cells[k], DIMENSION[cells[k]]
        base = k * (1.0 + gap)
        tags = {name: first + i for i, name in enumerate(SIDES[: 2 * dim], 1)}
        block = Block(
            (divisions[k],) * dim,
            (0.0,) * (dim - 1) + (base,),
            (widths[k],) * (dim - 1) + (base + 1.0,),
            mapping=mapping,
            tags=tags,
        )
        mesh, cell_tags, facet_tags = assemble_blocks(
            COMM, [block], cell, geometry_degrees[k], partition=partition
        )
        scenes.append(Scene(mesh, cell_tags, facet_tags, tags))
    return scenes


def apart(
    scenes,
    mixed=False,
    degree=1,
    rollers=False,
    stiffer=None,
    swap=False,
    kind=raymortar.Contact,
    beside=lambda contact: ([], [], [], []),
    **options,
):
    """Blocks on meshes of their own, elastic or nearly incompressible (`mixed`).

    `degree` is that of both displacements, or one of each. On `rollers`, what is
    pressed is free to spread. The upper block, the slave unless it is to `swap`, may be
    some times `stiffer`. `kind` is what the blocks have between them. `beside` gives
    forms, fluxes, conditions and Functions of fields beside the displacement.
    """
    functions, given, F, bcs = [], [], [], []
    top = moving_top(scenes[1])
    degrees = (degree, degree) if isinstance(degree, int) else degree
    for scene, degree in zip(scenes, degrees):
        mesh, dim = scene.mesh, scene.mesh.geometry.dim
        dx = ufl.dx(mesh, metadata={"quadrature_degree": 4})
        if mixed:
            parts = ("Lagrange", 2, (dim,)), ("Lagrange", 1, ())
            w = fem.Function(versions.mixed_space(mesh, *parts))
            (u, p), (v, q) = ufl.split(w), ufl.split(ufl.TestFunction(w.function_space))
            stress, constraint = neo_hookean(u, p, 2000.0 * MU)
            F.append((ufl.inner(stress, ufl.grad(v)) + constraint * q) * dx)
            given.append(w.sub(0))
        else:
            w = u = fem.Function(compat.vector_space(mesh, degree))
            stress = compressible(u)
            v = ufl.TestFunction(w.function_space)
            if stiffer is not None:
                times = stiffer if scene is scenes[1] else 1.0
                stress = fem.Constant(mesh, PETSc.ScalarType(times)) * stress
            F.append(ufl.inner(stress, ufl.grad(v)) * dx)
            given.append(w)
        functions.append(w)
    pairs = [(UPPER + 1, LOWER + 2)[:: -1 if swap else 1]]
    tags = [scene.facet_tags for scene in scenes]
    contact = kind(given, tags, pairs, **options)
    lower, upper = (f.function_space for f in given)
    if rollers:
        last = len(top) - 1
        bcs = [fix(lower, scenes[0], "bottom", last)]
        bcs.append(fix(upper, scenes[1], "top", last, top[last]))
        for V, scene in zip((lower, upper), scenes):
            bcs += [fix(V, scene, SIDES[2 + 2 * i], i) for i in range(last)]
    else:
        for i, value in enumerate(top):
            bcs.append(fix(lower, scenes[0], "bottom", i))
            bcs.append(fix(upper, scenes[1], "top", i, value))
    forms, fluxes, more, fields = beside(contact)
    problem = raymortar.NonlinearProblem(
        F + forms, [contact, *fluxes], bcs + more, u=functions + fields
    )
    return Hosted(scenes, contact, problem, functions, top)


def together(
    mixed=False,
    degree=1,
    cell="triangle",
    divisions=(4, 3),
    kind=raymortar.Contact,
    **options,
):
    """The same blocks on one mesh."""
    scene = blocks(cell, divisions)
    if mixed:
        return taylor_hood("mixed", scene=scene, **options)
    mesh = scene.mesh
    u = fem.Function(compat.vector_space(mesh, degree))
    dx = ufl.dx(mesh, metadata={"quadrature_degree": 4})
    F = ufl.inner(compressible(u), ufl.grad(ufl.TestFunction(u.function_space))) * dx
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = kind(u, scene.facet_tags, pairs, **options)
    top = moving_top(scene)
    bcs = conditions(u.function_space, scene, top)
    return Hosted(scene, contact, raymortar.NonlinearProblem(F, contact, bcs), [u], top)


def compressible(u):
    """Nominal stress of an elastic body."""
    F = ufl.Identity(len(u)) + ufl.grad(u)
    J, inverse = ufl.det(F), ufl.inv(F).T
    return MU * (F - inverse) + 2.0 * MU * ufl.ln(J) * inverse


def tangent_error(found, size, h=1e-4, away=0.0):
    """Remainder of central differences of the residual along a random direction of a
    size, over the tangent's product. Free unknowns only, at the present state, or
    `away` from it by a random vector: a solution with friction lies on kinks."""
    problem = found.problem
    x, b, A = problem.start(), problem.create_vector(), problem.create_matrix()
    fixed = np.zeros(len(x.array), dtype=bool)
    fixed[: found.contact.layout.n] = problem.prescribed
    direction, product = x.copy(), x.copy()
    rng = np.random.default_rng(COMM.rank)
    direction.array[:] = size * rng.uniform(-1.0, 1.0, len(fixed))
    direction.array[fixed] = 0.0
    x.array[:] += away * np.where(fixed, 0.0, rng.uniform(-1.0, 1.0, len(fixed)))
    problem.J(x, A)
    A.mult(direction, product)
    left = -h * product.array
    for side in (1.0, -1.0):
        y = x.copy()
        y.axpy(side * h, direction)
        problem.F(y, b)
        left += 0.5 * side * b.array
    left[fixed] = 0.0
    squares = COMM.allreduce(np.array([left @ left, product.array @ product.array]))
    return np.sqrt(squares[0] / squares[1]) / h


def linear_pressure(cell="quadrilateral"):
    """Displacement and pressure, by a list of linear forms, pressed by a condition."""
    scene = stack(cell, (2, 3))
    V, Q = (
        compat.vector_space(scene.mesh, 2),
        compat.space(scene.mesh, "Lagrange", 1),
    )
    u, p = fem.Function(V), fem.Function(Q)
    v, q = ufl.TestFunction(V), ufl.TestFunction(Q)
    strain = ufl.sym(ufl.grad(u))
    F = [
        2 * ufl.inner(strain, ufl.grad(v)) * ufl.dx + p * ufl.div(v) * ufl.dx,
        q * (ufl.div(u) - 0.1 * p) * ufl.dx,
    ]
    pair = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(u, scene.facet_tags, pair)
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", value=-0.02)]
    return raymortar.NonlinearProblem(F, contact, bcs, u=[u, p])
