"""Paths of load steps as a first try sets them up: nothing is tuned."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

from petsc4py import PETSc

import numpy as np
import ufl
from bodies_2d import ball_on_block, discs_on_block, ring_between_plates, snap_fit
from dolfinx import fem

ROOT = Path(__file__).resolve().parents[2]
for folder in ("tests/helpers", "benchmarks/stress", "benchmarks"):
    sys.path.append(str(ROOT / folder))

import greco  # noqa: E402
from load_paths import divisions, resting  # noqa: E402
from models import half_ring  # noqa: E402
from models import shallow_ironing  # noqa: E402
from problems import COMM, DIMENSION, build, cellwise, fix, residual  # noqa: E402
from scenes import SCENES, Setting  # noqa: E402

import raymortar  # noqa: E402
from meshes.blocks import Block  # noqa: E402
from meshes.meshing import Scene, assemble_blocks  # noqa: E402
from meshes.scenes import two_blocks  # noqa: E402
from raymortar.core import compat


@dataclasses.dataclass
class Case:
    """What `LoadSteps` is given."""

    problem: object
    apply: object
    steps: int
    options: dict = dataclasses.field(default_factory=dict)


def stress(scene, steps=None, **setting):
    """A scene of benchmarks/stress."""
    case = SCENES[scene](Setting(scene=scene, **setting))
    return Case(case.problem.problem, case.apply, steps or case.steps)


def ring(size, friction, steps, gamma=None):
    """The demo's half ring, with full steps."""
    model = half_ring.HalfRing(COMM, size, friction, {}, gamma)
    return Case(model.problem, model.apply, steps)


def plate(cell, degree):
    """The plate on a rigid plane, with the automatic gamma."""
    problem, load = greco.problem(cell, degree, None)
    return Case(problem.problem, load, 5)


def moved(scene, degree, path, steps, bcs=None, **options):
    """The tag "top" moves along a path, "bottom" is held."""
    dim = scene.mesh.geometry.dim
    top = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))

    def conditions(V, scene):
        more = [] if bcs is None else bcs(V, scene)
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top), *more]

    problem = build(scene, degree, "neo-hookean", bcs=conditions, **options)

    def apply(t):
        top.value[:] = path(t)

    return Case(problem.problem, apply, steps)


def snap(steps, degree=1, **options):
    """The hook is pushed over the latch's tooth, at sharp corners."""
    search = raymortar.Search(reach=1.0, depth=1.0)
    return moved(
        snap_fit(),
        degree,
        lambda t: (3.2 * t, 0.0),
        steps,
        search=search,
        E=1000.0,
        **options,
    )


def squeezed_ring(push, steps, degree=1, **options):
    """A ring held by friction alone between plates that close."""
    scene = ring_between_plates()
    return moved(
        scene,
        degree,
        lambda t: (0.0, -push * t),
        steps,
        pairs=[("slave", "below"), ("slave", "above")],
        E={"ring": 10.0, "lower": 1000.0, "upper": 1000.0},
        **options,
    )


def corner(cell, degree, push, steps):
    """Corner on corner: blocks that overlap by a fifth of their width."""
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, *divisions(cell), overhang=0.8)
    down = np.eye(dim)[-1]
    return moved(scene, degree, lambda t: -push * t * down, steps)


def rigid_punch(cell, degree, push, steps, **options):
    """A block 1000 times as stiff, 0.4 wide, pressed into a soft one."""
    dim = DIMENSION[cell]
    size = (0.4,) * (dim - 1) + (1.0,)
    scene = two_blocks(COMM, dim, cell, *divisions(cell), upper_size=size)
    down = np.eye(dim)[-1]
    return moved(
        scene,
        degree,
        lambda t: -push * t * down,
        steps,
        E={"lower": 1.0, "upper": 1000.0},
        **options,
    )


