"""Tables of small scenes: blocks and a cylinder."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from problems import build, fix
from sheared_blocks import NU, Blocks, E, limit_of
from trials import COMM, attempt, automatic_times, listed

import raymortar
from meshes.scenes import cylinder_on_block, two_blocks

FACTORS = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
HOLDS = 20
CYCLE = 0.1  # shear to either side
LAWS = {
    "augmented": raymortar.AugmentedLagrangian,
    "elastic": lambda: raymortar.Penalty(100.0),
    "rate": lambda: raymortar.Penalty(100.0, tangential="rate"),
}


def moved(problem, path):
    """A `LoadSteps` over `path`, a function that sets the load, of a `Problem`."""
    solver = raymortar.SNESSolver(problem.problem)
    steps = raymortar.LoadSteps(solver, path, 4, max_halvings=0).run()
    return [step.iterations for step in steps]


def neo_hookean(scene, bcs, method=None, **options):
    """Problem of the page's material."""
    degree = options.pop("degree", 1)
    return build(scene, degree, "neo-hookean", method, E=E, nu=NU, bcs=bcs, **options)


def clamped_ends(scene):
    """Both ends held, and the displacement of the top to be set."""
    top = fem.Constant(scene.mesh, np.zeros(scene.mesh.geometry.dim))

    def bcs(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    return bcs, top


# Holding by friction


def clamped_block(facets, method):
    """A block on a wider one, clamped, its interface of `facets` quadrilaterals."""
    scene = two_blocks(
        COMM,
        2,
        "quadrilateral",
        lower_divisions=(3 * facets // 2, 2),
        upper_divisions=(facets, 2),
        lower_size=(1.4, 0.6),
        upper_size=0.7,
    )
    bcs, top = clamped_ends(scene)
    friction = raymortar.Coulomb(0.5)
    return neo_hookean(scene, bcs, method, friction=friction), top


def held(contact, solve):
    """Changes of the shear force, relative to the first, in steps without motion."""
    force = [contact.resultant().tangential[0]]
    for _ in range(HOLDS):
        solve()
        contact.advance()
        force.append(contact.resultant().tangential[0])
    change = np.abs(np.diff(force)) / np.abs(force[0])
    return {
        "first_step": float(change[0]),
        "last_step": float(change[-1]),
        "in_all": float(abs(force[-1] / force[0] - 1.0)),
    }


def holding():
    """Pressed, sheared below the limit, then held."""
    for name, make in LAWS.items():
        friction = raymortar.Coulomb(0.5)
        blocks = Blocks("quadrilateral", make(), friction)
        blocks.press()
        k = 0.5 * limit_of(friction, 2)
        blocks.step(k, blocks.spring(k))
        blocks.contact.advance()
        row = held(blocks.contact, blocks.problem.solve)
        yield {"method": name, "blocks": "uniform", "facets": 2} | row
        for facets in (2, 4, 8, 16):
            problem, top = clamped_block(facets, make())
            for at in ((0.0, -0.03), (0.0, -0.06), (0.01, -0.06)):
                top.value[:] = at
                problem.solve()
                problem.contact.advance()
            row = held(problem.contact, problem.solve)
            yield {"method": name, "blocks": "clamped", "facets": facets} | row


def loop(problem, top, steps):
    """Work of friction in each quarter of a shear to and fro, in steps of one size."""
    work = []
    for quarter in ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)):
        done = 0.0
        for at in np.linspace(*quarter, steps // 4 + 1)[1:]:
            top.value[0] = CYCLE * at
            problem.solve()
            done += problem.contact.friction_work()
            problem.contact.advance()
        work.append(done)
    return work


def cycles():
    """Work of friction of two loops in which most points stick."""
    for name, facets in (("augmented", 2), ("augmented", 8), ("elastic", 2)):
        for steps in (16, 64, 256):
            problem, top = clamped_block(facets, LAWS[name]())
            for down in (0.03, 0.06):
                top.value[1] = -down
                problem.solve()
                problem.contact.advance()
            first, second = (loop(problem, top, steps) for _ in range(2))
            row = {"first_loop": sum(first), "second_loop": sum(second)}
            yield {"method": name, "facets": facets, "steps": steps} | row


# What gamma does


def rows_over_gamma(run):
    """Iterations, error of the force and deepest point for both methods."""
    with automatic_times(1.0):
        exact = run(raymortar.AugmentedLagrangian())[1]
    for factor in FACTORS:
        row = {"factor": factor}
        for name, method in (
            ("augmented", raymortar.AugmentedLagrangian),
            ("penalty", raymortar.Penalty),
        ):
            # Penalty's own automatic value is ten times as large
            scale = factor / method.automatic_factor
            with automatic_times(scale):
                found = attempt(run, method())
            iterations, force, deepest = found or ("fails", np.nan, np.nan)
            row |= {
                f"{name}_iterations": iterations,
                f"{name}_force": float(force / exact - 1.0),
                f"{name}_penetration": float(deepest),
            }
        yield row


def measured(problem, iterations):
    contact = problem.contact
    gap = contact.points()["gap"][contact.points()["status"] > 0]
    deepest = -gap.min(initial=0.0)
    return listed(iterations), abs(contact.resultant().force[-1]), deepest


def narrow_on_wide():
    """A narrow block on a wide one, in 2D."""
    return two_blocks(
        COMM,
        2,
        "quadrilateral",
        lower_divisions=(12, 9),
        upper_divisions=(7, 6),
        upper_size=0.6,
    )


def gamma_blocks():
    """A narrow block on a wide one, by a fifth of the height in one step."""

    def run(method):
        scene = narrow_on_wide()
        bcs, top = clamped_ends(scene)
        problem = neo_hookean(scene, bcs, method)
        top.value[-1] = -0.2 * 1.6
        return measured(problem, [problem.solve()])

    yield from rows_over_gamma(run)


def gamma_cylinder():
    """A cylinder pushed into a block, in four steps."""

    def run(method):
        scene = cylinder_on_block(COMM, facets_across=12, gap=0.2)
        top = fem.Constant(scene.mesh, 0.0)

        def bcs(V, scene):
            return [
                fix(V, scene, "bottom"),
                fix(V, scene, "symmetry_x", 0),
                fix(V, scene, "top", 1, top),
            ]

        problem = neo_hookean(scene, bcs, method)

        def apply(factor):
            top.value = -4.0 * factor

        return measured(problem, moved(problem, apply))

    yield from rows_over_gamma(run)


def quadrature():
    """The same blocks in 3D, over the degree of the rule on segments."""
    for degree in (1, 2, 3, 4, 6):
        scene = two_blocks(
            COMM,
            3,
            "hexahedron",
            lower_divisions=(5, 5, 4),
            upper_divisions=(4, 4, 3),
            upper_size=0.6,
        )
        bcs, top = clamped_ends(scene)
        problem = neo_hookean(scene, bcs, quadrature_degree=degree)

        def apply(factor, top=top):
            top.value[-1] = -0.2 * 1.6 * factor

        iterations = moved(problem, apply)
        yield {
            "degree": degree,
            "points": len(problem.contact.points()["gap"]),
            "iterations": listed(iterations),
            "force": float(abs(problem.contact.resultant().force[-1])),
        }
