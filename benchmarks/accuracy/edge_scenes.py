"""Contact without friction that ends somewhere, with known answers: Hertz, punches.

Each scene is solved by a law at points, at nodes, or at nodes with dual multipliers.
"""

from __future__ import annotations

import dataclasses
import time
from functools import partial
from types import SimpleNamespace
from typing import Any
from unittest import mock

from mpi4py import MPI

import bodies
import numpy as np
import revolution
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block, mirrored
from meshes.graded import PoleGrid, box_blocks
from meshes.hertz import cylinder_on_block, sphere_on_plane
from meshes.meshing import Scene, assemble_blocks
from raymortar import AugmentedLagrangian, rigid, tools

COMM = MPI.COMM_SELF
METHODS = {
    "points": {},
    "nodes": {"condition": "nodes"},
    "dual": {"condition": "nodes", "multiplier": "dual"},
}
NU = 0.3


class Watch:
    """CPU and wall seconds from where the first problem has been made.

    Meshes, forms and the first contact are set up before.
    """

    def __enter__(self):
        made, self.start = raymortar.NonlinearProblem.__init__, None

        def timed(*args, **options):
            made(*args, **options)
            if self.start is None:
                self.start = time.process_time(), time.perf_counter()

        self._patch = mock.patch.object(raymortar.NonlinearProblem, "__init__", timed)
        self._patch.start()
        return self

    def __exit__(self, *_):
        self.seconds = time.process_time() - self.start[0]
        self.wall = time.perf_counter() - self.start[1]
        self._patch.stop()


# Elastic bodies that are pressed together


@dataclasses.dataclass
class Pressed:
    """Linear elastic bodies, one of which is led onto the other or onto a tool.

    Parameters
    ----------
    scene
        Mesh and tags.
    moduli
        Young's modulus by body.
    slave, master
        Names of the facets; the master may be a rigid body, which is led by -push.
    held
        (tag's name, component), None: all.
    led
        (tag's name, component) or the name of a body, which moves down by `push`.
    push
        Length.
    shape
        Pressure over the undeformed x of a unit force, and the distance from the middle
        up to which it is compared, in the contact's half-widths.
    exact
        Of the force that was found: half-width and peak.
    symmetric
        Force of the whole over that of the scene.
    """

    scene: Any
    moduli: dict
    slave: str
    master: Any
    held: tuple
    led: Any
    push: float
    exact: Any
    symmetric: int
    steps: int = 4
    shape: Any = None
    within: float = 2.0
    # For GetFEM: `shape` in its language, coefficient, longest ray, force to converge to
    formula: str = "sqrt(max(0,1-sqr({s})))"
    gamma: float = 0.0
    release: float = 0.0
    tolerance: float = 0.0

    @property
    def dim(self):
        return self.scene.mesh.geometry.dim


def ellipse(s):
    """Hertz's pressure over the peak, at a distance over the half-width."""
    return ufl.sqrt(ufl.max_value(0.0, 1.0 - s**2))


def solve_pressed(case: Pressed, degree, law):
    """Contact, what finds its error of the pressure, Newton iterations."""
    scene, dim = case.scene, case.dim
    V = tools.vector_space(scene.mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    E = tools.by_body(scene.mesh, scene.cell_tags, case.moduli, scene.bodies)
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    form = ufl.inner(bodies.hooke(u, E, NU), bodies.small_strain(v)) * dx
    bcs = [tools.prescribe(V, scene.find(name), component=i) for name, i in case.held]
    tool = isinstance(case.master, rigid.Body)
    if isinstance(case.led, tuple):
        way, (name, component) = fem.Constant(scene.mesh, 0.0), case.led
        bcs.append(tools.prescribe(V, scene.find(name), way, component))
    elif not tool:
        way = fem.Constant(scene.mesh, np.zeros(dim))
        cells = scene.cell_tags.find(scene.bodies[case.led])
        dofs = fem.locate_dofs_topological(V, dim, cells)
        bcs.append(fem.dirichletbc(way, dofs, V))
    master = case.master if tool else scene.tags[case.master]
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(scene.tags[case.slave], master)],
        AugmentedLagrangian(**METHODS[law]),
    )
    problem = raymortar.NonlinearProblem(form, contact, bcs)

    def press(t):
        # The square, so that the contact grows evenly from step to step
        down = -case.push * t**2
        if tool:
            case.master.move((0.0,) * (dim - 1) + (down,))
        elif np.ndim(way.value):
            way.value[-1] = down
        else:
            way.value = down

    # No predictor, as GetFEM has none
    solver, plain = raymortar.SNESSolver(problem), {"extrapolate": False}
    path = raymortar.LoadSteps(solver, press, case.steps, **plain).run()
    iterations = sum(step.iterations for step in path)
    return contact, partial(pressure_error, case, contact), iterations


