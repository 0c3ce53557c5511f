"""The law by default on displacements of degree 1: smooth pressures, forces that do not
depend on gamma, MOOSE's nodal pressures, and heat that is friction's work."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import conduction, field_space
from materials import lame
from problems import COMM, SOLVERS, build, fix, stack
from rigid_scenes import press

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    Flux,
    LoadSteps,
    NonlinearProblem,
    rigid,
    tools,
)

SLAVE, MASTER, HELD, LED = 1, 2, 3, 4
POINTS = AugmentedLagrangian(condition="points")


def by_nodes(contact):
    """Pressures at the slave's nodes, along x. For one rank."""
    p = contact.pressure()
    nodes = contact.zones[0].multiplier_nodes
    x = p.function_space.tabulate_dof_coordinates()[nodes, 0]
    return p.x.array[nodes][np.argsort(x)]


def unlike_blocks(cell, method, friction=None):
    """A block 0.64 wide, three times as stiff, pressed by 0.18 into one 1.3 wide, 9
    facets on 15: pressures at its nodes."""
    blocks = [
        Block((15, 6), (0.0, 0.0), (1.3, 0.5), tags={"bottom": HELD, "top": MASTER},
              body="lower"),
        Block((9, 5), (0.33, 0.5), (0.97, 0.82), tags={"bottom": SLAVE, "top": LED},
              body="upper"),
    ]  # fmt: skip
    names = {"bottom": HELD, "master": MASTER, "slave": SLAVE, "top": LED}
    bodies = {"lower": 1, "upper": 2}
    scene = Scene(*assemble_blocks(COMM, blocks, cell, 1), names, bodies)
    top = fem.Constant(scene.mesh, np.zeros(2))
    found = build(
        scene, 1, "neo-hookean", method, E={"lower": 1.0, "upper": 3.0},
        friction=friction,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", None, top)],
    )  # fmt: skip

    def apply(t):
        top.value[1] = -0.18 * t

    LoadSteps(SOLVERS[0](found.problem), apply, 3, progress=False).run()
    return by_nodes(found.contact)


def variation(p):
    """Total variation of a pressure over the least that one with its ends and its
    smallest value may have."""
    return np.abs(np.diff(p)).sum() / (p[0] + p[-1] - 2.0 * p.min())


@pytest.mark.parametrize("friction", [None, Coulomb(0.3)], ids=["none", "friction"])
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_pressures_of_unlike_blocks_hardly_swing(cell, friction):
    found = variation(unlike_blocks(cell, AugmentedLagrangian(), friction))
    published = variation(unlike_blocks(cell, POINTS, friction))
    assert found <= 1.3, found
    assert published > found + 0.15, published


def tool_forces(method, friction):
    """Force of a circle of radius 0.3, 0.04 deep in a block of 7 x 7 cells, over
    multiples of gamma."""
    forces = []
    for factor in (1.0, 0.1, 10.0):
        body = rigid.Body(rigid.Circle((0.5, 1.3), 0.3), name="tool")
        scene = press("quadrilateral", body, 7, method=method, friction=friction)
        scene.contact.set_gamma(factor * scene.contact.gamma)
        steps = LoadSteps(
            SOLVERS[0](scene.problem),
            lambda t: body.move((0.0, -0.04 * t)),
            2,
            progress=False,
        )
        steps.run()
        forces.append(scene.contact.resultant_on(body).force[1])
    return np.array(forces)


@pytest.mark.parametrize("friction", [None, Coulomb(0.3)], ids=["none", "friction"])
def test_forces_of_a_tool_do_not_depend_on_gamma(friction):
    found = tool_forces(None, friction)
    assert np.abs(found / found[0] - 1.0).max() <= 1e-8, found
    published = tool_forces(POINTS, friction)
    assert np.abs(published / published[0] - 1.0).max() > 0.03, published


# Normal and tangential tractions at the slave's nodes: contact/test/tests/pdass_problems
# of MOOSE, gold/frictional_bouncing_block
MOOSE = np.array([
    (161.49863939186, 109.95784246581, 110.15583833591, 115.338715561, 119.71308270928,
     123.3578328855, 126.72566574513, 131.09249208954, 138.51794407024, 162.85236802642,
     294.51242589152),
    (-59.323994134489, -17.720392400334, -12.022978102894, -3.8876032144149,
     3.2460503661366, 9.854281880372, 15.955898786817, 21.528153290068, 27.65187268276,
     27.139878265446, 92.791250617463),
])  # fmt: skip


