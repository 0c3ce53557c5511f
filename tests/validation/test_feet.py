"""Pressures in the frame of the master act on it at the slave point's foot (4.22): the
forces of both bodies balance over any coat and tilt, and are those of a potential."""

from __future__ import annotations

from dataclasses import replace

import corners
import gathered
import numpy as np
import pytest
import states
from balances import moments, nodal_forces, nodal_positions
from friction_states import FrictionCase, set_both
from states import CELLS, Case
from tangents import FIRST_STEPS, slopes, taylor_remainders

from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    LoadSteps,
    NewtonSolver,
    Penalty,
    rigid,
)

COAT = 0.08


def turned_contact(case, seed, friction=None, **options):
    """A random state of two blocks with a coat, in the frame of the master."""
    scene = case.scene("overhang")
    if friction is not None:
        options["friction"] = friction
    contact = states.make_contact(scene, case, frame="master", offset=-COAT, **options)
    states.set_state(contact, scene, "mixed", seed, noise=0.01)
    return contact


@pytest.mark.mpi(where=lambda case, **_: case.cell == "triangle")
@pytest.mark.parametrize(
    "method, mu", [("normal", 0.0), ("vector", 0.3), ("penalty", 0.0), ("penalty", 0.3)]
)
@pytest.mark.parametrize(
    "case",
    [
        Case(cell, degree, degree, measure=measure)
        for cell, degree in zip(CELLS, (1, 2, 2, 1))
        for measure in states.MEASURES
    ],
    ids=states.name_of,
)
def test_forces_and_moments_of_meshes_balance(case, method, mu):
    case = replace(case, method=method)
    contact = turned_contact(case, 3, Coulomb(mu) if mu else None)
    p = gathered.points(contact)
    closed = p["status"] > states.OPEN
    tilt = np.linalg.norm(p["normal"] + p["master_normal"], axis=1)[closed]
    assert tilt.max() > 0.01
    x, r = nodal_positions(contact), nodal_forces(contact)
    assert np.abs(r.sum(axis=0)).max() <= 1e-13 * np.abs(r).sum()
    turn = moments(x, r)
    assert np.abs(turn.sum(axis=0)).max() <= 1e-13 * np.abs(turn).sum()


@pytest.mark.parametrize("size, E", [(1.0, 1.0), (1e-3, 2e11)])
@pytest.mark.parametrize(
    "tilt, mu, method",
    [
        ((12.0,), 0.0, "normal"),
        ((12.0,), 0.2, "vector"),
        ((12.0,), 0.2, "penalty"),
        ((8.0, -6.0), 0.0, "penalty"),
    ],
)
def test_a_free_plate_is_in_balance(tilt, mu, method, size, E):
    """A corner with a coat on a plate that is free to turn: the moments of the block's
    support and of what holds the plate."""
    gdim = 1 + len(tilt)
    shape, up = corners.flat_tool("line", gdim), np.eye(gdim)[-1]
    shape = type(shape)(-COAT * size * up, up)
    turns = ("r",) if gdim == 2 else ("rx", "ry")
    body = rigid.Body(
        shape,
        free=("xyz"[gdim - 1], *turns),
        stiffness={"xyz"[gdim - 1]: 5.0 * E * size ** (gdim - 2)}
        | dict.fromkeys(turns, 2.0 * E * size**gdim),
    )
    laws = {
        "normal": lambda: AugmentedLagrangian(),
        "vector": lambda: AugmentedLagrangian(),
        "penalty": lambda: Penalty(40.0 * E / size),
    }
    scene = corners.block_on(
        body,
        corners.turned(gdim, *tilt),
        n=4 if gdim == 2 else 2,
        cell="quadrilateral" if gdim == 2 else "hexahedron",
        method=laws[method](),
        friction=Coulomb(mu) if mu else None,
        offset=-COAT * size,
        size=size,
        E=E,
    )
    down = -0.03 * up
    forces = scene.path([down, down + 0.02 * np.eye(gdim)[0]], steps=2)
    assert np.abs(forces[-1]).max() > 1e-4 * E * size ** (gdim - 1)
    on = scene.contact.results.resultant_on(body)
    x, r = nodal_positions(scene.contact), nodal_forces(scene.contact)
    slave = -moments(x, r).sum(axis=0)  # of contact on the block
    place = body.place[None, :gdim]
    whole = np.atleast_1d(on.moment) + moments(place, on.force[None])[0]
    scale = size * np.abs(r).sum()
    assert np.abs(slave + whole).max() <= 1e-9 * scale
    # What holds the plate: its springs, by its own equations
    free = body.freedom
    held = free.totals[free.is_turn] * 2.0 * E * size**gdim
    found = np.atleast_1d(on.moment)
    found = found if gdim == 2 else found[:2]
    assert found == pytest.approx(held, abs=1e-7 * scale)


