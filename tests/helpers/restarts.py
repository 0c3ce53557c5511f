"""Problems of a path that stops and goes on: blocks and tools, on any communicator."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import hosts
import interacting
import numpy as np
import ufl
from dolfinx import fem
from problems import fix, residual

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Checkpoint,
    Contact,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    rigid,
    versions,
)
from raymortar.core import compat
from raymortar.io.partitions import strips

STEPS = 4


@dataclass
class Model:
    """A problem, what sets its loads, and a Function that grows with the steps."""

    problem: NonlinearProblem
    apply: Any
    more: list[Any] = field(default_factory=list)

    def __post_init__(self):
        works = {"top": self.problem.bcs[1:]}
        self.history = History(self.problem, patches=True, works=works)
        self.solver = SNESSolver(self.problem)

    def checkpoint(self, path, **options):
        given = {"more": self.more, "history": self.history} | options
        return Checkpoint(self.problem, path, **given)

    def steps(self, begin, end):
        """LoadSteps of the path between two of its steps."""
        span = (begin / STEPS, end / STEPS)
        return LoadSteps(
            self.solver, self.apply, end - begin, path=span, history=self.history
        )

    def follow(self, begin, end):
        """Follow the path between two of its steps."""
        return self.steps(begin, end).run()


def blocks(comm, partition, dim=2, cell="quadrilateral", degree=1, **options):
    """Blocks that are pressed and sheared."""
    scene = two_blocks(comm, dim, cell, 4, 3, upper_size=0.7, partition=partition)
    V = compat.vector_space(scene.mesh, degree)
    u, top = fem.Function(V, name="u"), fem.Constant(scene.mesh, np.zeros(dim))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = Contact(u, scene.facet_tags, pairs, **options)
    problem = NonlinearProblem(residual(scene, u, "neo-hookean")[0], contact, bcs)

    def apply(t):
        top.value[0], top.value[-1] = 0.06 * t, -0.03 * min(2.0 * t, 1.0)

    return Model(problem, apply, [points_of(scene.mesh)])


def held(comm, partition):
    """A block on a held plate. Its slave nodes are led along it in the first half of the
    path, and held there under a growing load in the second: no displacement feels
    friction, and nothing but the accepted step tells it."""
    scene = two_blocks(
        comm, 2, "quadrilateral", 4, 3, upper_size=0.7, partition=partition
    )
    V = compat.vector_space(scene.mesh, 1)
    u, x = fem.Function(V, name="u"), fem.Constant(scene.mesh, 0.0)
    cells = scene.cell_tags.find(scene.bodies["lower"])
    plate = fem.locate_dofs_topological(V, scene.mesh.topology.dim, cells)
    bcs = [fem.dirichletbc(fem.Function(V), plate), fix(V, scene, "slave", 0, x)]
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = Contact(u, scene.facet_tags, pairs, friction=Coulomb(0.3))
    form, _, load = residual(scene, u, loaded=["top"])
    problem = NonlinearProblem(form, contact, bcs)

    def apply(t):
        x.value = 0.06 * min(2.0 * t, 1.0)
        load.value[:] = -4.0 * (1.0 + t) * np.eye(2)

    return Model(problem, apply)


def points_of(mesh):
    """A Function at quadrature points, as a material has them: places."""
    f = fem.Function(versions.quadrature_space(mesh, 2, (mesh.geometry.dim,)))
    x = versions.AtQuadraturePoints(ufl.SpatialCoordinate(mesh), mesh, 2)
    versions.set_at_quadrature_points(f, x())
    return f


def wheel(comm, partition):
    """A block under a circle that a force presses down while it is turned."""
    scene = two_blocks(
        comm, 2, "triangle", 6, 1, upper_size=0.3, gap=4.0, partition=partition
    )
    V = compat.vector_space(scene.mesh, 1)
    u = fem.Function(V, name="u")
    bcs = [fix(V, scene, name) for name in ("bottom", "top")]
    circle = rigid.Circle((0.5, 1.31), 0.3)
    body = rigid.Body(circle, name="wheel", free=("x", "y"), force=(0.0, 0.0))
    contact = Contact(
        u,
        scene.facet_tags,
        [(scene.tags["master"], body)],
        AugmentedLagrangian(),
        friction=Coulomb(0.5),
    )
    problem = NonlinearProblem(residual(scene, u)[0], contact, bcs)

    def apply(t):
        body.force = (0.0, -40.0 * min(2.0 * t, 1.0))
        body.move(rotation=0.2 * t)

    return Model(problem, apply)


def stacked(comm, partition):
    """Three blocks with two contacts of different laws."""
    stack = interacting.three()
    contacts = [
        stack.contact(pair, **law)
        for pair, law in zip((interacting.LOWER, interacting.UPPER), interacting.LAWS)
    ]
    return Model(stack.problem(contacts), stack.move)


def pushed(found):
    def apply(t):
        found.push(0.03 * t, -0.06 * min(2.0 * t, 1.0))

    return Model(found.problem, apply)


CASES = {
    "springs": lambda *of: blocks(
        *of, method=Penalty(1e5), friction=Coulomb(0.3), measure="current"
    ),
    "triangles of degree 2": lambda *of: blocks(
        *of, cell="triangle", degree=2, friction=Coulomb(0.3)
    ),
    "hexahedra": lambda *of: blocks(
        *of, dim=3, cell="hexahedron", friction=Coulomb(0.3)
    ),
    "elastic slip at points": lambda *of: blocks(
        *of,
        cell="triangle",
        degree=2,
        method=AugmentedLagrangian(condition="points"),
        friction=Coulomb(0.3, elastic_slip=0.01),
    ),
    "elastic slip at nodes": lambda *of: blocks(
        *of,
        dim=3,
        cell="hexahedron",
        method=AugmentedLagrangian(condition="nodes"),
        friction=Coulomb(0.3, elastic_slip=0.01),
    ),
    "held along the surface": held,
    "wheel": wheel,
}
# On all ranks alone
FIXED = {
    "two contacts": stacked,
    "meshes": lambda *_: pushed(
        hosts.apart(hosts.meshes(), degree=2, friction=Coulomb(0.3))
    ),
    "mixed": lambda *_: pushed(hosts.taylor_hood("mixed", friction=Coulomb(0.3))),
    "blocked": lambda *_: pushed(hosts.taylor_hood("blocked", method=Penalty(200.0))),
}


def model(name, comm, partition=strips):
    return {**CASES, **FIXED}[name](comm, partition)
