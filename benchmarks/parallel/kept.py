"""Paths of linear bodies, with factors that are kept and with MUMPS at each iteration.

    scripts/python benchmarks/parallel/kept.py [--sizes 0,1,2] [--cases hertz,...]

Writes `kept.csv`: Newton iterations, CPU seconds of the path, assembly included, and
what memory grew by meanwhile; each row from a process of its own, on one rank.

- hertz: two spheres pressed together in 10 steps
- cattaneo-mindlin: the same with friction, pressed in 3 steps and sheared in 8
- cone: a rigid cone pressed into a block in 10 steps, the wedge of 3D
- ironing: a stiff half pipe pressed into a slab and dragged along it, with friction
"""

from __future__ import annotations

import resource
import time
from types import SimpleNamespace

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from rows import run

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_spheres
from raymortar import Coulomb, rigid, solvers, tools

COMM = MPI.COMM_WORLD
NU = 0.3
LINEAR = {"mumps": solvers.direct, "kept": solvers.kept_factors, "auto": dict}
COLUMNS = "case", "unknowns", "linear", "steps", "newton", "seconds", "megabytes"


def linear_form(u, E):
    """Residual of linear elasticity."""
    v = ufl.TestFunction(u.function_space)
    strain = ufl.sym(ufl.grad(u))
    mu, lmbda = E / (2 + 2 * NU), E * NU / ((1 + NU) * (1 - 2 * NU))
    stress = 2 * mu * strain + lmbda * ufl.tr(strain) * ufl.Identity(3)
    return ufl.inner(stress, ufl.grad(v)) * ufl.dx(metadata={"quadrature_degree": 2})


def spheres(facets, friction=None):
    """Half spheres of radius 50, one quarter (frictionless) or a half of them."""
    scene = two_spheres(
        COMM,
        "hexahedron",
        radius=50.0,
        contact_half_width=10.0,
        facets_across=facets,
    )
    V = tools.vector_space(scene.mesh, 1)
    u = fem.Function(V)
    top, bottom, along = (fem.Constant(scene.mesh, 0.0) for _ in range(3))
    bcs = [
        tools.prescribe(V, scene.find("symmetry_y"), component=1),
        tools.prescribe(V, scene.find("top"), top, 2),
        tools.prescribe(V, scene.find("bottom"), bottom, 2),
    ]
    if friction is None:
        bcs.append(tools.prescribe(V, scene.find("symmetry_x"), component=0))
    else:  # sheared as one: the plane x = 0 is no symmetry then, but a cut
        bcs.append(tools.prescribe(V, scene.find("top"), along, 0))
        bcs.append(tools.prescribe(V, scene.find("bottom"), component=0))
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = raymortar.Contact(u, scene.facet_tags, [pair], friction=friction)
    problem = raymortar.NonlinearProblem(linear_form(u, 20e3), contact, bcs)
    return SimpleNamespace(problem=problem, top=top, bottom=bottom, along=along)


def hertz(facets):
    """Problem, what applies a load factor, and steps."""
    one = spheres(facets)

    def apply(factor):
        one.top.value, one.bottom.value = -2.0 * factor**2, 2.0 * factor**2

    return one.problem, [(apply, 10)]


def cattaneo_mindlin(facets):
    """Pressed, then sheared by less than friction can carry."""
    one = spheres(facets, Coulomb(0.3))

    def press(factor):
        one.top.value, one.bottom.value = -1.0 * factor**2, 1.0 * factor**2

    def shear(factor):
        one.along.value = 0.3 * factor

    return one.problem, [(press, 3), (shear, 8)]


