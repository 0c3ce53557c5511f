"""Scenes that arrive with nothing tuned: stacks, a free disc, the drawing of a sheet."""

import sys
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from arriving import (
    FALL,
    RADIUS,
    WEIGHT,
    free_disc,
    leaning,
    loose_stack,
    squeezed_disc,
    stacked,
)
from pathing import Path as PathOf
from pathing import take
from problems import COMM
from slender import leaves

import raymortar
from raymortar import AugmentedLagrangian, ContactWarning, ConvergenceError
from raymortar.core.solvers.solver import MAX_IT
from raymortar.paths.soft_stick import SoftStick

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import forming  # noqa: E402


@pytest.mark.mpi(where=lambda steps: steps == 6)
@pytest.mark.parametrize("steps", [3, 6, 12, 24, 48])
def test_more_steps_are_never_worse(steps):
    """Three blocks under a circle that is pressed in and dragged."""
    path = stacked(steps)
    taken = take(path)
    assert taken.arrived and taken.halvings == 0
    assert taken.tangents <= 6 * steps
    tool, bottom = path.result()
    assert np.abs(tool + bottom).max() <= 1e-8 * np.abs(tool).max()
    # That of the finest path, to the error of its steps in friction
    assert tool == pytest.approx([0.0546, -0.6271], rel=5e-3)


@pytest.mark.mpi(where=lambda fine, degree: degree == 1)
@pytest.mark.parametrize("fine, degree", [(1, 1), (1, 2), (2, 2)])
def test_a_loose_stack_is_caught_once(fine, degree):
    """Both blocks fall in the first step; the later ones cost a solve each."""
    path = loose_stack(fine, degree)
    taken = take(path)
    assert taken.arrived and taken.halvings == 0
    assert taken.ways == {"viscous forces": 1, "full": 3}
    assert [step.solves for step in taken.steps[1:]] == [1, 1, 1]
    assert path.result()[:, 1] == pytest.approx([2.0, 1.0], rel=1e-8)
    assert np.abs(path.result()[:, 0]).max() <= 1e-8


@pytest.mark.mpi
def test_a_free_disc_stays_where_it_lands():
    """Nothing but rounding drives its roll: it is held there, and named. Then it costs no
    more than a body on supports; before, it took 218 tangents and rolled by 0.34."""
    pytest.importorskip("gmsh")
    path = free_disc(size := 0.8)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        taken = take(path)
    told = [str(w.message) for w in caught if issubclass(w.category, ContactWarning)]
    assert any("may move along x and turn: nothing resists that" in t for t in told)
    assert taken.arrived and taken.halvings == 0 and path.problem.solves <= 80
    assert sum(step.solves for step in taken.steps[1:]) <= 3 * 9
    # On the mesh of some versions of Gmsh it is held from the second step on
    assert taken.tangents <= 80 and taken.ways["full"] >= 8
    at, force = path.result()
    assert abs(at[0]) <= 0.05 * size and -0.2 * RADIUS < at[1] < -FALL
    assert force == pytest.approx([0.0, WEIGHT], abs=1e-3 * WEIGHT)


@pytest.mark.mpi(where=lambda friction, **_: friction)
@pytest.mark.parametrize("friction, aside", [(0.3, 0.05), (None, 0.03)])
def test_a_disc_that_little_drives_is_held_within_sixty_tangents(friction, aside):
    """Its centre of mass is beside its middle by a hundredth of its radius: it would roll,
    or slide and turn, by a quarter of a turn. Before, it crept for 569 tangents, or more.
    """
    pytest.importorskip("gmsh")
    path = free_disc(1.0, 4, aside=aside, friction=friction)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        taken = take(path)
    told = [str(w.message) for w in caught if issubclass(w.category, ContactWarning)]
    (one,) = [text for text in told if "of its forces drive that" in text]
    assert "the body around (" in one and "and turn" in one
    assert float(one.split(": ")[1].split()[0]) <= 1e-2
    assert taken.arrived and taken.halvings == 0 and taken.tangents <= 160
    assert max(step.tangents for step in taken.steps[1:]) <= 8
    (doubt,) = [f for f in taken.steps[-1].findings if f.about == ("held",)]
    assert doubt.is_wrong and "of its forces drive that" in doubt.text
    at, force = path.result()
    assert abs(at[0]) <= 0.1 * RADIUS and -0.2 * RADIUS < at[1] < -FALL
    assert force == pytest.approx([0.0, WEIGHT], abs=1e-2 * WEIGHT)


def test_a_plank_leans_where_friction_holds_it():
    """It comes to rest wedged between wall and floor, in which soft springs have let it."""
    pytest.importorskip("gmsh")
    path = leaning(0.6)
    taken = take(path)
    # Length and thickness at 60 degrees
    start = np.degrees(np.arctan2(np.sqrt(0.75) + 0.025, 0.5 + 0.05 * np.sqrt(0.75)))
    lean, force = path.result()
    assert taken.arrived and taken.halvings == 0 and taken.tangents <= 30
    assert lean == pytest.approx(start, abs=1.0)
    assert force == pytest.approx([0.0, 1.0], abs=1e-8)


def test_a_disc_that_its_weight_turns_over_rolls_by_a_quarter_turn():
    """With its centre of mass aside by a tenth of the radius. Before, it failed."""
    pytest.importorskip("gmsh")
    path = free_disc(1.0, 4, aside=0.5)
    taken = take(path)
    at, force = path.result()
    # It comes to rest on a facet
    assert at[0] == pytest.approx(0.5 * np.pi * RADIUS, abs=1.0)
    assert force == pytest.approx([0.0, WEIGHT], abs=1e-3 * WEIGHT)
    assert taken.arrived and taken.halvings == 0 and taken.tangents <= 80


