"""Friction over several steps: holding, rotations, failure and restart."""

from __future__ import annotations

import numpy as np
import pytest
from materials import lame
from problems import worst
from rotations import turn
from sheared_blocks import (
    HEIGHT,
    HOLDING,
    METHODS,
    NU,
    SHEAR,
    SLIP,
    SOFT,
    STICK,
    Blocks,
    E,
    limit_of,
    nominal,
    perturb,
    pressed_and_sheared,
    turn_guess,
)

from raymortar import ConvergenceError, Coulomb, LoadSteps, Penalty, Stick, Tresca

# Holding (E7)


@pytest.mark.mpi(where=lambda cell, method: cell == "quadrilateral")
@pytest.mark.parametrize("method", METHODS)
def test_held_block_keeps_its_force(cell, method, record_property):
    """Sheared to half the limit, held for 20 steps. The rate form creeps: a step
    leaves 1 / (1 + G / (gamma H)) of the shear in a block of height H."""
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.5))
    blocks.press()
    k = 0.5 * limit_of(Coulomb(0.5), blocks.dim)
    # With penalty the top goes where k is left after the slip of this step
    blocks.step(k, SHEAR * k / blocks.gamma)
    forces = [blocks.contact.resultant().tangential]
    for _ in range(20):
        blocks.contact.advance()
        if method == "rate":
            k /= 1.0 + SHEAR / (blocks.gamma * HEIGHT)
            blocks.load(k, np.eye(blocks.dim))
        blocks.problem.solve()
        assert blocks.statuses() == {STICK}
        forces.append(blocks.contact.resultant().tangential)
    size = np.linalg.norm(forces, axis=1)
    change = abs(size[-1] / size[0] - 1.0)
    record_property("creep", change)
    if method != "rate":
        assert np.abs(size / size[0] - 1.0).max() <= 1e-8
        return
    share = 1.0 / (1.0 + SHEAR / (blocks.gamma * HEIGHT))
    np.testing.assert_allclose(size[1:] / size[:-1], share, rtol=1e-9)
    assert size[-1] < 0.6 * size[0]


# From the edge of the cone


@pytest.fixture
def slid(cell, method, law):
    """Blocks of which all points slipped in the accepted step."""
    blocks = Blocks(cell, METHODS[method](), law)
    blocks.press()
    k = limit_of(law, blocks.dim)
    for slide in (0.02, 0.05):
        blocks.step(k, slide + blocks.spring(k))
        assert blocks.statuses() == {SLIP}
        blocks.contact.advance()
    return blocks


on_the_edge = pytest.mark.parametrize(
    "law", [Coulomb(0.3), Coulomb(1.0), Tresca(0.2)], ids=str
)


@pytest.mark.mpi(
    where=lambda cell, law, **_: law == Coulomb(0.3)
    and cell in ("triangle", "hexahedron")
)
@pytest.mark.parametrize("method", HOLDING)
@on_the_edge
def test_unloading_from_the_edge_of_the_cone_takes_one_iteration(slid, method, law):
    """Shear is linear in k at a height: all that may ask for more is a point that slips
    in the first iterate. Traction and bound are equal, but for rounding."""
    k = limit_of(law, slid.dim)
    slid.contact.update()
    assert slid.statuses() == {STICK}
    for share in (0.5, 0.0, -0.9):
        # Where the last slide has left the foot of the block
        slid.drive(share * k, 0.05 + slid.spring(k) * share)
        assert slid.problem.solve(rtol=1e-8) == 1
        assert slid.statuses() == {STICK}
        slid.contact.advance()


@pytest.mark.mpi(
    where=lambda cell, law, **_: law == Coulomb(0.3) and cell == "hexahedron"
)
@pytest.mark.parametrize("method", HOLDING)
@on_the_edge
def test_hold_after_a_slide_is_stick(slid, method, law):
    """From a state in balance: one iteration takes what the slide's tolerance has left,
    a second one may show that there is no more."""
    force = slid.contact.resultant().force
    for _ in range(3):
        assert slid.problem.solve() <= 2
        assert slid.statuses() == {STICK}
        assert worst(slid.contact.resultant().force - force) <= 1e-9 * worst(force)
        slid.contact.advance()


# Rotations of a loaded pair (F1)


@pytest.mark.mpi(
    where=lambda cell, steps, **_: steps == 1 and cell in ("triangle", "hexahedron")
)
@pytest.mark.parametrize("steps", [1, 6])
@pytest.mark.parametrize("method", HOLDING)
def test_rotation_of_a_loaded_pair_is_no_slip(cell, method, steps, record_property):
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.5))
    blocks.press()
    k = 0.5 * limit_of(Coulomb(0.5), blocks.dim)
    slide = blocks.spring(k)
    blocks.step(k, slide)
    blocks.contact.advance()
    gradient = np.eye(blocks.dim) + blocks.problem.gradient()
    rng = np.random.default_rng(7)
    part = turn(blocks.dim, np.deg2rad(60.0 / steps), rng)
    Q = np.eye(blocks.dim)
    for i in range(steps):
        Q = part @ Q
        u = blocks.drive(k, slide, Q)
        turn_guess(blocks.problem, part)
        perturb(blocks.problem, i)
        blocks.problem.solve()
        assert blocks.statuses() == {STICK}
        assert worst(blocks.contact.points()["slip"]) <= 1e-10
        blocks.contact.advance()
    t = -Q @ nominal(blocks.dim, k)[:, -1]
    p = blocks.contact.points()
    turned = np.eye(blocks.dim) + blocks.problem.gradient()
    C, C_0 = (np.einsum("...ki,...kj", F, F) for F in (turned, gradient))
    figures = [
        worst(p["traction"][p["status"] == STICK] - t) / np.linalg.norm(t),
        worst(C - C_0),
        worst(blocks.problem.u.x.array - u.ravel()),
    ]
    record_property("rotation", figures)
    assert figures[0] <= 1e-7 and figures[1] <= 1e-8 and figures[2] <= 1e-8
    change = worst(energy(turned) - energy(gradient))
    assert change <= 1e-8 * worst(energy(gradient))