def cone(n):
    """A cone pressed into the middle of a block."""
    block = Block(
        (2 * n, 2 * n, n),
        (-1.0, -1.0, -1.0),
        (1.0, 1.0, 0.0),
        tags={"bottom": 1, "top": 2},
    )
    mesh, cells, facets = assemble_blocks(COMM, [block], "hexahedron")
    scene = Scene(mesh, cells, facets, {"bottom": 1, "top": 2}, {"block": 1})
    V = tools.vector_space(mesh, 1)
    u = fem.Function(V)
    body = rigid.Body(rigid.Cone((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.3), name="cone")
    contact = raymortar.Contact(u, facets, [(2, body)])
    bcs = [tools.prescribe(V, scene.find("bottom"))]
    problem = raymortar.NonlinearProblem(linear_form(u, 1.0), contact, bcs)

    def apply(factor):
        body.move(translation=(0.0, 0.0, -0.12 * factor))

    return problem, [(apply, 10)]


def ironing(n, form=linear_form):
    """A stiff half pipe, pressed by a fiftieth of the slab's height and dragged along
    a third of its length. `form`: residual of displacement and modulus."""
    radius, start, height = 3.0, 3.0, 3.0

    def bent(x):
        r = radius - x[:, 2]
        along, up = start + r * np.sin(x[:, 0]), radius - r * np.cos(x[:, 0])
        return np.column_stack([along, x[:, 1], height + up])

    tags = {"bottom": 1, "slave": 2, "master": 3, "symmetry": 4, "grips": 5}
    slab = Block(
        (9 * n // 2, n, 3 * n // 2),
        (0.0, 0.0, 0.0),
        (9.0, 2.0, height),
        tags={"bottom": 1, "top": 2, "front": 4},
    )
    die = Block(
        (6 * n, n + 1, 1),
        (-0.5 * np.pi, 0.0, 0.0),
        (0.5 * np.pi, 2.6, 0.2),
        mapping=bent,
        tags={"bottom": 3, "front": 4, "left": 5, "right": 5},
    )
    mesh, cells, facets = assemble_blocks(COMM, [slab, die], "hexahedron")
    scene = Scene(mesh, cells, facets, tags, {"slab": 1, "die": 2})
    V = tools.vector_space(mesh, 1)
    u = fem.Function(V)
    E = tools.by_body(mesh, cells, {"slab": 1.0, "die": 1000.0}, scene.bodies)
    down, along = (fem.Constant(mesh, 0.0) for _ in range(2))
    bcs = [
        tools.prescribe(V, scene.find("bottom")),
        tools.prescribe(V, scene.find("symmetry"), component=1),
        tools.prescribe(V, scene.find("grips"), along, 0),
        tools.prescribe(V, scene.find("grips"), down, 2),
    ]
    contact = raymortar.Contact(
        u,
        facets,
        [(2, 3)],
        friction=Coulomb(0.3),
        search=raymortar.Search(reach=0.5, depth=0.5),
    )
    problem = raymortar.NonlinearProblem(form(u, E), contact, bcs)

    def press(factor):
        down.value = -0.2 * factor

    def slide(factor):
        along.value = 2.0 * factor

    return problem, [(press, 4), (slide, 10)]


# Problem, and its sizes for about 3,000, 10,000 and 30,000 unknowns
CASES = {
    "hertz": (hertz, (7, 11, 18)),
    "cattaneo-mindlin": (cattaneo_mindlin, (7, 11, 18)),
    "cone": (cone, (6, 9, 13)),
    "ironing": (ironing, (4, 7, 11)),
}


def steps_of(solver, parts):
    """Run all parts of a path, and return its steps."""
    runs = (raymortar.LoadSteps(solver, *part).run() for part in parts)
    return [step for steps in runs for step in steps]


def measure(case, size, linear):
    """One row."""
    make, sizes = CASES[case]
    problem, parts = make(sizes[size])
    solver = raymortar.SNESSolver(problem, LINEAR[linear]())
    before, start = peak_megabytes(), time.process_time()
    path = steps_of(solver, parts)
    seconds = time.process_time() - start
    values = (
        *(case, problem.contact.layout.size_global, linear, len(path)),
        sum(step.iterations for step in path),
        round(seconds, 2),
        round(peak_megabytes() - before),
    )
    return dict(zip(COLUMNS, values, strict=True))


def peak_megabytes():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    run(__file__, __doc__, COLUMNS, measure, CASES, "mumps,kept")