def pressure_error(case, contact):
    """Of the pressure in L2, relative."""
    mesh, lam = case.scene.mesh, contact.multiplier
    up = contact.resultant(0).force[case.dim - 1]
    a, p0 = case.exact(case.symmetric * abs(up))
    p = np.sign(up) * lam[len(lam) - 1] if lam.ufl_shape else -lam
    x = ufl.SpatialCoordinate(mesh)
    r = ufl.sqrt(sum(x[i] ** 2 for i in range(case.dim - 1)))
    # Constants: a number would be compiled into the form
    s = r / fem.Constant(mesh, a)
    exact = fem.Constant(mesh, p0) * (case.shape or ellipse)(s)
    counts = ufl.conditional(ufl.lt(s, case.within), 1.0, 0.0)
    rule = {"quadrature_degree": 12}
    ds = ufl.Measure("ds", mesh, subdomain_data=case.scene.facet_tags, metadata=rule)
    ds = ds(case.scene.tags[case.slave])
    error = tools.integral(counts * (p - exact) ** 2 * ds, mesh)
    return np.sqrt(error / tools.integral(counts * exact**2 * ds, mesh))


# Steel on aluminium. Lengths in mm, stresses in MPa
E_ROUND, E_FLAT, RADIUS = 210e3, 70e3, 10.0
# By dimension. Bodies depart from Hertz's half-spaces in proportion to it
HALF_WIDTHS = {2: 0.1, 3: 0.4}
E_STAR = 1.0 / ((1.0 - NU**2) * (1.0 / E_ROUND + 1.0 / E_FLAT))
ROLES = {
    "round slave": ("slave", "master", 0.8),
    "flat slave": ("master", "slave", 1.25),
}


def hertz(dim, n, degree, role):
    """A cylinder or a ball on a block; facets across the contact, the slave's coarser."""
    slave, master, ratio = ROLES[role]
    half_width = HALF_WIDTHS[dim]
    make = cylinder_on_block if dim == 2 else sphere_on_plane
    scene = make(
        COMM,
        geometry_degree=degree,
        radius=RADIUS,
        block_size=(60.0,) * (dim - 1) + (30.0,),
        contact_half_width=half_width,
        # Of the ball's surface
        facets_across=n if role == "round slave" else round(n * ratio),
        master_ratio=ratio,
        growth=1.2 if dim == 2 else 1.4,
    )
    held = [("bottom", i) for i in range(dim)] + [("symmetry_x", 0)]
    held += [("symmetry_y", 1)] if dim == 3 else []

    def exact(force):
        if dim == 2:
            a = np.sqrt(4.0 * force * RADIUS / (np.pi * E_STAR))
            return a, 2.0 * force / (np.pi * a)
        a = np.cbrt(0.75 * force * RADIUS / E_STAR)
        return a, 1.5 * force / (np.pi * a**2)

    if dim == 2:
        force = np.pi * E_STAR * half_width**2 / (4.0 * RADIUS)
        round_ = (2.0 * np.log(4.0 * RADIUS / half_width) - 1.0) / E_ROUND
        flat = (2.0 * np.log(60.0 / half_width) - NU / (1.0 - NU)) / E_FLAT
        push = force * (1.0 - NU**2) / np.pi * (round_ + flat)
    else:
        push = half_width**2 / RADIUS
    moduli = {"upper": E_ROUND, "lower": E_FLAT}
    return Pressed(
        scene, moduli, slave, master, tuple(held), ("top", dim - 1), push, exact,
        2 * (dim - 1), gamma=E_FLAT * n / (2.0 * half_width), release=0.5 * RADIUS,
        tolerance=1e-10 * E_FLAT * half_width ** (dim - 1),
    )  # fmt: skip