def test_a_disc_that_its_weight_turns_over_is_named_within_two_hundred_tangents(
    unlanded,
):
    pytest.importorskip("gmsh")
    path = free_disc(1.0, 4, aside=0.5)
    with pytest.raises(ConvergenceError, match="halvings of the step: the body around"):
        raymortar.LoadSteps(path.problem.snes_solver, path.apply, steps=4).run()
    assert path.problem.tangents <= 200


@pytest.mark.parametrize("way", ["auto", "halve"])
def test_sentences_on_a_lost_body_come_first(way, unlanded):
    """The direction is said, and that nothing stops it; without viscous forces nothing
    is known of a motion."""
    pytest.importorskip("gmsh")
    path = free_disc(1.0, 4, aside=0.5)
    steps = partial(raymortar.LoadSteps, path.problem.snes_solver, path.apply, 1)
    with pytest.raises(ConvergenceError) as caught:
        steps(strategy=way).run()
    text = "5.15) goes on to move along x and turn under viscous forces of"
    said = text in str(caught.value) and "nothing stops it" in str(caught.value)
    assert said == (way == "auto")


def test_a_held_disc_is_let_go_where_walls_grip_it():
    """What resists its roll takes the place of the forces that held it."""
    pytest.importorskip("gmsh")
    path = free_disc(walls=True)
    history, shares = raymortar.History(path.problem), "viscous_share"
    taken = take(path, stabilize=True, history=history)
    # On some meshes it rests on a facet, and is not held
    assert taken.arrived and max(history[shares]) <= 1e-3
    assert history[shares][-1] == 0.0 and taken.tangents <= 80
    _, force = path.result()
    assert force[1] > 0.0


def test_a_disc_that_touches_and_may_roll_is_caught_in_its_first_step():
    """A line search that finds no smaller residual is trouble, and not for halving."""
    pytest.importorskip("gmsh")
    path = squeezed_disc()
    taken = take(path)
    assert taken.arrived and taken.halvings == 0
    assert taken.ways == {"viscous forces": 1}
    lid, floor = path.result()
    assert np.abs(lid + floor).max() <= 1e-8 * lid[1]
    assert abs(lid[0]) <= 1e-3 * lid[1]


def test_leaves_that_touch_all_along_are_not_halved_for_more_iterations(
    monkeypatch, uncorrected
):
    """From gaps of zero the points that stay closed are as far away in a small step."""
    monkeypatch.setattr(SoftStick, "_softened", lambda self: [])  # 23 iterations
    taken = take(path := leaves(method=AugmentedLagrangian(condition="nodes")))
    assert taken.arrived and taken.halvings == 0 and taken.ways == {"full": 1}
    assert MAX_IT < taken.tangents <= 2 * MAX_IT
    assert path.result() == pytest.approx(1.0, abs=5e-3)  # beams without shear


@pytest.mark.parametrize("cells, depth, steps", [(1, 0.2, 4), (2, 0.8, 16)])
def test_a_sheet_is_drawn_with_the_automatic_gamma(cells, depth, steps, monkeypatch):
    """Nothing but contact and its weight holds it up and down."""
    monkeypatch.setattr(forming, "GAMMA", None)
    model = forming.Forming(COMM, cells)
    model.punch.move((0.0, forming.ABOVE))
    model.follow(lambda t: None, 1)
    model.follow(lambda t: model.punch.move((0.0, -t * depth)), steps)
    punch, die = (force[1] for force in model.forces())
    assert model.halvings <= 3
    assert punch + forming.WEIGHT == pytest.approx(-die, rel=1e-7)
    assert punch > 0.25 * forming.beam_force(depth)


@pytest.mark.parametrize("cells, depth, steps", [(1, 0.2, 4), (2, 0.8, 16)])
def test_a_sheet_is_drawn_by_a_law_at_nodes(cells, depth, steps, monkeypatch):
    """In at most 8 iterations a step, once the punch has touched."""
    law = partial(raymortar.AugmentedLagrangian, condition="nodes")
    monkeypatch.setattr(forming, "GAMMA", None)
    monkeypatch.setattr(raymortar, "AugmentedLagrangian", law)
    model = forming.Forming(COMM, cells)
    model.punch.move((0.0, forming.ABOVE))
    model.follow(lambda t: None, 1)
    model.follow(lambda t: model.punch.move((0.0, -t * depth)), steps)
    punch, die = (force[1] for force in model.forces())
    assert model.halvings <= 2
    assert steps < 16 or sum(model.iterations[1:]) <= 8 * steps
    assert punch + forming.WEIGHT == pytest.approx(-die, rel=1e-7)
    assert punch > 0.25 * forming.beam_force(depth)


def test_a_sheet_that_lies_on_its_die_peels_off_by_itself(monkeypatch):
    """Its weight leaves less out of balance than any iterate on the way, as the sheet
    opens facet by facet: that is no trouble. Before, viscous forces took 153 tangents.
    """
    law = partial(raymortar.AugmentedLagrangian, condition="nodes")
    monkeypatch.setattr(forming, "GAMMA", None)
    monkeypatch.setattr(raymortar, "AugmentedLagrangian", law)
    model = forming.Forming(COMM, 2)
    model.punch.move((0.0, forming.ABOVE))
    path = PathOf(model.problem, lambda t: None, 1)
    taken = take(path)
    assert taken.arrived and taken.ways == {"full": 1} and taken.tangents <= 25
    die = model.forces()[1][1]
    assert -die == pytest.approx(forming.WEIGHT, rel=1e-7)
