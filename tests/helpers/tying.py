"""Bodies that are tied to each other, shared by the tests of ties."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from dolfinx import fem
from problems import COMM, DIMENSION, Problem, fix, residual, tolerate, worst

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_blocks
from raymortar import LoadSteps, NonlinearProblem, SNESSolver, Tie
from raymortar.core import compat

E, NU = 900.0, 0.25


def build(
    scene,
    degree=1,
    material="linear",
    method=None,
    *,
    bcs=None,
    loaded=(),
    load=None,
    pairs=(("slave", "master"),),
    ties=1,
    others=None,
    moduli=E,
    **options,
):
    """Problem of tied bodies. Collective.

    Parameters
    ----------
    pairs
        Names of (slave, master) tags.
    ties
        Into how many ties of the pairs in turn.
    others
        Takes u to further interactions of the problem.
    options
        Of `raymortar.Tie`.
    """
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V, name="u")
    F, of_cells, S = residual(scene, u, material, moduli, NU, loaded)
    if load is not None:
        S.value[:] = load
    tags = [tuple(scene.tags[name] for name in pair) for pair in pairs]
    made = [
        Tie(u, scene.facet_tags, tags[k::ties], method, **options) for k in range(ties)
    ]
    made += [] if others is None else others(u)
    conditions = [] if bcs is None else bcs(V, scene)
    problem = NonlinearProblem(F, made if len(made) > 1 else made[0], conditions)
    return Problem(scene, u, made[0], problem, material, of_cells, S)


def strain_of(dim):
    """A gradient of displacement with all components, and no rotation."""
    H = np.array([[1.0, 0.7, -0.4], [0.7, -0.6, 0.3], [-0.4, 0.3, 0.5]])
    return 1e-2 * H[:dim, :dim]


def stress_of(H):
    """Of Hooke's law."""
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    return 2.0 * mu * H + lmbda * np.trace(H) * np.eye(len(H))


def linear(V, scene, *names):
    """The displacement of `strain_of` on facets with some tags."""
    H = strain_of(scene.mesh.geometry.dim)
    return [
        fix(V, scene, name, i, lambda x, i=i: x @ H[i])
        for name in names
        for i in range(len(H))
    ]


def outer(scene, *inner):
    """Names of all tags but some."""
    numbers = {scene.tags[name] for name in inner}
    names = {tag: name for name, tag in scene.tags.items() if tag not in numbers}
    return list(names.values())


def four_blocks(cell, divisions=(3, 4, 5, 2)):
    """Blocks around a common edge: 0 and 1 below, 2 and 3 above. Tags right_0, left_1,
    top_0, bottom_2 and so on."""
    names = ["left", "right", "bottom", "top"]
    dim = {"triangle": 2, "quadrilateral": 2}.get(cell, 3)
    names += ["front", "back"][: 2 * (dim - 2)]
    # Faces in the order of the axes
    order = names if dim == 2 else [*names[:2], *names[4:], *names[2:4]]
    blocks, tags = [], {}
    for k, n in enumerate(divisions):
        lower = np.zeros(dim)
        lower[0], lower[-1] = k % 2, k // 2
        of_block = {name: 10 * (k + 1) + i for i, name in enumerate(order)}
        tags |= {f"{name}_{k}": tag for name, tag in of_block.items()}
        blocks.append(
            Block((n,) * dim, tuple(lower), tuple(lower + 1.0), tags=of_block)
        )
    mesh, cells, facets = assemble_blocks(COMM, blocks, cell, 1)
    return Scene(mesh, cells, facets, tags, {f"{k}": k + 1 for k in range(4)})


# Pairs of the four blocks, slave first
AROUND = (
    ("right_0", "left_1"),
    ("top_0", "bottom_2"),
    ("top_1", "bottom_3"),
    ("left_3", "right_2"),
)


def rotation(dim, angle=2.0):
    """About an axis."""
    c, s = np.cos(angle), np.sin(angle)
    Q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    if dim == 2:
        return Q[:2, :2]
    a, b = np.cos(0.7), np.sin(0.7)
    tip = np.array([[1.0, 0.0, 0.0], [0.0, a, -b], [0.0, b, a]])
    return tip @ Q @ tip.T


