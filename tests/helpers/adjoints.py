"""Scenes whose parameters may be changed, for derivatives by them and differences."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import boxes
import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import COMM, fix
from scipy.spatial.transform import Rotation

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    NonlinearProblem,
    Penalty,
    adjoint,
    rigid,
)
from raymortar.core import compat

NU, GAMMA = 0.3, 60.0
TIGHT = {"snes_rtol": 1e-14, "snes_atol": 1e-12, "snes_stol": 0.0, "snes_max_it": 60}
METHODS = {
    "points": AugmentedLagrangian(GAMMA),
    "vector": AugmentedLagrangian(GAMMA, multiplier="vector"),
    "nodes": AugmentedLagrangian(GAMMA, condition="nodes"),
    "dual": AugmentedLagrangian(GAMMA, condition="nodes", multiplier="dual"),
    "penalty": Penalty(GAMMA),
    "rate": Penalty(GAMMA, tangential="rate"),
}
# Centre of rigid tools, about which they turn
CENTRE = np.array([0.2, 0.6, 1.3])


@dataclass
class Parameters:
    """Numbers by which a scene is scaled, and what it is differentiated by."""

    modulus: float = 0.0  # times a field
    load: float = 0.0
    offset: float = 0.0  # times a field
    friction: float = 0.0
    gamma: float = 0.0
    radius: float = 0.0
    place: Any = (0.0, 0.0, 0.0)
    turn: Any = (0.0, 0.0, 0.0)  # in 2D the last one
    shape: float = 0.0  # times a field of displacements of the mesh

    def changed(self, name, by):
        """The same with another number."""
        given = {**self.__dict__}
        given[name] = np.add(given[name], by)
        return Parameters(**given)

    def method(self, name):
        """A method with gamma."""
        return replace(METHODS[name], gamma=GAMMA + self.gamma)

    def turned(self, x, centre):
        """A point after the turn about a centre."""
        return Rotation.from_rotvec(self.turn).apply(x - centre) + centre


def stiffness_field(x):
    """Field of relative changes of the modulus."""
    return 1.0 + 0.5 * np.sin(3.0 * x[0]) * x[1]


def offset_field(x):
    """Field of offsets. Length."""
    return 1.0 + 0.4 * np.cos(4.0 * x[0])


def shape_field(x):
    """Displacements of the mesh's nodes, (3, n) to (d, n)."""
    return np.array(
        [
            np.sin(2.0 * x[0]) * (0.3 + x[1]) + 0.2 * x[1] ** 2,
            np.cos(1.5 * x[0]) * x[1] + 0.1 * x[0],
            0.3 * np.sin(x[0] + x[1]) * (1.0 + x[2]),
        ]
    )


@dataclass
class Scene:
    """A problem with its controls."""

    problem: Any
    contact: Any
    u: Any
    E: Any
    load: Any
    motion: Any
    body: Any = None
    moved: Any = None  # the field of shape_field, in the space of coordinates
    keep: list = field(default_factory=list)

    def solve(self, *path):
        """Solve the steps of a path of motions, of which the last is not accepted."""
        for k, motion in enumerate(path):
            if k:
                self.contact.advance()
            if self.body is None:
                self.motion.value[:] = motion
            else:
                self.body.move(motion)
            self.problem.solve()

    @property
    def functional(self):
        """Of the displacement, the modulus and the load."""
        x = ufl.SpatialCoordinate(self.u.function_space.mesh)
        dx = ufl.dx(metadata={"quadrature_degree": 4})
        return (
            ufl.inner(self.u, self.u) * (1 + x[0]) + self.E * self.u[0] ** 2
        ) * dx + self.u[1] * dx

    def directions(self):
        """By parameter: the control, and the direction of its change."""
        found = {
            "modulus": (self.E, stiffness_field),
            "load": (self.load, np.eye(len(self.load.value))[-1]),
            "offset": (adjoint.offset(self.contact), offset_field),
            "shape": (adjoint.coordinates(self.u.function_space.mesh), self.moved),
        }
        if self.contact.friction is not None:
            found["friction"] = adjoint.friction(self.contact), 1.0
        if self.contact.multiplier is None:
            found["gamma"] = adjoint.gamma(self.contact), 1.0
        if self.body is not None:
            found["radius"] = adjoint.radius(self.body), 1.0
            found["place"] = found["turn"] = adjoint.place(self.body), None
        return found


def along(gradient, direction):
    """Derivative along a direction, from that by all dofs or components."""
    if not isinstance(gradient, fem.Function):
        return float(np.sum(np.asarray(gradient) * direction))
    V = gradient.function_space
    d = fem.Function(V)
    if isinstance(direction, fem.Function):
        d.x.array[:] = direction.x.array
    else:
        d.interpolate(direction)
    own = V.dofmap.index_map.size_local * V.dofmap.index_map_bs
    return V.mesh.comm.allreduce(float(gradient.x.array[:own] @ d.x.array[:own]))


