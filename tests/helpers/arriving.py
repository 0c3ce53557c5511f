"""Scenes that have to arrive with nothing tuned: blocks on each other, a free disc."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from first_tries import read
from materials import MATERIALS, lame
from pathing import Path
from problems import COMM, cellwise, fix, residual, stack

import raymortar
from raymortar import rigid
from raymortar.core import compat
from raymortar.core.discretization.ranks import ends_of

# Of the disc
RADIUS, WEIGHT, FALL = 5.0, 5.0, 0.1


def stacked(steps):
    """Three blocks of degree 2, the lower two tied, under a circle that is pressed in
    and dragged."""
    scene = stack("quadrilateral", (3, 4, 5), heights=(0.5, 0.5, 0.5))
    V = compat.vector_space(scene.mesh, 2)
    u = fem.Function(V)
    form, _, _ = residual(scene, u, "neo-hookean", 10.0)
    circle = rigid.Body(rigid.Circle((0.4, 2.0), 0.5))
    law, tags = {"friction": raymortar.Coulomb(0.3)}, scene.tags
    tie = raymortar.Tie(u, scene.facet_tags, [(tags["bottom_1"], tags["top_0"])])
    contacts = [
        raymortar.Contact(u, scene.facet_tags, [pair], **law)
        for pair in ((tags["bottom_2"], tags["top_1"]), (tags["top_2"], circle))
    ]
    bcs = [fix(V, scene, "bottom")]
    problem = raymortar.NonlinearProblem(form, [tie, *contacts], bcs)
    return Path(
        problem,
        lambda t: circle.move((0.03 * t, -0.12 * t)),
        steps,
        lambda: (
            contacts[1].resultant().force,
            problem.reactions({"bottom": bcs[0]})["bottom"],
        ),
    )


def loose_stack(
    fine=1,
    degree=1,
    gap=0.02,
    steps=4,
    loaded="012",
    held=("bottom",),
    heights=(1.0, 1.0, 1.0),
    apart=None,
    guided=(),
    more=None,
    friction=0.3,
):
    """Two blocks above a third one, under the weights of those that are loaded, held by
    nothing but contact.

    `gap` is between all blocks, but for the upper two if they are `apart` by something
    else. Sides that are `guided` move along y alone. `more` adds to the form, given u, its
    test function and a function of cells by body.
    """
    divisions = (3 * fine, 4 * fine, 2 * fine)
    gaps = (0.0, gap, gap if apart is None else apart)
    scene = stack("quadrilateral", divisions, heights, gaps)
    V = compat.vector_space(scene.mesh, degree)
    u, factor = fem.Function(V), fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    form, _, _ = residual(scene, u, "neo-hookean", 100.0)
    weights = cellwise(scene, {b: float(b in loaded) for b in scene.bodies})
    v = ufl.TestFunction(V)
    form += factor * weights * v[1] * ufl.dx
    if more is not None:
        form += more(u, v, lambda values: cellwise(scene, values)) * ufl.dx
    tags = scene.tags
    pairs = [(tags[f"bottom_{i + 1}"], tags[f"top_{i}"]) for i in (0, 1)]
    law = None if friction is None else raymortar.Coulomb(friction)
    contact = raymortar.Contact(u, scene.facet_tags, pairs, friction=law)
    bcs = [fix(V, scene, side) for side in held]
    bcs += [fix(V, scene, side, 0) for side in guided]
    problem = raymortar.NonlinearProblem(form, contact, bcs)

    def apply(t):
        factor.value = t

    return Path(
        problem,
        apply,
        steps,
        lambda: np.array([contact.resultant(i).force for i in (0, 1)]),
    )


def on_tools(mesh, skin, lines, degree, E, density, friction):
    """A plane body of neo-Hookean rubber that rigid lines alone bear, each given by a
    point and its normal; `density` gives its weight per area from the whole one.

    Returns
    -------
    problem, the tools, the Constant of the weight.
    """
    V = compat.vector_space(mesh.mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    weight = fem.Constant(mesh.mesh, PETSc.ScalarType(0.0))
    stress = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(E, 0.3))
    form = (ufl.inner(stress, ufl.grad(v)) + density(weight) * v[1]) * ufl.dx
    tools = [rigid.Body(rigid.Line(*line)) for line in lines]
    contact = raymortar.Contact(
        u,
        mesh.facet_tags,
        [(skin, tool) for tool in tools],
        friction=raymortar.Coulomb(friction) if friction else None,
        names=mesh.names,
    )
    return raymortar.NonlinearProblem(form, contact), tools, weight


def leaning(friction, gap=1e-3, steps=2):
    """A stiff plank of length 1 that leans at 60 degrees on a rigid wall, its ends a gap
    from wall and floor, under its weight of 1. The result is the angle of the diagonal of
    the box around it, in degrees, and the force of wall and floor."""
    thick, size, dim = 0.05, 0.05, 2

    def draw(occ):
        plank = occ.addRectangle(0, 0, 0, thick, 1.0)
        occ.rotate([(dim, plank)], 0, 0, 0, 0, 0, 1, np.pi / 6.0)
        occ.translate([(dim, plank)], gap + 0.5, gap, 0)
        return {"plank": plank}, {"skin": ("plank", lambda x, y: True)}

    mesh = read(draw, size)
    lines = [((0.0, 0.0), (0.0, 1.0)), ((0.0, 0.0), (1.0, 0.0))]
    problem, _, weight = on_tools(
        mesh, "skin", lines, 1, 1e7, lambda weight: weight / thick, friction
    )
    u = problem.contact.u

    def apply(t):
        weight.value = t

    def lean():
        x = u.function_space.tabulate_dof_coordinates()[:, :2]
        low, high = ends_of(x + u.x.array.reshape(-1, 2), COMM)
        force = problem.contact.resultant().force
        return np.degrees(np.arctan2(*(high - low)[::-1])), force

    return Path(problem, apply, steps, lean)


def free_disc(size=0.8, steps=10, walls=False, aside=0.0, friction=0.3):
    """A disc under its weight above a rigid line, on which it could roll until, if there
    are walls, these grip it in the second half of the path. Its centre of mass is `aside`
    of its middle."""

    def draw(occ):
        disc = occ.addDisk(0, RADIUS + FALL, 0, RADIUS, RADIUS)
        return {"disc": disc}, {"rim": ("disc", lambda x, y: True)}

    mesh = read(draw, size)

    def density(weight):
        by_place = 4.0 * aside / RADIUS**2 * ufl.SpatialCoordinate(mesh.mesh)[0]
        return weight / (np.pi * RADIUS**2) * (1.0 + by_place)

    beside = 1.1 * RADIUS
    lines = [((0.0, 0.0), (0.0, 1.0))]
    lines += [((side * beside, 0.0), (-side, 0.0)) for side in (-1.0, 1.0) * walls]
    problem, (_, *sides), weight = on_tools(
        mesh, "rim", lines, 2, 10.0, density, friction
    )
    u = problem.contact.u
    x = u.function_space.tabulate_dof_coordinates()[:, :2] - (0.0, RADIUS + FALL)

    def apply(t):
        weight.value = WEIGHT * t
        for wall, way in zip(sides, (1.0, -1.0)):
            wall.move((way * 0.3 * RADIUS * max(t - 0.5, 0.0), 0.0))

    def middle():
        """Displacement near the middle, and the force of the floor."""
        near = np.hypot(*x.T)
        mine = near.min(), tuple(u.x.array.reshape(-1, 2)[near.argmin()])
        return (
            np.array(min(COMM.allgather(mine))[1]),
            problem.contact.resultant(0).force,
        )

    return Path(problem, apply, steps, middle)


def squeezed_disc(size=0.8e-3, squeeze=0.04):
    """A disc of rubber with springs and friction between two rigid lines that close."""
    radius = 2.5e-3

    def draw(occ):
        disc = occ.addDisk(0, radius, 0, radius, radius)
        return {"disc": disc}, {"rim": ("disc", lambda x, y: True)}

    mesh = read(draw, size)
    V = compat.vector_space(mesh.mesh, 2)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(6e6, 0.3))
    form = ufl.inner(stress, ufl.grad(v)) * ufl.dx(degree=4)
    line, body = raymortar.rigid.Line, raymortar.rigid.Body
    lid, floor = body(line((0, 2 * radius), (0, -1))), body(line((0, 0), (0, 1)))
    contact = raymortar.Contact(
        u,
        mesh.facet_tags,
        [("rim", lid), ("rim", floor)],
        raymortar.Penalty(),
        friction=raymortar.Coulomb(0.1),
        names=mesh.names,
    )
    return Path(
        raymortar.NonlinearProblem(form, contact),
        lambda t: lid.move((0.0, -2.0 * radius * squeeze * t)),
        1,
        lambda: np.array([contact.results.resultant_on(b).force for b in (lid, floor)]),
    )
