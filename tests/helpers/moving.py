"""Bars and bodies that move, with closed forms of their impact."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import compat, dynamics, tools

# Tags of facets: slave is the foot of the upper bar, master the head of the lower one
SLAVE, MASTER, FOOT, HEAD = 1, 2, 3, 4


def bars(
    cell="quadrilateral",
    n=50,
    degree=1,
    length=1.0,
    width=None,
    heads=None,
    lower=True,
    gap=0.0,
    geometry_degree=1,
):
    """One bar on another along the last axis, or one alone above the origin."""
    d, width = DIMENSION[cell], 2.0 * length / n if width is None else width
    heads = 2 if heads is None else heads
    side = (heads,) * (d - 1)
    box = (0.0,) * (d - 1), (width,) * (d - 1)
    blocks = [
        Block((*side, n), (*box[0], gap), (*box[1], gap + length),
              tags={"bottom": SLAVE, "top": HEAD})
    ]  # fmt: skip
    if lower:
        blocks.append(
            Block((*side, n), (*box[0], -length), (*box[1], 0.0),
                  tags={"bottom": FOOT, "top": MASTER})
        )  # fmt: skip
    mesh, cells, facets = assemble_blocks(
        COMM, blocks, cell, geometry_degree=geometry_degree
    )
    V = tools.vector_space(mesh, degree)
    u, v, a = fem.Function(V, name="u"), ufl.TestFunction(V), ufl.TrialFunction(V)
    return SimpleNamespace(
        mesh=mesh, facets=facets, V=V, u=u, v=v, a=a, d=d, area=width ** (d - 1)
    )


def elastic(scene, E=1.0):
    """Energy of small strains, Poisson's ratio 0, and its residual."""
    strain = ufl.sym(ufl.grad(scene.u))
    energy = 0.5 * E * ufl.inner(strain, strain) * ufl.dx
    return energy, ufl.derivative(energy, scene.u, scene.v)


def moving(scene, speed):
    """Velocities along the last axis, as functions of the place. Collective."""
    found = fem.Function(scene.V)

    def values(x):
        zero = np.zeros((scene.d, x.shape[1]))
        zero[-1] = speed(x[scene.d - 1])
        return zero

    found.interpolate(values)
    return found


def two_bars(scheme, mass, cfl=1.0, E=1.0, rho=1.0, v=0.01, bars=bars, time=3.0, **options):
    """Two bars that meet at v and -v at time 0, over a time in units of L / c.

    Returns
    -------
    History, with ``force`` the contact force over that of the closed form, and scene.
    """
    scene = bars(**options)
    energy, residual = elastic(scene, E)
    contact = raymortar.Contact(scene.u, scene.facets, [(SLAVE, MASTER)])
    problem = raymortar.NonlinearProblem(residual, contact)
    c = np.sqrt(E / rho)
    inertia = dynamics.Inertia(rho * ufl.inner(scene.a, scene.v) * ufl.dx, contact, mass)
    history = raymortar.History(problem)
    V0 = velocity_by_bar(scene, v)
    n = options.get("n", 50)
    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, end=time / c, dt=cfl / (n * c), scheme=scheme,
        velocity=V0, energy=energy, history=history,
    )  # fmt: skip
    results = list(steps)
    return SimpleNamespace(
        history=history, scene=scene, steps=results, problem=problem, contact=contact,
        stress=history[f"force_0_{'xyz'[scene.d - 1]}"] / (rho * c * v * scene.area),
        energy=history["kinetic"] + history["elastic"],
        initial=0.5 * rho * v**2 * 2.0 * scene.area, c=c, inertia=inertia,
    )  # fmt: skip


def velocity_by_bar(scene, v):
    """-v in the upper bar and v in the lower one, their common face included."""
    found = fem.Function(scene.V)
    table = compat.dofmap_array(scene.V)
    x = scene.V.tabulate_dof_coordinates()
    values = found.x.array.reshape(-1, scene.d)
    for dofs in table:
        is_upper = x[dofs, scene.d - 1].mean() > 0.0
        values[dofs, -1] = -v if is_upper else v
    return found