def move_nodes(mesh, by):
    """Move the nodes of a mesh along `shape_field`; return this as a Function."""
    V = compat.vector_space(mesh, compat.geometry_degree(mesh))
    field = fem.Function(V)
    dim = mesh.geometry.dim
    field.interpolate(lambda x: shape_field(x)[:dim])
    mesh.geometry.x[:, :dim] += by * shape_field(mesh.geometry.x.T)[:dim].T
    return field


def law(mu, p):
    """Law of friction of a coefficient; one that is given, or none, stays."""
    return raymortar.Coulomb(mu + p.friction) if isinstance(mu, float) else mu


def blocks(
    cell="triangle", method="points", mu=None, p=None, n=(5, 4), degree=1, comm=COMM,
    **more,
):  # fmt: skip
    """A narrow block with a round bottom that is pressed on another."""
    p = p or Parameters()
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    scene = two_blocks(
        comm, dim, cell, n[0], n[1], lower_size=(1.4, 1.0, 0.6)[: dim - 1] + (0.7,),
        upper_size=(0.9, 0.8, 0.6)[: dim - 1] + (0.6,), perturb=0.1,
    )  # fmt: skip
    mesh = scene.mesh
    # Round: the offset is a clearance towards both ends. Its nodal values stay where
    # nodes are moved
    offset = fem.Function(compat.scalar_space(mesh, degree))
    offset.interpolate(lambda x: 0.06 * (x[0] - 0.72) ** 2 + p.offset * offset_field(x))
    moved = move_nodes(mesh, p.shape)
    V = compat.vector_space(mesh, degree)
    u = fem.Function(V)
    friction = law(mu, p)
    more.setdefault("quadrature_degree", 4)
    contact = Contact(
        u, scene.facet_tags, [(3, 4)], p.method(method), friction,
        offset=offset, **more,
    )  # fmt: skip
    E, load, residual = elastic(V, u, p)
    motion = fem.Constant(mesh, np.zeros(dim))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", value=motion)]
    problem = NonlinearProblem(residual, contact, bcs, petsc_options=TIGHT)
    return Scene(problem, contact, u, E, load, motion, moved=moved)


def elastic(V, u, p):
    """Modulus, load and residual of a block."""
    mesh = V.mesh
    dim = mesh.geometry.dim
    E = fem.Function(compat.space(mesh, "DG", 0), name="modulus")
    E.interpolate(lambda x: 40.0 + p.modulus * stiffness_field(x))
    load = fem.Constant(mesh, np.array([0.3, -1.0 + p.load]) if dim == 2 else
                        np.array([0.3, 0.1, -1.0 + p.load]))  # fmt: skip
    dx = ufl.dx(metadata={"quadrature_degree": 2 * compat.element_info(V).degree})
    v = ufl.TestFunction(V)
    P = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(E, NU))
    return E, load, (ufl.inner(P, ufl.grad(v)) - ufl.inner(load, v)) * dx


def tool(cell="triangle", method="points", mu=None, p=None, n=5, shape=None, degree=1,
         clearance=0.005, comm=COMM, **more):  # fmt: skip
    """A block below a round tool that is led."""
    p = p or Parameters()
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    mesh = boxes.box(cell, n, comm=comm)
    tags = boxes.tag_sides(mesh, (dim - 1, 1.0), (dim - 1, 0.0))
    moved = move_nodes(mesh, p.shape)
    V = compat.vector_space(mesh, degree)
    u = fem.Function(V)
    centre = CENTRE[[0, 2, 2]] if dim == 2 else CENTRE
    start = np.array([0.44, 1.5, 1.3]) if dim == 2 else np.array([0.44, 0.47, 1.5])
    at, radius = p.turned(start, centre) + p.place, 0.5 + p.radius
    axis = np.array([1.0, 0.2, 0.05])
    if dim == 2:
        made = rigid.Circle(at[:2], radius)
    elif shape == "cylinder":
        made = rigid.Cylinder(at, p.turned(axis, 0.0), radius)
    else:
        made = rigid.Sphere(at, radius)
    body = rigid.Body(made, centre=(centre + p.place)[:dim])
    friction = law(mu, p)
    contact = Contact(
        u, tags, [(1, body)], p.method(method), friction,
        offset=lambda x: clearance + p.offset * offset_field(x), **more,
    )  # fmt: skip
    E, load, residual = elastic(V, u, p)
    held = fem.locate_dofs_topological(V, dim - 1, tags.find(2))
    base = fem.Constant(mesh, np.zeros(dim))
    bcs = [fem.dirichletbc(base, held, V)]
    problem = NonlinearProblem(residual, contact, bcs, petsc_options=TIGHT)
    return Scene(problem, contact, u, E, load, base, body, moved)