def bouncing_block(method):
    """MOOSE's soft block that falls on a stiff long one and is led along it, mu 0.4:
    contact at t = 7."""
    blocks = [
        Block((10, 10), (-2.0, 0.0), (-1.0, 1.0), tags={"bottom": SLAVE, "top": LED},
              body="upper"),
        Block((49, 10), (-2.5, -1.0), (2.5, 0.0), tags={"top": MASTER, "bottom": HELD},
              body="lower"),
    ]  # fmt: skip
    mesh, cells, facets = assemble_blocks(COMM, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    mu, lmbda = lame(tools.by_body(mesh, cells, {1: 1e3, 2: 1e6}), 0.3)
    # MOOSE's rates sum up to Hooke's law of ln V for the Cauchy stress
    F, one = ufl.Identity(2) + ufl.grad(u), ufl.Identity(2)
    B = F * F.T
    apart = ufl.sqrt((B[0, 0] - B[1, 1]) ** 2 + 4.0 * B[0, 1] ** 2 + 1e-16)
    large, small = (0.5 * ufl.ln(0.5 * (ufl.tr(B) + s * apart)) for s in (1.0, -1.0))
    strain = 0.5 * (large + small) * one
    strain += (large - small) / apart * (B - 0.5 * ufl.tr(B) * one)
    cauchy = 2.0 * mu * strain + lmbda * ufl.tr(strain) * one
    nominal = ufl.det(F) * cauchy * ufl.inv(F).T
    form = ufl.inner(nominal, ufl.grad(v)) * ufl.dx(degree=4)
    # The upper block starts 0.21 above the lower one
    upper = fem.locate_dofs_topological(V, 2, cells.find(1))
    u.x.array[2 * upper + 1] = 0.21
    along, up = fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.21)
    bcs = [
        tools.prescribe(V, facets.find(HELD)),
        tools.prescribe(V, facets.find(LED), along, 0),
        tools.prescribe(V, facets.find(LED), up, 1),
    ]
    options = {"friction": Coulomb(0.4), "measure": "current"}
    contact = Contact(u, facets, [(SLAVE, MASTER)], method, **options)

    def apply(s):
        up.value = 0.2 * np.cos(0.7 * np.pi * s) + 0.01
        along.value = 0.14 * s

    problem = NonlinearProblem(form, contact, bcs=bcs)
    LoadSteps(SOLVERS[-1](problem), apply, 28, progress=False).run()
    return contact


def test_nodal_pressures_of_moose():
    contact = bouncing_block(None)
    off = np.abs(by_nodes(contact) / MOOSE[0] - 1.0)
    assert off.max() <= 2e-3, off
    lam = contact.traction()
    nodes = contact.zones[0].multiplier_nodes
    x = lam.function_space.tabulate_dof_coordinates()[nodes, 0]
    along = lam.x.array.reshape(-1, 2)[nodes, 0][np.argsort(x)]
    # Theirs is the friction of the other side
    assert np.abs(along + MOOSE[1]).max() <= 5e-3 * np.abs(MOOSE[1]).max()


def rubbed(facets, depth, method):
    """Heat of friction and friction's work, by step, of a block that is pressed on a
    wider one and led along it, on few facets."""
    scene = stack("quadrilateral", (5, facets), widths=[1.0, 0.5])
    V, W = tools.vector_space(scene.mesh, 1), field_space(scene.mesh, 1)
    u, T = fem.Function(V), fem.Function(W)
    pair = scene.tags["slave"], scene.tags["master"]
    contact = Contact(u, scene.facet_tags, [pair], method, friction=Coulomb(0.4))
    flux = Flux(
        contact, T, lambda T_s, T_m, p, g, v: p * (T_s - T_m), friction_heat=0.3
    )
    v, s = ufl.TestFunction(V), ufl.TestFunction(W)
    forms = [
        ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx,
        conduction(scene, T, 1.0) + T * s * ufl.dx,
    ]
    move = fem.Constant(scene.mesh, np.zeros(2))
    bcs = [
        tools.prescribe(V, scene.facet_tags.find(scene.tags["top"]), move),
        tools.prescribe(V, scene.facet_tags.find(scene.tags["bottom"])),
    ]
    problem = NonlinearProblem(forms, [contact, flux], bcs, u=[u, T])
    found = []
    for k in range(6):
        contact.dt = 0.1
        move.value[:] = 0.06 * k, -depth
        assert problem.solve()[1]
        rates = flux.rates()
        heat = (rates.slave_heat + rates.master_heat) * contact.dt
        found.append((heat, contact.friction_work()))
        contact.advance()
    return np.array(found)


NODES = AugmentedLagrangian(condition="nodes")


@pytest.mark.mpi
@pytest.mark.parametrize("facets", [1, 3, 8])
@pytest.mark.parametrize("depth", [0.002, 0.03])
@pytest.mark.parametrize(
    "method, bound", [(None, 1e-12), (NODES, 1e-5)], ids=["default", "nodes"]
)
def test_heat_of_friction_is_its_work(facets, depth, method, bound):
    """First steps on few facets arrive. Normals of nodes are not quite those of points,
    so that at nodes a part of the work is none of friction."""
    heat, work = rubbed(facets, depth, method).T
    assert work.sum() > 1e-6
    assert np.abs(heat - work).max() <= bound * work.sum()