def half_space(dim, a, facets, extra=(), body="lower"):
    """Half of a half plane, or a quarter of a half-space, and more blocks."""
    tags = {"slave": 1, "bottom": 2, "symmetry_x": 3, "symmetry_y": 4, "side": 5}
    tags |= {"master": 6}
    grid = PoleGrid(a, a / facets, 1.3)
    names = {"surface": "slave", "left": "symmetry_x", "front": "symmetry_y"}
    names |= {"far": "bottom", "side": "side"}
    sides = {place: tags[name] for place, name in names.items()}
    blocks = box_blocks(
        (400.0 * a if dim == 2 else 100.0 * a,) * dim, grid, sides, body
    )
    blocks = [mirrored(block, dim - 1) for block in blocks] + list(extra)
    cell = "quadrilateral" if dim == 2 else "hexahedron"
    made = assemble_blocks(COMM, blocks, cell, 1)
    return Scene(*made, tags, {b: k for k, b in enumerate(_labels(blocks), 1)})


def _labels(blocks):
    """Bodies in the order of their tags."""
    return list(dict.fromkeys(block.body for block in blocks))


HELD = tuple((name, i) for name in ("bottom", "side") for i in (0, 1))


def punch(n, degree, role=""):
    """A rigid flat punch on a half plane: facets over half of its width."""
    facets = max(1, round(0.8 * n))
    block = Block(
        (facets, 1), (0.0, 0.0), (1.0, 0.25), tags={"bottom": 6}, body="upper"
    )
    scene = half_space(2, 1.0, n, (block,))
    held = (*HELD, ("symmetry_x", 0))
    # Of the singular pressure the part that is not next to the rim
    return Pressed(
        scene, {"upper": 1000.0, "lower": 1000.0}, "slave", "master", held, "upper",
        1e-3, lambda force: (1.0, force / np.pi), 2, 1,
        lambda s: 1.0 / ufl.sqrt(ufl.max_value(1.0 - s**2, 0.01)), 0.8,
        formula="(1/sqrt(max(0.01,1-sqr({s}))))", gamma=1000.0 * n, release=0.2,
        tolerance=1e-7 * 1e-3,
    )  # fmt: skip


# A rigid ball of radius 1 on a half-space: radius of the contact, depth
BALL = SimpleNamespace(E=1000.0, a=0.01, depth=1e-4)


def ball_in_space(n, degree, role=""):
    """A quarter: facets over the contact's radius."""
    scene = half_space(3, BALL.a, n)
    held = tuple((name, i) for name in ("bottom", "side") for i in range(3))
    held += (("symmetry_x", 0), ("symmetry_y", 1))
    tool = rigid.Body(rigid.Sphere((0.0, 0.0, 1.0), 1.0))
    e_star = BALL.E / (1.0 - NU**2)

    def exact(force):
        a = np.cbrt(0.75 * force / e_star)
        return a, 1.5 * force / (np.pi * a**2)

    return Pressed(
        scene, {"lower": BALL.E}, "slave", tool, held, None, BALL.depth, exact, 4, 2
    )


def solve_ball_of_revolution(n, degree, law):
    """The section in (r, z) of the same ball: error of the pressure in L2."""
    tool = rigid.Body(rigid.Circle((0.0, 1.0), 1.0))
    found = revolution.build(
        revolution.half_space(BALL.a, n), degree, E=BALL.E, nu=NU, master=tool,
        bcs=lambda V, s: [
            revolution.on_axis(V, s),
            *(tools.prescribe(V, s.find(name)) for name in ("bottom", "side")),
        ],
        method=AugmentedLagrangian(**METHODS[law]),
    )  # fmt: skip
    solver = raymortar.SNESSolver(found.problem)

    def press(t):
        tool.move((0.0, -BALL.depth * t**2))

    path = raymortar.LoadSteps(solver, press, 2).run()
    contact, mesh = found.contact, found.scene.mesh

    def error():
        lam, r = contact.multiplier, ufl.SpatialCoordinate(mesh)[0]
        force = abs(contact.results.resultant_on(tool).force[1])
        a = np.cbrt(0.75 * force * (1.0 - NU**2) / BALL.E)
        p = -lam[1] if lam.ufl_shape else -lam
        s = r / fem.Constant(mesh, a)
        exact = fem.Constant(mesh, 1.5 * force / (np.pi * a**2)) * ellipse(s)
        rule = {"quadrature_degree": 12}
        ds = ufl.Measure(
            "ds", mesh, subdomain_data=found.scene.facet_tags, metadata=rule
        )
        ds = ds(found.scene.tags["slave"])
        off = tools.integral((p - exact) ** 2 * r * ds, mesh)
        return np.sqrt(off / tools.integral(exact**2 * r * ds, mesh))

    return contact, error, sum(step.iterations for step in path)
