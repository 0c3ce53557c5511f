"""Adhesion within a problem: balances, tangent, steps, checkpoints, fields, refusals."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
from adhering import TOUGHNESS, Blocks, criticals, glue
from dolfinx import fem
from problems import COMM
from tangents import remainders_in_petsc, slopes

from raymortar import (
    Checkpoint,
    Cohesive,
    Contact,
    ContactError,
    History,
    LoadSteps,
    Penalty,
    Tie,
    rigid,
)

# Invariances


@pytest.mark.mpi
@pytest.mark.parametrize("cell, degree", [("quadrilateral", 2), ("hexahedron", 1)])
def test_rigid_motions_are_free_and_forces_balance(cell, degree):
    """Of a pair with a gap that turns; and of any state forces and moments."""
    blocks = Blocks(
        cell, degree, law=glue(within=0.1), gap=0.05, material="neo-hookean"
    )
    u, dim = blocks.model.u, blocks.model.dim
    V = u.function_space
    X = V.tabulate_dof_coordinates()[:, :dim]
    c, s = np.cos(2.0), np.sin(2.0)
    Q = np.eye(dim)
    Q[:2, :2] = [[c, -s], [s, c]]
    size = 2000.0 * 0.05

    def forces(values):
        u.x.array[:] = values.ravel()
        u.x.scatter_forward()
        blocks.contact.unknowns.pull()
        return blocks.bond.forces(())

    turned = forces(X @ Q.T - X + 0.3)
    assert np.abs(turned).max(initial=0.0) < 1e-11 * size
    assert COMM.allreduce(blocks.bond.points()["damage"].sum()) < 1e-11
    bent = 0.02 * np.sin(3.0 * X + 1.0) + 0.02 * (X[:, -1:] > 1.02)
    f = forces((X + bent) @ Q.T - X).reshape(-1, dim)
    x = ((X + bent) @ Q.T)[: len(f)]
    total = COMM.allreduce(f.sum(axis=0))
    moment = x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]
    scale = COMM.allreduce(np.abs(f).sum())
    assert scale > 0.1
    assert np.abs(total).max() < 1e-12 * scale
    assert abs(COMM.allreduce(moment.sum())) < 1e-12 * scale


@pytest.mark.mpi
@pytest.mark.parametrize("state", ["loading", "unloading", "pressed"])
@pytest.mark.parametrize(
    "cell, degree",
    [
        ("triangle", 1),
        ("quadrilateral", 2),
        ("hexahedron", 1),
        ("tetrahedron", 2),
    ],
)
def test_tangent_with_moving_segments(cell, degree, state):
    """Taylor remainders of the whole residual fall with the square of the step."""
    blocks = Blocks(cell, degree, material="neo-hookean", method=Penalty(500.0))
    u, dim = blocks.model.u, blocks.model.dim
    X = u.function_space.tabulate_dof_coordinates()[:, :dim]
    law = blocks.bond.law
    scale = criticals(law)[0]
    cells = blocks.model.scene.cell_tags
    dofs = fem.locate_dofs_topological(
        u.function_space, dim, cells.find(blocks.model.scene.bodies["upper"])
    )
    upper = np.zeros((len(X), 1))
    upper[dofs] = 1.0
    rng = np.random.default_rng(5)
    wave = 0.05 * np.sin(2.0 * X @ rng.normal(size=(dim, dim)) + 1.0)
    way = np.full(dim, 0.25)
    way[-1] = -0.1 if state == "pressed" else 0.35

    def set_u(share):
        u.x.array[:] = (scale * (share * upper * way + wave)).ravel()
        u.x.scatter_forward()
        blocks.contact.unknowns.pull()

    if state == "unloading":
        set_u(1.6)
        blocks.contact.update()
        blocks.contact.advance()
    set_u(1.0)
    x = blocks.problem.start()
    damage = blocks.bond.points()["damage"]
    assert np.logical_and(damage > 0.0, damage < 1.0).all()
    direction = x.duplicate()
    size = direction.getLocalSize()
    direction.array[:] = scale * np.random.default_rng(7 + COMM.rank).normal(size=size)
    fixed = np.flatnonzero(blocks.problem.prescribed)
    direction.array[fixed] = x.array[fixed] = 0.0
    steps = 10.0 ** -np.arange(2.5, 4.6, 0.5)
    found = slopes(steps, remainders_in_petsc(blocks.problem, x, direction, steps))
    assert np.all(np.abs(found - 2.0) < 0.1), found


# Steps


def test_halved_steps_and_states_take_damage_back():
    """A step that fails is halved; a restored state has the damage of its time."""
    blocks = Blocks(modulus=400.0)
    critical = criticals(blocks.bond.law)[0]
    history = History(blocks.problem)
    blocks.solver.snes.setTolerances(max_it=2)

    def apply(t):
        blocks.top.value[1] = 1.5 * critical * t

    states, taken = [], []

    def accept():
        states.append(blocks.contact.state())
        taken.append(blocks.bond.dissipated())

    steps = LoadSteps(
        blocks.solver, apply, steps=4, history=history, on_accept=accept
    ).run()
    assert sum(step.halvings for step in steps) > 0
    np.testing.assert_allclose(history["adhesion_work"][-1], TOUGHNESS[0], 1e-6)
    assert np.all(np.diff(history["adhesion_work"]) >= 0.0)
    assert history["stored_adhesion"][-1] == 0.0
    halfway = [k for k, one in enumerate(taken) if 0.0 < one < 0.99 * TOUGHNESS[0]]
    assert len(halfway) > 1
    for k in reversed(halfway):
        blocks.contact.restore(states[k])
        np.testing.assert_allclose(blocks.bond.dissipated(), taken[k], 1e-12)


@pytest.mark.mpi
def test_a_checkpoint_has_damage(tmp_path):
    """A path that stops and goes on ends as one that does not."""
    path = COMM.bcast(tmp_path) / "torn.chk"
    found = []
    for stops in (False, True):
        blocks = Blocks(modulus=1e4)
        critical = criticals(blocks.bond.law)[0]
        blocks.lead(0.1 * critical, 0.4 * critical)
        if stops:
            Checkpoint(blocks.problem, path).write(0.4)
            blocks = Blocks(modulus=1e4)
            assert Checkpoint(blocks.problem, path).read() == 0.4
        assert blocks.bond.dissipated() > 0.0
        force = blocks.lead(0.0, 0.3 * critical)
        found.append([*force, blocks.bond.dissipated(), blocks.bond.stored()])
    np.testing.assert_allclose(found[1], found[0], 1e-9)


@pytest.mark.mpi
def test_damage_is_a_field():
    """One half of the surface is bonded, by where; damage is zero off it."""
    law = glue(where=lambda x: x[0] < 0.5)
    blocks = Blocks(law=law)
    assert abs(blocks.bond.area - 0.5) < 0.15
    blocks.lead(0.0, 0.5 * criticals(law)[0])
    (f,) = (f for f in blocks.contact.fields() if f.name == "damage")
    x = f.function_space.tabulate_dof_coordinates()
    assert COMM.allreduce(float(f.x.array.max(initial=0.0)), op=MPI.MAX) > 0.5
    far = f.x.array[: len(x)][x[:, 0] > 0.8]
    assert not far.any()


# Refusals


@pytest.mark.parametrize(
    "given, text",
    [
        ({"strength": -1.0}, "strength = -1.0 must be a positive number"),
        ({"strength": (1.0, 2.0, 3.0)}, "must be a number, or a pair"),
        ({"toughness": 0.0}, "toughness = 0.0 must be a positive number"),
        ({"toughness": (1.0, np.nan)}, "toughness = nan must be a positive number"),
        ({"mode": "mean"}, "mode must be one of"),
        ({"exponent": 0.5}, "exponent = 0.5 must be at least 1"),
        ({"elastic": 1.0}, "elastic = 1.0 must be between 0 and 1"),
        ({"within": 0.0}, "within = 0.0 must be a positive number"),
        ({"where": 3}, "where = 3 must be a function"),
    ],
)
def test_laws_that_do_not_exist(given, text):
    with pytest.raises(ContactError, match=text):
        Cohesive(**({"strength": 1.0, "toughness": 1.0} | given)).check()


def test_contacts_that_cannot_adhere():
    """Rigid masters, surfaces that meet themselves, ties, surfaces that are apart."""
    blocks = Blocks()
    scene, u = blocks.model.scene, blocks.model.u
    slave, master = scene.tags["slave"], scene.tags["master"]

    def made(pairs, law=None, **options):
        law = glue() if law is None else law
        return Contact(u, scene.facet_tags, pairs, adhesion=law, **options)

    plane = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    for pairs, law, options, text in (
        ([(slave, plane)], None, {}, "adhesion needs masters with facets"),
        ("all", None, {"method": Penalty()}, "does not adhere to itself"),
        ([(slave, master)], 3.0, {}, "adhesion must be a Cohesive"),
        (
            [(slave, master)],
            glue(where=lambda x: x[0] > 9.0),
            {},
            "adhesion bonds no point",
        ),
        ([(slave, master)], glue(where=lambda x: x[0]), {}, "True or False for each"),
    ):
        with pytest.raises(ContactError, match=text):
            made(pairs, law, **options)
    with pytest.raises(ContactError, match="a Tie takes no adhesion: it never opens"):
        Tie(u, scene.facet_tags, [(slave, master)], adhesion=glue())
    with pytest.raises(ContactError, match="adhesion is a term of a problem"):
        made([(slave, master)]).bond.dissipated()