def rigid_flat(cell, degree, above, below, push, steps, pairs=None, **options):
    """A rigid flat of so many facets, the master, on a soft slave of fewer, from a gap."""
    dim = DIMENSION[cell]
    size = (1.0,) * dim
    scene = two_blocks(COMM, dim, cell, below, above, upper_size=size, gap=0.01)
    moved = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))

    def conditions(V, scene):
        rigid = fix(V, scene, ["top", "slave"], None, moved)
        return [fix(V, scene, "bottom"), rigid]

    options["pairs"] = pairs or [("master", "slave")]
    problem = build(scene, degree, "neo-hookean", bcs=conditions, **options)

    def apply(t):
        moved.value[-1] = -push * t

    return Case(problem.problem, apply, steps)


# Where maps put a place, in metres
ON_A_MAP = (4.5e5, 5.5e6, 320.0)


def dragged(cell, degree, steps, friction, origin=None, **options):
    """A round stamp pressed into a block, then drawn along it."""
    dim = DIMENSION[cell]

    def round_below(x):
        return 1.0 + 0.6 * ((x[:, :1] - 0.75) ** 2).sum(axis=1)

    n = ((12, 4), (5, 2)) if dim == 2 else ((8, 3, 2), (3, 3, 2))
    below = (3.0,) + (1.5,) * (dim - 2) + (1.0,)
    scene = two_blocks(
        COMM,
        dim,
        cell,
        *n,
        lower_size=below,
        upper_size=(0.8,) * (dim - 1) + (0.5,),
        overhang=(-0.75,) + (0.0,) * (dim - 2),
    )
    if origin is not None:
        scene.mesh.geometry.x[:, :dim] += origin[:dim]

    def path(t):
        x = np.zeros(dim)
        x[-1], x[0] = -0.15 * min(4.0 * t, 1.0), 1.2 * max(t - 0.25, 0.0) / 0.75
        return x

    return moved(
        scene,
        degree,
        path,
        steps,
        E={"lower": 1.0, "upper": 100.0},
        friction=raymortar.Coulomb(friction),
        **options,
    )


def between_plates(cell, degree, push, steps):
    """A block between two plates of its width, the moving one its slave."""
    dim = DIMENSION[cell]
    n, tags = (4 if dim == 2 else 2), {}
    blocks, z = [], 0.0
    for i, height in enumerate((0.3, 1.0, 0.3)):
        sides = {"bottom": 10 * i + 1, "top": 10 * i + 2}
        lateral = (n + i,) * (dim - 1)
        ends = (0.0,) * (dim - 1) + (z,), (1.0,) * (dim - 1) + (z + height,)
        blocks.append(Block((*lateral, 2 if i != 1 else n), *ends, tags=sides))
        tags |= {f"{name}_{i}": tag for name, tag in sides.items()}
        z += height
    mesh, cells, facets = assemble_blocks(COMM, blocks, cell)
    tags |= {"bottom": tags["bottom_0"], "top": tags["top_2"]}
    scene = Scene(mesh, cells, facets, tags, {f"{i}": i + 1 for i in range(3)})
    down = np.eye(dim)[-1]
    return moved(
        scene,
        degree,
        lambda t: -push * t * down,
        steps,
        pairs=[("bottom_1", "top_0"), ("bottom_2", "top_1")],
        E={"0": 1e5, "1": 1.0, "2": 1e5},
        friction=raymortar.Coulomb(0.2),
    )


def ironing(size, steps, **options):
    """The demo's die drawn over a slab, with full steps."""
    model = shallow_ironing.Ironing(COMM, size, gamma=None, options={}, **options)
    return Case(model.problem, model.apply, steps, {"path": (0.0, 1.3)})


STABILIZED = {"stabilize": True}


def block_falls(cell, gap, degree=1):
    """A block under its weight, free above another."""
    problem, load, _ = resting(cell, gap, raymortar.Coulomb(0.3), degree=degree)
    return Case(load.solver.problem, load.apply, 2, STABILIZED)


def discs_fall(centres, pairs, degree=1):
    """Discs under their weight, free above a block."""
    return falls(discs_on_block(centres), pairs, raymortar.Coulomb(0.5), degree)


