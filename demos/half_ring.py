"""Half ring on a block: large sliding with friction, and lift-off (2D).

The ends of an elastic half ring, stiff inside and soft outside, are pushed towards
an elastic block. The ring flattens, slides along the block by a multiple of its
facets, and buckles: its middle comes off the block again. Data of code_aster's
SSNP165, after Yastrebov, and Poulios and Renard (2015), but for the law, which is
neo-Hookean here.
"""

import sys
import time
from types import SimpleNamespace

import common
import numpy as np
import ufl
from dolfinx import fem

from mpi4py import MPI

import raymortar
from raymortar import compat
from raymortar.blocks import Block
from raymortar.meshing import Scene, assemble_blocks

# Lengths in mm, moduli in MPa
INNER, MIDDLE, OUTER = 90.0, 95.0, 100.0  # radii
WIDTH, HEIGHT, GAP = 260.0, 50.0, 20.0
E_INNER, E_OUTER, E_BLOCK, NU = 1e5, 1e3, 300.0, 0.3
PUSH, FRICTION = 90.0, 0.5
TAGS = {"bottom": 1, "master": 2, "slave": 3, "ends": 4}
# Residuals of Newton's method go up and down where points hop between states
LINE_SEARCH = {"snes_linesearch_type": "l2"}


def half_ring(comm, size):
    """Ring of `size` cells along its arc on a block. Collective."""
    centre = OUTER + GAP

    def bent(x):
        angle, r = x[:, 0], OUTER - x[:, 1]
        return np.column_stack([r * np.sin(angle), centre - r * np.cos(angle)])

    ring = Block(
        (size, 2),
        (-0.5 * np.pi, 0.0),
        (0.5 * np.pi, OUTER - INNER),
        mapping=bent,
        tags={"bottom": TAGS["slave"], "left": TAGS["ends"], "right": TAGS["ends"]},
    )
    block = Block(
        (13 * size // 16, max(5 * size // 32, 2)),
        (-0.5 * WIDTH, -HEIGHT),
        (0.5 * WIDTH, 0.0),
        tags={"bottom": TAGS["bottom"], "top": TAGS["master"]},
    )
    mesh, cells, facets = assemble_blocks(comm, [block, ring], "quadrilateral", 2)
    return Scene(mesh, cells, facets, TAGS)


def moduli(scene):
    """Young's modulus of each cell."""

    def of_place(x):
        r = np.hypot(x[0], x[1] - OUTER - GAP)
        return np.where(x[1] < 0.0, E_BLOCK, np.where(r < MIDDLE, E_INNER, E_OUTER))

    E = fem.Function(compat.space(scene.mesh, "DG", 0))
    E.interpolate(of_place)
    return E


def clamp(V, scene, name, component, value=0.0):
    """Prescribe one component of the displacement on a named part of the boundary."""
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V.sub(component), 1, facets)
    if not isinstance(value, fem.Constant):
        value = fem.Constant(scene.mesh, value)
    return fem.dirichletbc(value, dofs, V.sub(component))


def centre_of(V, scene, name):
    """Dof of the node of a surface at x = 0, where this rank owns it."""
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, 1, facets)
    dofs = dofs[dofs < V.dofmap.index_map.size_local]
    return dofs[np.abs(V.tabulate_dof_coordinates()[dofs, 0]) < 1e-6 * OUTER]


def solve(
    comm,
    size=32,
    steps=50,
    friction=FRICTION,
    options=None,
    gamma=None,
    report=None,
    keep=(0.3, 0.5, 0.7, 1.0),
):
    """Push the ring in `steps`; what happened at each accepted step.

    Parameters
    ----------
    options
        PETSc options of SNES; None: with line search.
    keep
        Load factors at which the displacement is kept, for the picture.
    """
    scene = half_ring(comm, size)
    mesh, tags = scene.mesh, scene.tags
    V = compat.vector_space(mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    E = moduli(scene)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    F = ufl.Identity(2) + ufl.grad(u)
    inverse, J = ufl.inv(F).T, ufl.det(F)
    P = mu * (F - inverse) + lmbda * ufl.ln(J) * inverse
    dx = ufl.dx(metadata={"quadrature_degree": 4})
    L = ufl.inner(P, ufl.grad(v)) * dx

    down = fem.Constant(mesh, 0.0)
    bcs = [clamp(V, scene, name, 0) for name in ("bottom", "ends")]
    bcs += [clamp(V, scene, "bottom", 1), clamp(V, scene, "ends", 1, down)]
    pair = (tags["slave"], tags["master"])
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [pair],
        raymortar.AugmentedLagrangian(gamma),
        raymortar.Coulomb(friction) if friction else None,
    )
    problem = raymortar.NonlinearProblem(L, contact, bcs)
    solver = raymortar.SNESSolver(problem, LINE_SEARCH if options is None else options)

    def apply(factor):
        down.value = -PUSH * factor

    places = centre_of(V, scene, "master"), centre_of(V, scene, "slave")

    lam = contact.multiplier
    node = centre_of(lam.function_space, scene, "slave")

    def centre():
        """Displacements of both surfaces and pressure in the middle. Collective."""
        values = u.x.array.reshape(-1, 2)
        mine = [*values[places[0]].sum(axis=0), *values[places[1]].sum(axis=0)]
        # Traction on the slave: a vector, or without friction along its normal
        last = lam.x.array.reshape(-1, contact.layout.components)[node, -1].sum()
        return comm.allreduce(np.array([*mine, last if friction else -last]))

    path, kept, started = [], [], time.perf_counter()
    loading = raymortar.LoadSteps(solver, apply, steps=steps)
    for step in loading:
        middle, force = centre(), contact.resultant(0).force
        path.append((step.factor, step.iterations, *middle, *force))
        if report is not None:
            report.say(
                f"t = {step.factor:6.4f}: {step.iterations:2} iterations, "
                f"{step.halvings} halvings, force {force[1]:8.2f} N/mm, "
                f"pressure in the middle {middle[4]:7.3f} MPa, "
                f"{time.perf_counter() - started:5.1f} s"
            )
        if len(kept) < len(keep) and step.factor >= keep[len(kept)] - 1e-9:
            kept.append((step.factor, u.copy()))
    path = np.array(path)
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        stress=P * F.T / J,
        factor=path[:, 0],
        iterations=path[:, 1].astype(int),
        below=path[:, 2:4],
        above=path[:, 4:6],
        gap=GAP + path[:, 5] - path[:, 3],
        pressure=path[:, 6],
        force=path[:, 7:9],
        halvings=loading.halvings,
        kept=kept,
        seconds=time.perf_counter() - started,
    )


def lift_off(result):
    """Load factor at which the pressure in the middle vanishes again."""
    touched = np.argmax(result.pressure > 0.0)
    after = touched + np.argmax(result.pressure[touched:] < 1e-3 * result.pressure.max())
    return result.factor[after] if after > touched else np.nan