def energy(F):
    """Strain energy density."""
    mu, lmbda = lame(E, NU)
    log = np.log(np.linalg.det(F))
    I_1 = np.einsum("...ij,...ij", F, F)
    return mu / 2 * (I_1 - F.shape[-1] - 2 * log) + lmbda / 2 * log**2


@pytest.mark.mpi(where=lambda cell: cell == "quadrilateral")
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron", "hexahedron"])
def test_springs_of_a_clamped_pair_turn_with_it(cell, record_property):
    """A state that is not homogeneous: traction in global coordinates would be cut
    to cos 60 degrees, and the strain change by 1e-2."""
    problem, move, push = pressed_and_sheared(cell, Penalty(30.0), Stick())
    contact = problem.contact
    for _ in range(5):  # the springs settle in their space on the facets
        problem.solve()
        contact.advance()
    force = contact.resultant().force
    F = np.eye(problem.dim) + problem.gradient()
    Q = turn(problem.dim, np.deg2rad(60.0), np.random.default_rng(2))
    move(push, Q)
    turn_guess(problem, Q)
    perturb(problem, 1)
    problem.solve()
    turned = np.eye(problem.dim) + problem.gradient()
    C, C_0 = (np.einsum("...ki,...kj", A, A) for A in (turned, F))
    figures = [worst(C - C_0), worst(contact.resultant().force - Q @ force)]
    record_property("springs", figures)
    assert max(figures) <= 1e-6
    assert worst(contact.points()["slip"]) <= 1e-7


# History


@pytest.mark.mpi
@pytest.mark.parametrize("method", METHODS)
def test_failed_step_leaves_the_history(method):
    problem, move, push = pressed_and_sheared("quadrilateral", SOFT[method]())
    contact, before = problem.contact, problem.contact.state()
    push[0] += 0.02
    move(push)
    problem.solver.max_it = 1
    with pytest.raises(ConvergenceError):
        problem.solve()
    after = contact.state()
    accepted = [name for name in before if name.startswith(("accepted", "springs"))]
    has_multiplier = contact.multiplier is not None
    springs = {"augmented": 1, "elastic": 2, "rate": 0}[method]
    assert len(accepted) == 1 + springs + has_multiplier
    for name in accepted:
        np.testing.assert_array_equal(after[name], before[name])


def run(problem, move, push, shears):
    """Solve and accept; unknowns and contact force at the end."""
    for push[0] in shears:
        move(push)
        problem.solve()
        problem.contact.advance()
    contact = problem.contact
    lam = contact.multiplier
    return [
        problem.u.x.array.copy(),
        contact.points()["traction"],
        np.zeros(1) if lam is None else lam.x.array.copy(),
    ]


# Not with penalty on hexahedra: there full Newton steps cycle at the onset of slip,
# and what is tested here does not depend on the cell
@pytest.mark.mpi(where=lambda cell, method: cell == "quadrilateral")
@pytest.mark.parametrize(
    "cell, method",
    [("quadrilateral", method) for method in METHODS] + [("hexahedron", "augmented")],
)
def test_restored_state_gives_the_same_path(cell, method):
    problem, move, push = pressed_and_sheared(cell, SOFT[method]())
    state, shears = problem.contact.state(), (0.035, 0.04)
    first = run(problem, move, push, shears)
    run(problem, move, push, (0.02, 0.0))
    problem.contact.restore(state)
    for one, two in zip(first, run(problem, move, push, shears)):
        assert worst(one - two) <= 1e-12 * max(worst(one), 1.0)


@pytest.mark.mpi
@pytest.mark.parametrize("method", HOLDING)
def test_halved_steps_are_steps_of_that_size(method):
    """A failure within LoadSteps leaves no trace."""
    results = []
    for sabotaged in (True, False):
        problem, move, push = pressed_and_sheared("quadrilateral", SOFT[method]())
        push_0 = push.copy()
        # Paths are solved to 1e-14, as their corrections end below tolerances
        problem.solver.rtol = 1e-12
        failures = [0.5] if sabotaged else []

        def apply(t):
            move(push_0 + 0.06 * t * np.eye(problem.dim)[0])
            problem.solver.max_it = 25
            if failures and t > failures[0]:
                failures.pop()
                problem.solver.max_it = 1

        if sabotaged:
            steps = LoadSteps(problem.solver, apply, steps=2).run()
            factors = [step.factor for step in steps]
            assert steps[-1].halvings == 1 and len(factors) == 3
        else:
            for t in factors:
                apply(t)
                problem.solve()
                problem.contact.advance()
        results.append((problem.u.x.array.copy(), problem.contact.points()))
    assert worst(results[0][0] - results[1][0]) <= 1e-12
    assert worst(results[0][1]["traction"] - results[1][1]["traction"]) <= 1e-11