def falls(scene, pairs, friction, degree):
    """Bodies under their weight, free above "lower", whose "bottom" is held."""
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    form, _, _ = residual(scene, u, "neo-hookean", 10.0)
    density = cellwise(scene, {b: float(b != "lower") for b in scene.bodies})
    weight = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    form += weight * density * ufl.TestFunction(V)[len(u) - 1] * ufl.dx
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        pairs,
        friction=friction,
        names=scene.tags,
    )
    problem = raymortar.NonlinearProblem(form, contact, [fix(V, scene, "bottom")])

    def apply(t):
        weight.value = 0.05 * t

    return Case(problem, apply, 2, STABILIZED)


def disc_falls(gap, degree=1):
    """One of them."""
    return discs_fall([(0.0, 0.5 + gap)], [("circle_0", "block")], degree)


def pile(gap):
    """One disc on two, each this far from the next and from the block."""
    apart = 0.5 * (1.0 + gap)
    height = np.sqrt((1.0 + gap) ** 2 - apart**2)
    low = 0.5 + gap
    centres = [(-apart, low), (apart, low), (0.0, low + height)]
    pairs = [("circle_0", "block"), ("circle_1", "block")]
    pairs += [("circle_2", "circle_0"), ("circle_2", "circle_1")]
    return discs_fall(centres, [*pairs, ("circle_0", "circle_1")])


def ball_falls(gap):
    """A ball under its weight, free above a block, each of tetrahedra."""
    return falls(
        ball_on_block(0.5 + gap), [("sphere", "block")], raymortar.Coulomb(0.3), 1
    )