@pytest.mark.parametrize("kind", ("mesh", "free"))
@pytest.mark.parametrize("tilt", ((15.0,), (10.0, -12.0)))
def test_forces_are_those_of_the_stored_energy(kind, tilt):
    """Of a penalty without friction, on what is flat; by differences."""
    gdim = 1 + len(tilt)
    up = np.eye(gdim)[-1]
    free = ("x", "y", "r") if gdim == 2 else ("z", "rx", "ry", "rz")
    shape = type(corners.flat_tool("line", gdim))(-COAT * up, up)
    scene = corners.block_on(
        None if kind == "mesh" else rigid.Body(shape, free=free),
        corners.turned(gdim, *tilt),
        n=3 if gdim == 2 else 2,
        cell="triangle" if gdim == 2 else "tetrahedron",
        method=Penalty(7.0),
        offset=-0.1 if kind == "mesh" else -COAT - 0.05,
        frame="master",
        tangent="fixed",
    )
    contact, rng = scene.contact, np.random.default_rng(2)
    contact.update()
    U = states.unknowns(contact)
    d = rng.normal(size=U.size)
    h, energies = 1e-6, []
    for step in (h, -h):
        states.residual_at(contact, U + step * d)
        energies.append(contact.stored_energy())
    R = states.residual_at(contact, U)
    slope = (energies[0] - energies[1]) / (2.0 * h)
    assert abs(slope) > 1e-3
    assert R @ d == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("mu", (0.0, 0.3))
@pytest.mark.parametrize("tangent", ("fixed", "full"))
@pytest.mark.parametrize("method", ("augmented", "elastic", "normal"))
@pytest.mark.parametrize("cell", CELLS)
def test_remainders_with_a_coat_that_varies(cell, method, tangent, mu):
    """Bent facets of all shapes; with moving segments the coat varies along them."""
    if (method == "normal") == (mu > 0.0):
        return
    degrees = {"triangle": (2, 2), "tetrahedron": (2, 2)}.get(cell, (1, 1))

    def coat(x):
        return -0.05 - 0.02 * np.sin(3.0 * x[0] + x[1])

    case = FrictionCase(cell, *degrees, method, "current")
    scene = case.scene("single")
    options = dict(frame="master", offset=coat, tangent=tangent)
    for seed in range(40):
        if mu:
            contact = case.contact(scene, Coulomb(mu), **options)
            set_both(contact, scene, seed)
        else:
            contact = states.make_contact(scene, case, **options)
            states.set_state(contact, scene, "active", seed)
        K = states.tangent(contact, states.mass_form(contact.u.function_space))
        U, R = states.unknowns(contact), states.assembled(contact)
        d = np.random.default_rng(seed).normal(size=U.size)
        for first in FIRST_STEPS:
            steps = first * 10.0 ** -np.arange(0.0, 3.1, 0.5)
            remainders = taylor_remainders(contact, K, U, R, d, steps)
            states.residual_at(contact, U)
            if remainders is not None:
                found = slopes(steps, remainders)
                assert np.all(np.abs(found - 2.0) <= 0.05), found
                return
    raise AssertionError("no random state without a kink nearby")
