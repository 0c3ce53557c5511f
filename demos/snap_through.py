"""Snap-through: a punch presses a shallow arch through, by a force that falls (2D).

The arch is clamped, the punch free but for the plane of symmetry and for contact, from
a gap on. Its force rises until the arch gives way, falls below zero's neighbourhood
while it snaps, and rises again when the arch hangs. Steps of the force cannot follow
that; steps of the displacement of the punch (`DisplacementControl`) and of the arc
length (`ArcLength`) do, with the force as an unknown.
"""

import sys
from types import SimpleNamespace

import bodies
import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

from mpi4py import MPI

import raymortar
from raymortar import compat
from raymortar.blocks import Block
from raymortar.meshing import Scene, assemble_blocks

# Lengths in mm, moduli in MPa, forces in N per mm of thickness; half of the arch
SPAN, RISE, THICKNESS = 10.0, 0.75, 0.4
WIDTH, HEIGHT, RADIUS, GAP = 1.2, 1.0, 4.0, 0.1
E_ARCH, E_PUNCH, NU = 1000.0, 1e5, 0.3
PUSH, FORCE = 2.0, 0.3
TAGS = {"clamped": 1, "master": 2, "slave": 3, "axis": 4, "top": 5}


def scene_of(comm, size):
    """Arch of `size` cells along its half, and the punch above it. Collective."""

    def arch(x):
        share, s = x[:, 0] / SPAN, np.pi * x[:, 0] / SPAN
        y = 0.5 * RISE * (1.0 + np.cos(s)) + x[:, 1]
        return np.column_stack([SPAN * share, y])

    def punch(x):
        low = RISE + THICKNESS + GAP + x[:, 0] ** 2 / (2.0 * RADIUS)
        share = x[:, 1]
        y = (1.0 - share) * low + share * (RISE + THICKNESS + GAP + HEIGHT)
        return np.column_stack([x[:, 0], y])

    below = {"left": TAGS["axis"], "right": TAGS["clamped"], "top": TAGS["slave"]}
    above = {"left": TAGS["axis"], "bottom": TAGS["master"], "top": TAGS["top"]}
    blocks = [
        Block((size, 2), (0.0, 0.0), (SPAN, THICKNESS), mapping=arch, tags=below),
        Block((4, 4), (0.0, 0.0), (WIDTH, 1.0), mapping=punch, tags=above),
    ]
    mesh, cells, facets = assemble_blocks(comm, blocks, "triangle", 2)
    return Scene(mesh, cells, facets, TAGS, {"arch": 1, "punch": 2})


def force_at(node, u):
    """UFL form of a unit force along the last axis at a node, and that force.

    Node: (d,). Quadrature at the vertices makes the load of a field that is not zero at
    one vertex only a force there.
    """
    V = compat.scalar_space(u.function_space.mesh, 1)
    field, scale = fem.Function(V), fem.Constant(V.mesh, 0.0)
    x = V.tabulate_dof_coordinates()[:, : len(u)]
    field.x.array[:] = np.linalg.norm(x - node, axis=1) < 1e-9
    vertices = ufl.dx(
        metadata={"quadrature_rule": "vertex", "quadrature_degree": 1}, domain=V.mesh
    )
    area = common.integral(field * vertices, V.mesh)
    v = ufl.TestFunction(u.function_space)
    return scale / area * field * v[len(u) - 1] * vertices, scale


class Arch:
    """The mechanical problem; `apply` sets the force of the load factor t.

    Parameters
    ----------
    size
        Cells along half of the arch.
    prescribed
        The displacement of the loaded node is prescribed in place of the force there:
        t times `PUSH`.
    spring
        Stiffness of a spring that holds the punch. Force per length (and area).
    """

    def __init__(
        self, comm, size=20, prescribed=False, spring=0.0, method=None, friction=None,
        solver=raymortar.SNESSolver,
    ):  # fmt: skip
        scene = self.scene = scene_of(comm, size)
        V = compat.vector_space(scene.mesh, 2)
        self.u = u = fem.Function(V, name="displacement")
        E = bodies.by_body(scene, {"arch": E_ARCH, "punch": E_PUNCH})
        self.material = bodies.NeoHookean(E, NU)
        form = self.material.residual(u, 4)
        self.node = np.array([0.0, RISE + THICKNESS + GAP + HEIGHT])
        load, self.force = force_at(self.node, u)
        form += load
        if spring:
            k = bodies.by_body(scene, {"arch": 0.0, "punch": spring})
            form += k * u[1] * ufl.TestFunction(V)[1] * ufl.dx
        bcs = [*bodies.hold(V, scene, ["clamped"]), common.clamp(V, scene, "axis", 0)]
        self.down, self.prescribed = fem.Constant(scene.mesh, 0.0), prescribed
        if prescribed:
            W, _ = V.sub(1).collapse()
            at = fem.locate_dofs_geometrical(
                (V.sub(1), W), lambda x: np.linalg.norm(x.T[:, :2] - self.node, axis=1) < 1e-9
            )
            bcs.append(fem.dirichletbc(self.down, at[0], V.sub(1)))
        self.contact = raymortar.Contact(
            u,
            scene.facet_tags,
            [(TAGS["slave"], TAGS["master"])],
            method,
            friction=friction,
        )
        self.problem = raymortar.NonlinearProblem(form, self.contact, bcs)
        self.support = bcs[-1] if prescribed else None
        self.solver = solver(self.problem)

    def apply(self, t):
        """The load factor: force, or displacement where that is prescribed."""
        if self.prescribed:
            self.down.value = -PUSH * t
        else:
            self.force.value = FORCE * t