# Name: what makes the path
PATHS = {
    "slide off an edge, triangles, mu = 0": lambda: stress("slide"),
    "slide off an edge, triangles, mu = 0.3": lambda: stress("slide", friction=0.3),
    "slide off an edge, triangles, mu = 1": lambda: stress(
        "slide", friction=1.0, push=0.1
    ),
    "slide off an edge, triangles of degree 2": lambda: stress(
        "slide", friction=0.3, degree=2
    ),
    "slide off an edge, triangles of degree 2, 30 steps": lambda: stress(
        "slide", 30, friction=0.3, degree=2
    ),
    "slide off an edge, quadrilaterals of degree 2": lambda: stress(
        "slide", friction=0.3, degree=2, cell="quadrilateral"
    ),
    "slide off an edge, triangles, 12 steps": lambda: stress("slide", 12, friction=0.3),
    "slide off an edge, tetrahedra": lambda: stress(
        "slide", 20, friction=0.3, cell="tetrahedron", divisions=(3, 2)
    ),
    "slide off an edge, hexahedra": lambda: stress(
        "slide", 20, friction=0.3, cell="hexahedron", divisions=(3, 2)
    ),
    "punch, mu = 1, 1000 gamma": lambda: stress(
        "punch", 2, friction=1.0, push=0.1, gamma=1e3
    ),
    "punch, mu = 0.6, pressed by 0.4": lambda: stress(
        "punch", 2, friction=0.6, push=0.4
    ),
    "punch, nu = 0.4999, mu = 0.5, degree 2": lambda: stress(
        "punch", 4, friction=0.5, nu=0.4999, degree=2, cell="quadrilateral", push=0.1
    ),
    "punch with flanks": lambda: stress("punch", 4, push=0.2, perpendicular=True),
    "half ring, mu = 0, 20 steps": lambda: ring(32, 0.0, 20),
    "half ring, mu = 0.5, 20 steps": lambda: ring(32, 0.5, 20),
    "half ring, mu = 0.5, 10 gamma": lambda: ring(32, 0.5, 20, 400.0),
    "GRECO's plate, quadrilaterals": lambda: plate("quadrilateral", 1),
    "GRECO's plate, triangles of degree 2": lambda: plate("triangle", 2),
    "snap-fit": lambda: snap(32),
    "snap-fit, mu = 0.3": lambda: snap(32, friction=raymortar.Coulomb(0.3)),
    "snap-fit, degree 2, mu = 0.3": lambda: snap(
        32, 2, friction=raymortar.Coulomb(0.3)
    ),
    "snap-fit, penalty": lambda: snap(32, method=raymortar.Penalty()),
    "snap-fit, penalty, mu = 0.3": lambda: snap(
        32, method=raymortar.Penalty(), friction=raymortar.Coulomb(0.3)
    ),
    "ring between plates, mu = 0.3": lambda: squeezed_ring(
        0.4, 8, friction=raymortar.Coulomb(0.3)
    ),
    "ring between plates, degree 2": lambda: squeezed_ring(
        0.4, 8, 2, friction=raymortar.Coulomb(0.3)
    ),
    "corner on corner": lambda: corner("triangle", 1, 0.2, 5),
    "corner on corner, degree 2": lambda: corner("quadrilateral", 2, 0.2, 5),
    "rigid punch to 60 %": lambda: rigid_punch("quadrilateral", 1, 0.6, 10),
    "rigid punch to 60 %, mu = 0.3": lambda: rigid_punch(
        "triangle", 1, 0.6, 10, friction=raymortar.Coulomb(0.3)
    ),
    "rigid punch to 40 %, hexahedra": lambda: rigid_punch("hexahedron", 1, 0.4, 5),
    "stamp drawn along, mu = 0.5": lambda: dragged("quadrilateral", 1, 16, 0.5),
    "stamp drawn along, triangles of degree 2": lambda: dragged("triangle", 2, 16, 0.5),
    "stamp drawn along, hexahedra": lambda: dragged("hexahedron", 1, 12, 0.5),
    "stamp drawn along, penalty": lambda: dragged(
        "quadrilateral", 1, 16, 0.5, method=raymortar.Penalty()
    ),
    "stamp drawn along, penalty, on a map": lambda: dragged(
        "quadrilateral", 1, 16, 0.5, ON_A_MAP, method=raymortar.Penalty()
    ),
    "stamp drawn along, hexahedra, penalty, on a map": lambda: dragged(
        "hexahedron", 1, 12, 0.5, ON_A_MAP, method=raymortar.Penalty()
    ),
    "rigid flat slave, 5/5 facets": lambda: rigid_flat(
        "quadrilateral", 1, 5, 5, 0.2, 4, [("slave", "master")]
    ),
    **{
        f"rigid flat master, {above}/{below} facets": lambda n=(above, below): (
            rigid_flat("quadrilateral", 1, *n, 0.2, 4)
        )
        for above, below in ((6, 5), (9, 5), (24, 20))
    },
    "rigid flat master, 9/5 facets, mu = 0.3": lambda: rigid_flat(
        "triangle", 1, 9, 5, 0.2, 4, friction=raymortar.Coulomb(0.3)
    ),
    "rigid flat master, 9/5 facets, degree 2": lambda: rigid_flat(
        "quadrilateral", 2, 9, 5, 0.2, 4
    ),
    "rigid flat master, 6/4 facets, hexahedra": lambda: rigid_flat(
        "hexahedron", 1, 6, 4, 0.2, 4
    ),
    "between equal plates": lambda: between_plates("triangle", 1, 0.1, 2),
    "between equal plates, hexahedra": lambda: between_plates("hexahedron", 1, 0.1, 2),
    "ironing, full steps": lambda: ironing(60, 26),
    "disc falls, gap 0": lambda: disc_falls(0.0),
    "disc falls, gap 1e-6": lambda: disc_falls(1e-6),
    "disc falls, gap 0.1": lambda: disc_falls(0.1),
    "disc falls, 5 diameters": lambda: disc_falls(5.0),
    "disc falls, gap 0.1, degree 2": lambda: disc_falls(0.1, 2),
    "pile of discs, gap 0": lambda: pile(0.0),
    "pile of discs, gap 0.1": lambda: pile(0.1),
    "ball falls, gap 0.1": lambda: ball_falls(0.1),
    "ball falls, 5 diameters": lambda: ball_falls(5.0),
    "block falls, tetrahedra, gap 0.1": lambda: block_falls("tetrahedron", 0.1),
    "block falls, hexahedra, 5 heights": lambda: block_falls("hexahedron", 5.0),
    "block falls, triangles of degree 2": lambda: block_falls("triangle", 0.1, 2),
}