# A cantilever of two halves


LENGTH = 10.0


# Cells along and across of the halves
UNLIKE = ((8, 2), (11, 3))


def beam(gap, divisions=UNLIKE):
    """Halves with a slanted gap."""
    names = {"wall": 1, "end": 2, "slave": 3, "master": 4}

    def half(divisions, left, right, tags):
        def place(p):
            first, last = left(p[:, 1]), right(p[:, 1])
            return np.stack([first + p[:, 0] * (last - first), p[:, 1]], axis=1)

        return Block(divisions, (0.0, -0.5), (1.0, 0.5), mapping=place, tags=tags)

    def cut(y):
        return 0.5 * LENGTH + 0.3 * y

    blocks = [
        half(divisions[0], np.zeros_like, cut, {"left": 1, "right": 4}),
        half(
            divisions[1],
            lambda y: cut(y) + gap,
            lambda y: LENGTH + 0.0 * y,
            {"left": 3, "right": 2},
        ),
    ]
    return Scene(*assemble_blocks(COMM, blocks, "quadrilateral", 1), names)


def bent(degree, gap, steps=4, divisions=UNLIKE):
    """The beam bent to a quarter circle: what holds it at its ends and through the tie,
    as (force, moment about the origin)."""
    radius = 2.0 * LENGTH / np.pi
    led = []

    def bcs(V, scene):
        led.append(fem.Function(V))
        facets = [scene.facet_tags.find(scene.tags[n]) for n in ("wall", "end")]
        wall, end = (fem.locate_dofs_topological(V, 1, found) for found in facets)
        return [fem.dirichletbc(fem.Function(V), wall), fem.dirichletbc(led[0], end)]

    problem = build(beam(gap, divisions), degree, "neo-hookean", bcs=bcs)

    def apply(t):
        a, r = 0.5 * np.pi * t, radius / t if t else 0.0
        x0 = r * np.sin(a) if t else LENGTH
        y0 = r * (1.0 - np.cos(a))
        led[0].interpolate(
            lambda x: np.stack(
                [x0 - x[1] * np.sin(a) - x[0], y0 + x[1] * np.cos(a) - x[1]]
            )
        )

    solver = SNESSolver(problem.problem)
    tolerate(solver, rtol=1e-13)
    LoadSteps(solver, apply, steps).run()
    tie, u = problem.contact, problem.u
    r = tie.resultant()
    modulus = E / (1.0 - NU**2)
    return SimpleNamespace(
        through=(r.force, r.moment),
        wall=_holding(problem, "wall"),
        end=_holding(problem, "end"),
        bending=modulus / 12.0 / radius,
        u=u,
    )


def _holding(problem, name):
    """Force and moment about the origin of what holds the nodes of a tag."""
    V, scene = problem.u.function_space, problem.scene
    b = compat.create_la_vector(V.dofmap.index_map, 2)
    compat.assemble_residual(b.array, problem.problem.L)
    compat.scatter_reverse_add(b)
    dofs = fem.locate_dofs_topological(V, 1, scene.facet_tags.find(scene.tags[name]))
    dofs = dofs[dofs < V.dofmap.index_map.size_local]
    forces = b.array.reshape(-1, 2)[dofs]
    x = V.tabulate_dof_coordinates()[:, :2] + problem.u.x.array.reshape(-1, 2)
    moments = x[dofs, 0] * forces[:, 1] - x[dofs, 1] * forces[:, 0]
    return COMM.allreduce(forces.sum(axis=0)), COMM.allreduce(float(moments.sum()))


def errors(problem, normal=None):
    """Of the gradient of the displacement, and of the multiplier over the stress."""
    H = strain_of(problem.dim)
    found = [worst(problem.gradient() - H) / np.linalg.norm(H)]
    if normal is not None:
        lam, S = problem.slave_multiplier(), stress_of(H)
        found.append(worst(lam - S @ normal) / np.linalg.norm(S))
    return max(found)


def with_gap(cell, degree=1, gap=0.1, **options):
    """Blocks with a gap between them, and one that is curved."""
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, 3, 2, gap=gap)
    return build(scene, degree, "neo-hookean", **options)
