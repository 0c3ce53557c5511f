"""What the cases share: bodies by name, laws by name, paths and values at places."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from problems import COMM, Problem, cellwise

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar.core import compat

LAWS = {
    "points": {"condition": "points"},
    "nodes": {"condition": "nodes", "multiplier": "vector"},
    "dual": {"condition": "nodes", "multiplier": "dual"},
}


def law_of(name: str, **options: Any) -> raymortar.AugmentedLagrangian:
    """The augmented Lagrangian of a law: at points, at nodes, or by dual functions."""
    return raymortar.AugmentedLagrangian(**LAWS[name], **options)


def part(
    divisions: Any,
    lower: Any,
    upper: Any,
    sides: dict[str, str] | None = None,
    **more: Any,
) -> dict[str, Any]:
    """Options of a `Block`, with names for its sides: of several parts one may share."""
    return dict(
        divisions=divisions, lower=lower, upper=upper, sides=sides or {}, **more
    )


def scene_of(cell: str, *, geometry_degree: int = 1, **parts: dict[str, Any]) -> Scene:
    """One mesh of bodies that are boxes or lists of glued ones, by name. Collective."""
    tags: dict[str, int] = {}
    blocks = []
    for body, boxes in parts.items():
        for box in boxes if isinstance(boxes, list) else [boxes]:
            options = dict(box)
            sides = options.pop("sides")
            numbers = {
                side: tags.setdefault(name, len(tags) + 1)
                for side, name in sides.items()
            }
            blocks.append(Block(tags=numbers, body=body, **options))
    mesh, cells, facets = assemble_blocks(COMM, blocks, cell, geometry_degree)
    bodies = {body: k for k, body in enumerate(parts, 1)}
    return Scene(mesh, cells, facets, tags, bodies)


def follow(problem: Any, apply: Any, steps: int = 1, **options: Any) -> list[int]:
    """Follow a load path; Newton iterations of each step."""
    inner = problem.problem if isinstance(problem, Problem) else problem
    path = raymortar.LoadSteps(inner.snes_solver, apply, steps=steps, **options)
    return [step.iterations for step in path]


def load_of(problem: Problem, load: Any) -> Any:
    """Function of the load factor that sets the nominal stress of a problem."""
    full = np.asarray(load, dtype=float)

    def apply(factor: float) -> None:
        problem.load.value[:] = factor * full

    return apply


def places(function: Any, scene: Scene | None = None, body: str | None = None) -> Any:
    """Positions of a function's nodes (n, 3), and which of them a body has."""
    V = function.function_space
    x = V.tabulate_dof_coordinates()
    inside = np.ones(len(x), dtype=bool)
    if scene is not None and body is not None:
        dim = scene.mesh.topology.dim
        cells = scene.cell_tags.find(scene.bodies[body])
        inside[:] = False
        inside[fem.locate_dofs_topological(V, dim, cells)] = True
    return x, inside


def at(
    function: Any, point: Any, scene: Scene | None = None, body: str | None = None
) -> Any:
    """Value of a function at its node nearest to a point, of a body where two meet."""
    x, inside = places(function, scene, body)
    target = np.zeros(3)
    target[: len(point)] = point
    apart = np.linalg.norm(x - target, axis=1)
    node = np.flatnonzero(inside)[np.argmin(apart[inside])]
    if apart[node] > 1e-6 * np.ptp(x):
        raise ValueError(f"no node at {point}, the nearest is {x[node]}")
    values = function.x.array.reshape(len(x), -1)[node]
    return values if len(values) > 1 else values[0]


def half_width(contact: raymortar.Contact) -> float:
    """Half width of a line contact about x = 0 by the second moment of Hertz's pressure."""
    points = contact.points(0)
    force = points["pressure"] * points["weight"]
    return 2 * np.sqrt(force @ points["X"][:, 0] ** 2 / force.sum())


def held_at(V: Any, point: Any, component: int, value: Any = 0.0) -> Any:
    """Dirichlet condition of one component at the node at a point."""
    part_of, _ = V.sub(component).collapse()
    target = np.zeros(3)
    target[: len(point)] = point
    size = np.ptp(V.tabulate_dof_coordinates())
    dofs = fem.locate_dofs_geometrical(
        (V.sub(component), part_of),
        lambda x: np.linalg.norm(x.T - target, axis=1) < 1e-9 * size,
    )
    held = fem.Function(part_of)
    held.x.array[:] = value
    return fem.dirichletbc(held, dofs, V.sub(component))


def mean_dilatation(scene: Scene, u: Any, E: Any, nu: float) -> Any:
    """Residual of linear elasticity of hexahedra with the dilatation of each at its
    middle, elements whose volumetric strain is a mean (B-bar), and its derivative.

    In a sum of two rules FFCx 0.5 takes a coefficient of the first for that of the second:
    there it is another Function with the same vector.
    """
    modulus, V = cellwise(scene, E), u.function_space
    mu, bulk = modulus / (2 * (1 + nu)), modulus / (3 * (1 - 2 * nu))
    same, v = fem.Function(V, u.x), ufl.TestFunction(V)
    shear = 2 * mu * ufl.inner(ufl.dev(ufl.sym(ufl.grad(u))), ufl.sym(ufl.grad(v)))
    F = shear * ufl.dx(degree=3)
    F += bulk * ufl.div(same) * ufl.div(v) * ufl.dx(degree=1)
    return F, ufl.derivative(F, u) + ufl.derivative(F, same)


def loaded(scene: Scene, u: Any, name: str) -> Any:
    """Virtual work, to be subtracted, of a dead load on a side, and its traction, a
    vector that is zero at first."""
    traction = fem.Constant(scene.mesh, np.zeros(scene.mesh.geometry.dim))
    ds = ufl.Measure("ds", domain=scene.mesh, subdomain_data=scene.facet_tags)
    v = ufl.TestFunction(u.function_space)
    return ufl.inner(traction, v) * ds(scene.tags[name]), traction


def touching(
    scene: Scene,
    u: Any,
    F: Any,
    method: Any,
    bcs: Any,
    pairs: Any = None,
    J: Any = None,
    **options: Any,
) -> tuple[raymortar.Contact, raymortar.NonlinearProblem]:
    """Contact between sides by name, by default the slave and the master, of a form
    without it, and the problem of both."""
    pairs = [("slave", "master")] if pairs is None else pairs
    contact = raymortar.Contact(
        u, scene.facet_tags, pairs, method, names=scene.tags, **options
    )
    return contact, raymortar.NonlinearProblem(F, contact, bcs, J)


def displacement(scene: Scene, degree: int = 1) -> Any:
    """Displacement of a scene."""
    return fem.Function(compat.vector_space(scene.mesh, degree))
