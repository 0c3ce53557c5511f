"""Bars and bodies that move, with closed forms of their impact."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION
from tangents import remainders_in_petsc

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import dynamics, tools
from raymortar.core import compat

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


def two_bars(scheme, mass, cfl=1.0, E=1.0, rho=1.0, v=0.01, time=3.0, n=50, **options):
    """Two bars of length 1 that meet at v and -v at time 0, for a time in units of 1/c.

    `stress` is that of contact over rho c v, `energy` that of both bars over the first
    one.
    """
    scene, c = bars(n=n, **options), np.sqrt(E / rho)
    energy, residual = elastic(scene, E)
    contact = raymortar.Contact(scene.u, scene.facets, [(SLAVE, MASTER)])
    problem = raymortar.NonlinearProblem(residual, contact)
    form = rho * ufl.inner(scene.a, scene.v) * ufl.dx
    found = run(
        scene, problem, dynamics.Inertia(form, contact, mass), energy=energy,
        end=time / c, dt=cfl / (n * c), scheme=scheme, velocity=by_bar(scene, v),
    )  # fmt: skip
    found.stress = found.force / (rho * c * v * scene.area)
    found.energy = found.energy / (rho * v**2 * scene.area)
    found.impulse = found.impulse / (2.0 * rho * v * scene.area)
    found.momentum = found.momentum / (rho * v * scene.area)
    found.time = found.time * c
    return found


def run(scene, problem, inertia, **options):
    """Run time steps with a history."""
    history = raymortar.History(problem)
    steps = dynamics.TimeSteps(problem.snes_solver, inertia, history=history, **options)
    axis = "xyz"[scene.d - 1]
    done = steps.run()
    return SimpleNamespace(
        scene=scene, problem=problem, steps=steps, done=done, history=history,
        time=history["time"], force=history[f"force_0_{axis}"],
        energy=history["kinetic"] + history["elastic"],
        impulse=history[f"impulse_0_{axis}"], momentum=history[f"momentum_{axis}"],
    )  # fmt: skip


def by_bar(scene, v):
    """-v in the upper bar and v in the lower one, on their common face too."""
    found = fem.Function(scene.V)
    dofs = compat.dofmap_array(scene.V)
    height = scene.V.tabulate_dof_coordinates()[dofs, scene.d - 1].mean(axis=1)
    values = found.x.array.reshape(-1, scene.d)
    values[dofs, -1] = np.where(height > 0.0, -v, v)[:, None]
    return found


def dropped(
    scheme, mass, n=40, cfl=1.0, end=1.5, E=900.0, v=-10.0, solver=None, **options
):
    """A bar of length 10 that falls on a plane 5 below it, with a wave speed of 30."""
    scene = bars(n=n, length=10.0, lower=False, gap=5.0)
    d = scene.d
    energy, residual = elastic(scene, E)
    floor = raymortar.rigid.Plane(np.zeros(d), np.eye(d)[-1])
    contact = raymortar.Contact(scene.u, scene.facets, [(SLAVE, floor)])
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact, mass)
    options = {"velocity": moving(scene, lambda z: v + 0.0 * z)} | options
    dt = cfl * 10.0 / n / np.sqrt(E)
    return run(
        scene, problem, inertia, end=end, dt=dt, scheme=scheme, energy=energy, **options
    )


def held_rod(scheme, mass, n=50, cfl=0.5, end=3.0, balanced=False):
    """A rod over a plane that it touches, E = rho = 1, its far end held, stretched
    upwards by u = (1 - z) / 2; `balanced`: its last cell has no stress."""
    scene = bars(n=n, lower=False)
    energy, residual = elastic(scene)
    least = 1.0 / n if balanced else 0.0
    scene.u.interpolate(
        lambda x: np.vstack(
            [0.0 * x[: scene.d - 1], [0.5 * (1.0 - np.maximum(x[scene.d - 1], least))]]
        )
    )
    floor = raymortar.rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(scene.u, scene.facets, [(SLAVE, floor)])
    held = tools.prescribe(scene.V, scene.facets.find(HEAD))
    problem = raymortar.NonlinearProblem(residual, contact, [held])
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    inertia = dynamics.Inertia(form, contact, mass)
    return run(
        scene, problem, inertia, end=end, dt=cfl / n, scheme=scheme, energy=energy
    )


def taylor_slope(problem, seed):
    """Order of what the tangent leaves of the residual's change at a state beside the
    start, in which held dofs stay. Collective."""
    rng, n = np.random.default_rng(seed + COMM.rank), problem.contact.layout.n_u
    x, d = problem.start(), problem.create_vector()
    for vector, size in ((x, 1e-3), (d, 1.0)):
        step = size * rng.normal(size=x.local_size)
        step[:n][problem.constrained] = 0.0
        vector.array[:] += step
    errors = remainders_in_petsc(problem, x, d, (1e-5, 5e-6))
    return np.log2(errors[0] / errors[1])
