"""Adhesion by the bilinear cohesive law against closed forms: the law alone, blocks that
open and shear, a double cantilever beam."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from adhering import HEIGHT, STRENGTH, TOUGHNESS, Blocks, criticals, glue
from dolfinx import fem
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    Cohesive,
    Contact,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    tools,
)
from raymortar.adhesion.points import opening_of
from raymortar.core.discretization.facets import interpolate

MODES = [("benzeggagh-kenane", None), ("benzeggagh-kenane", 1.45), ("power", 1.0)]
MODES += [("power", 2.0)]

# The law


@pytest.mark.parametrize("mode, exponent", MODES)
@pytest.mark.parametrize("mixity", [0.0, 0.3, 0.8, 1.0])
def test_a_path_takes_the_toughness_of_its_mode(mode, exponent, mixity):
    """Of a straight path to separation, by the work of tractions: the closed form."""
    law = glue(mode=mode, exponent=exponent)
    G, H = TOUGHNESS
    m = law.exponent or 2.0
    exact = G + (H - G) * mixity**m
    if mode == "power":
        exact = (((1.0 - mixity) / G) ** m + (mixity / H) ** m) ** (-1.0 / m)
    energy = 2.0 * exact / law.elastic  # twice the springs', at separation
    s = np.linspace(0.0, 1.0, 200001)
    total = energy * s**2
    r = law.respond((1.0 - mixity) * total, mixity * total, np.zeros(len(s)))
    # t . d delta = (1 - D) dE / 2
    traction = (1.0 - r.damage) * energy * s
    work = 0.5 * np.sum((traction[1:] + traction[:-1]) * np.diff(s))
    np.testing.assert_allclose(work, exact, 1e-7)
    np.testing.assert_allclose(r.dissipated[-1], exact, 1e-13)
    assert r.damage[-1] == 1.0


@pytest.mark.parametrize("mode, exponent", MODES)
def test_slopes_of_damage(mode, exponent):
    """Against differences, in both modes and in SI units."""
    for unit in (1.0, 1e9):
        law = glue(unit, mode=mode, exponent=exponent)
        rng = np.random.default_rng(2)
        normal, shear = unit * 20.0 * rng.uniform(0.05, 0.45, (2, 50))
        none, h = np.zeros(50), 1e-6 * unit
        r = law.respond(normal, shear, none)
        assert (r.by_normal > 0.0).all() and (r.damage < 1.0).all()
        for slope, step in ((r.by_normal, (h, 0.0)), (r.by_shear, (0.0, h))):
            ends = [
                law.respond(normal + k * step[0], shear + k * step[1], none).damage
                for k in (1.0, -1.0)
            ]
            np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2.0 * h), 2e-6)
        kept = law.respond(normal, shear, np.ones(50))
        assert not kept.by_normal.any() and not kept.dissipated.any()


@pytest.mark.parametrize("d", [2, 3])
def test_derivatives_of_openings(d):
    """First and second derivatives of the jump along the normal, by differences."""
    rng, h = np.random.default_rng(d), 1e-6
    y = rng.normal(size=(6, d, d))
    at = opening_of(y)
    for k, i in np.ndindex(d, d):
        ends = []
        for sign in (1.0, -1.0):
            moved = y.copy()
            moved[:, k, i] += sign * h
            ends.append(opening_of(moved))
        rate = (ends[0].along - ends[1].along) / (2.0 * h)
        np.testing.assert_allclose(at.slopes[:, k, i], rate, 1e-6, 1e-7)
        rate = (ends[0].slopes - ends[1].slopes) / (2.0 * h)
        np.testing.assert_allclose(at.bends[:, :, :, k, i], rate, 1e-6, 1e-6)


# Blocks


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, degree, unit",
    [("quadrilateral", 1, 1.0), ("triangle", 2, 1e9), ("hexahedron", 1, 1.0)],
)
def test_uniform_opening(cell, degree, unit):
    """The strength is exact, and separation takes toughness times area."""
    blocks = Blocks(cell, degree, unit=unit)
    law, bond = blocks.bond.law, blocks.bond
    assert abs(bond.area - 1.0) < 1e-12
    up = np.eye(blocks.model.dim)[-1]
    first = law.elastic * criticals(law)[0] + STRENGTH[0] * HEIGHT / 2000.0
    for share in (0.5, 1.0):
        force = blocks.lead(*(share * first * up))
        exact = share * unit * STRENGTH[0] * up
        np.testing.assert_allclose(force, exact, 1e-8, 1e-8 * unit)
    assert bond.dissipated() < 1e-7 * unit * TOUGHNESS[0]
    assert blocks.lead(*(1.1 * first * up))[-1] < unit * STRENGTH[0]
    for opening in (0.3, 0.6, 1.1):
        force = blocks.lead(*(opening * criticals(law)[0] * up))
    assert not force.any() and bond.stored() == 0.0
    np.testing.assert_allclose(bond.dissipated(), unit * TOUGHNESS[0], 1e-6)
    assert (bond.points()["damage"] == 1.0).all()


def test_unloading_goes_along_the_secant():
    """Down and up again on one line, to where damage began to grow again."""
    blocks = Blocks(modulus=1e9)
    critical = criticals(blocks.bond.law)[0]
    most = blocks.lead(0.0, 0.5 * critical)[1]
    taken, damage = blocks.bond.dissipated(), blocks.bond.points()["damage"]
    for share in (0.4, 0.1, 0.3, 0.5):
        force = blocks.lead(0.0, share * critical)[1]
        np.testing.assert_allclose(force, share / 0.5 * most, 1e-6)
    np.testing.assert_allclose(blocks.bond.points()["damage"], damage, 1e-7)
    np.testing.assert_allclose(blocks.bond.dissipated(), taken, 1e-6)
    pressed = blocks.lead(0.0, -1e-9)
    assert abs(pressed[1]) < 1e-12  # the contact has the pressure


@pytest.mark.parametrize("mode", ["benzeggagh-kenane", "power"])
@pytest.mark.parametrize("slope", [0.5, 1.5])
def test_mixed_modes_of_stiff_blocks(mode, slope):
    """A straight path takes the toughness of its share of shear."""
    blocks = Blocks(modulus=1e9, law=glue(mode=mode))
    law, critical = blocks.bond.law, criticals(blocks.bond.law)[1]
    K_n, K_s = law.stiffness
    mixity = K_s * slope**2 / (K_n + K_s * slope**2)
    for opening in (0.05, 0.2, 0.5, 1.2):
        blocks.lead(slope * opening * critical, opening * critical)
    G, H = TOUGHNESS
    exact = G + (H - G) * mixity**2
    if mode == "power":
        exact = 1.0 / ((1.0 - mixity) / G + mixity / H)
    np.testing.assert_allclose(blocks.bond.dissipated(), exact, 1e-5)


def test_friction_remains_after_separation():
    """Pressed blocks are sheared apart: adhesion adds to friction, which then stays."""
    blocks = Blocks(modulus=1e5, friction=Coulomb(0.5))
    slide = criticals(blocks.bond.law)[1]
    pressure = 1e5 * 1e-4 / HEIGHT
    blocks.lead(0.0, -1e-4)
    for share in (0.01, 0.2, 0.5, 1.2):
        blocks.lead(share * slide, -1e-4)
    blocks.top.value[:] = 1.3 * slide, -1e-4
    blocks.solver.solve()
    assert not blocks.bond.force().any()
    # Shear bends the blocks, opens an end, and tilts the normals
    found = blocks.contact.resultant()
    assert found.force[1] > 0.5 * pressure
    sizes = [np.linalg.norm(one) for one in (found.tangential, found.normal)]
    np.testing.assert_allclose(sizes[0], 0.5 * sizes[1], 1e-6)
    np.testing.assert_allclose(blocks.bond.dissipated(), TOUGHNESS[1], 1e-6)


def test_adhesion_alone_holds_a_body():
    """A block hangs on its adhesion, which carries its load."""
    blocks = Blocks()
    scene, u = blocks.model.scene, blocks.model.u
    v = ufl.TestFunction(u.function_space)
    contact = Contact(
        u,
        scene.facet_tags,
        [(scene.tags["slave"], scene.tags["master"])],
        adhesion=glue(),
    )
    strain = ufl.sym(ufl.grad(u))
    F = ufl.inner(2000.0 * strain, ufl.grad(v)) * ufl.dx
    weight = fem.Constant(scene.mesh, np.array([0.0, 2.0]))
    F -= ufl.inner(weight, v) * ufl.dx
    problem = NonlinearProblem(F, contact, blocks.problem.bcs[:1])
    problem.solve()
    np.testing.assert_allclose(contact.bond.force(), [0.0, -2.0], 1e-7, 1e-7)


def test_strong_glue_lets_go_of_a_soft_body_that_is_pressed_lightly():
    """Pressures far below the strength close points by more than rounding."""
    E, d = 1.0, 1e-4
    blocks = Blocks(modulus=E, law=glue(1e4), method=Penalty())
    blocks.lead(0.0, -d)
    assert len(blocks.problem.history) <= 6
    force = blocks.contact.resultant().force[1]
    np.testing.assert_allclose(force, E * d / HEIGHT, 0.1)
    np.testing.assert_allclose(blocks.bond.force(), 0.0, atol=1e-9 * force)


def test_double_cantilever_beam():
    """While the crack grows, P = sqrt(G E I) / a of slender arms, theory of beams."""
    E, G, length, first, end = 1e5, 0.12, 45.0, 30.0, 36.0
    mesh, _, facets = assemble_blocks(
        COMM,
        [
            Block((90, 1), (0.0, 0.0), (length, 1.0), tags={"top": 4, "left": 6}),
            Block((90, 1), (0.0, 1.0), (length, 2.0), tags={"bottom": 3, "left": 5}),
        ],
        "quadrilateral",
        1,
    )
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V), ufl.TestFunction(V)
    law = Cohesive(30.0, G, where=lambda x: x[0] > first)
    # Newton's method would open a closed crack facet by facet
    contact = Contact(
        u,
        facets,
        [(3, 4)],
        Penalty(),
        adhesion=law,
        offset=lambda x: np.where(x[0] < first, 0.01, 0.0),
        quadrature_degree=8,
    )
    F = E * ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx
    lifts = [fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.0)]
    ends = [
        fem.dirichletbc(
            lift, fem.locate_dofs_topological(V.sub(1), 1, facets.find(tag)), V.sub(1)
        )
        for lift, tag in zip(lifts, (5, 6))
    ]
    far = fem.locate_dofs_geometrical(V, lambda x: x[0] > length - 1e-9)
    problem = NonlinearProblem(
        F, contact, [*ends, fem.dirichletbc(np.zeros(2), far, V)]
    )
    bending = E / 12.0
    found = []

    def apply(t):
        # Half the opening of arms of the length a
        a = first + (end - first) * max(t, 0.0)
        opened = a**2 * np.sqrt(G / bending) / 3.0 * min(1.0 + 0.5 * t, 1.0)
        lifts[0].value, lifts[1].value = opened, -opened

    def measure():
        points = contact.bond.points()
        surface = contact.zones[0].facets.slave_surface
        nodes = surface.X[surface.facet_nodes[points["slave"]]]
        x = interpolate("interval", surface.node_degree, nodes, points["xi"])[:, 0]
        whole = points["damage"] == 1.0
        a = x[whole].max(initial=first)
        force = problem.reactions({"end": ends[0]})["end"][1]
        found.append((a, force * a / np.sqrt(G * bending)))

    LoadSteps(
        problem.snes_solver, apply, steps=12, path=(-2.0, 1.0), on_accept=measure
    ).run()
    a, ratio = np.array(found).T
    grown = a > first + 1.0
    assert np.count_nonzero(grown) >= 2
    assert np.all(np.abs(ratio[grown] - 1.0) < 0.05), (a, ratio)
    # What damage has taken is the toughness times the crack's growth, and a zone ahead
    taken = contact.bond.dissipated() / G
    assert a[-1] - first < taken < a[-1] - first + 2.0
