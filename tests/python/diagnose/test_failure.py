"""What a failure says."""

import warnings

from petsc4py import PETSc

import hosts
import numpy as np
import pytest
import ufl
from condensing import pressed
from dolfinx import fem
from problems import COMM, build, fix, residual, tolerate

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactWarning,
    ConvergenceError,
    LoadSteps,
    NonlinearProblem,
    SNESSolver,
)
from raymortar.core import compat
from raymortar.diagnose.failure import (
    InUse,
    describe,
    describe_failure,
    list_of_residuals,
    stiffness_ratios,
    strange_gammas,
    swaps,
)
from raymortar.diagnose.inverted import most_compressed
from raymortar.results.sums import Statistics
from raymortar.solvers.settings import reason_in_words

pytestmark = pytest.mark.quick
TOUCHING = Statistics(hits=3, points=4, min_gap=0.0, max_gap=1.0)


@pytest.mark.parametrize("count", [0, 1, 10])
def test_short_histories_are_listed(count):
    history = [10.0**-k for k in range(count)]
    assert list_of_residuals(history) == ", ".join(f"{r:.3e}" for r in history)


def test_of_long_ones_both_ends_are():
    text = list_of_residuals([float(k) for k in range(200)])
    assert text.startswith("0.000e+00, 1.000e+00")
    assert "4.000e+00, (190 more), 1.950e+02" in text
    assert text.endswith("1.990e+02")


def test_reasons_are_words():
    reasons = PETSc.SNES.ConvergedReason
    assert reason_in_words(reasons.DIVERGED_MAX_IT).endswith("was reached")
    assert "line search" in reason_in_words(reasons.DIVERGED_LINE_SEARCH)
    assert "no number" in reason_in_words(-4)
    assert reason_in_words(-77) == "SNES reason -77"


@pytest.mark.parametrize(
    "history, statistics, unheld, advice",
    [
        ([1.0, 0.1], TOUCHING, [], ""),
        ([1.0, 0.1], Statistics(), [], "a larger reach"),
        ([1.0, 0.1], TOUCHING, ["the ball is held by nothing along x"], "a condition"),
        (8 * [2.0, 1.0], TOUCHING, [], "snes_linesearch_type"),
        ([1.0, 50.0], TOUCHING, [], "smaller steps"),
        ([1.0, float("nan")], TOUCHING, [], "smaller steps"),
        ([9.0, 5.0, 0.01, 0.2, 0.03, 0.9, 0.04, 0.3], TOUCHING, [], "smaller steps"),
    ],
)
def test_advice_goes_by_what_was_seen(history, statistics, unheld, advice):
    text = describe_failure(history, statistics, unheld, "; out of balance: x")
    assert all(body in text for body in unheld)
    assert (". Try " in text) == bool(advice)
    assert advice in text.rpartition(". Try ")[2]


@pytest.mark.parametrize(
    "in_use, proposed, left_out",
    [
        (InUse(), ["LoadSteps, which", "degree=1", '"bt"'], []),
        (InUse(degree=1), ["LoadSteps, which", '"bt"'], ["degree=1"]),
        (InUse(steps=True, automatic=True), ["a tenth of gamma"], ["LoadSteps"]),
        (InUse(steps=True), ['strategy="auto"'], ["LoadSteps, which"]),
        (InUse(steps=True, controlled=True), ["a tenth"], ['"bt"']),
    ],
)
def test_against_cycles_only_what_goes_with_the_options(in_use, proposed, left_out):
    text = describe_failure(8 * [2.0, 1.0], TOUCHING, [], "", in_use=in_use)
    assert all(words in text for words in proposed)
    assert not any(words in text for words in left_out)


@pytest.mark.parametrize("may_be_viscous", [True, False])
def test_viscous_forces_are_proposed_where_they_may_be(may_be_viscous):
    in_use = InUse(may_be_viscous=may_be_viscous)
    unheld = ["it is held by nothing"]
    text = describe_failure([1.0], TOUCHING, unheld, "", in_use=in_use)
    assert "a condition that holds it" in text
    assert ("stabilize" in text) == may_be_viscous


@pytest.mark.parametrize("steps", [False, True])
def test_smaller_steps_are_proposed_by_name_but_not_to_steps(steps):
    text = describe_failure([1.0, 50.0], TOUCHING, [], "", in_use=InUse(steps=steps))
    assert ("Try LoadSteps, which takes smaller steps" in text) != steps
    assert ("Try" in text) != steps


@pytest.mark.parametrize(
    "halvings, told",
    [(6, "cells are pressed to 0."), (1, "a larger max_halvings allows smaller steps")],
)
def test_a_path_that_halving_does_not_help_says_what_limits_it(halvings, told):
    """Blocks that are pressed until cells fold."""
    blocks = pressed("triangle", 1, None, upper=0.6, stiff=1.0)

    def press(t):
        blocks.load.value[-1] = -0.9 * t

    solver = SNESSolver(blocks.coupled())
    path = LoadSteps(solver, press, 2, max_halvings=halvings, strategy="halve")
    with pytest.raises(ConvergenceError) as error:
        path.run()
    assert told in str(error.value) and "Try smaller steps" not in str(error.value)


def test_least_stretch_of_cells():
    """Of a homogeneous deformation, everywhere the same."""
    blocks = pressed("quadrilateral", 1, None)
    stretched = np.array([[0.5, 0.2], [0.0, 1.3]])
    blocks.u.interpolate(lambda x: (stretched - np.eye(2)) @ x[:2])
    stretch, place = most_compressed(blocks.contact)
    expected = np.linalg.svd(stretched, compute_uv=False).min()
    assert stretch == pytest.approx(expected, rel=1e-12) and place.startswith("(")


def test_a_solve_that_broke_is_not_told_of_its_reach():
    text = describe_failure([1.0, float("nan")], Statistics(), [], "")
    assert "smaller steps" in text and "reach in Search" not in text


@pytest.mark.mpi
@pytest.mark.parametrize("stiffness, told", [(1e3, True), (0.0, False)])
def test_bodies_on_weak_springs_are_told_with_remedies(stiffness, told):
    """A solve that broke while a block on springs was on its way over a small gap."""
    scene = two_blocks(COMM, 2, "quadrilateral", (4, 2), (3, 2), gap=1e-6)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    F = residual(scene, u)[0]
    k, v = fem.Constant(scene.mesh, stiffness), ufl.TestFunction(u.function_space)
    F += k * ufl.inner(u, v) * ufl.dx
    tags = [(scene.tags["slave"], scene.tags["master"])]
    contact = Contact(u, scene.facet_tags, tags)
    problem = NonlinearProblem(F, contact, [fix(u.function_space, scene, "bottom")])
    x, b = problem.start(), problem.create_vector()
    problem.F(x, b)
    high = u.function_space.tabulate_dof_coordinates()[:, 1] > 1.0 + 5e-7
    u.x.array.reshape(-1, 2)[high] = -0.05
    assert "springs" not in describe(problem)
    problem.history.append(float("nan"))
    text = describe(problem)
    assert ("which springs alone hold, has moved by 0.05 along x, y" in text) == told
    assert ("contact.adjust(within=...)" in text) == told


def stiff_on_soft(stiffer=1e4, degree=(1, 2), **options):
    """A block pressed on a soft one of lower degree by a tenth in one step."""
    scenes = hosts.meshes(divisions=(8, 6))
    found = hosts.apart(scenes, degree=degree, stiffer=stiffer, **options)
    found.push(0.0, -0.1)
    return found


@pytest.mark.mpi
def test_a_stiff_slave_of_higher_degree_is_told_with_remedies():
    with pytest.raises(ConvergenceError) as failure:
        SNESSolver(stiff_on_soft().problem).solve()
    text = str(failure.value).rpartition(". Try ")[2]
    assert "AugmentedLagrangian(degree=1), or the other side as the slave" in text
    assert "has degree 2 and its master degree 1 and is" in text
    assert "times as stiff as its master" in text
    # Both help
    for options in ({"method": AugmentedLagrangian(degree=1)}, {"swap": True}):
        assert SNESSolver(stiff_on_soft(**options).problem).solve()[0] <= 8


@pytest.mark.mpi
@pytest.mark.parametrize(
    "stiffer, degree", [(1.0, (1, 1)), (1e3, (1, 1)), (1e3, (1, 2))]
)
def test_moduli_are_compared_as_they_are(stiffer, degree):
    found = stiff_on_soft(stiffer, degree)
    contact = found.contact
    ratios = stiffness_ratios(
        found.problem._pattern, contact.surfaces.interfaces, found.problem.bcs
    )
    assert ratios[0].shape == (1, 1)
    assert 0.3 * stiffer < ratios[0][0, 0] < 3.0 * stiffer
    told = swaps(contact.surfaces, found.problem._pattern, found.problem.bcs)
    assert len(told) == (stiffer > 1.0)
    assert all(("degree=1" in text) == (degree == (1, 2)) for text in told)


@pytest.mark.mpi
def test_snes_says_why_it_stopped():
    scene = two_blocks(COMM, 2, "triangle")
    case = build(
        scene,
        bcs=lambda V, s: [
            fix(V, s, "bottom"),
            fix(V, s, "top", value=lambda x: -0.3 * x[:, -1:] + 0 * x),
        ],
    )
    case.solver = SNESSolver(case.problem)
    tolerate(case.solver, max_it=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)
        with pytest.raises(ConvergenceError, match="largest number of iterations"):
            case.solve(max_it=1)


@pytest.mark.mpi
def test_a_gamma_of_other_constants_is_named():
    """The coefficient stays the first problem's where a modulus changes."""
    scene = two_blocks(COMM, 2, "quadrilateral", 4, 4)
    scale = fem.Constant(scene.mesh, 1.0)
    down = lambda x: -0.1 + 0 * x  # noqa: E731
    case = build(
        scene,
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=down)],
    )
    given = case.problem
    problem = NonlinearProblem(scale * given.forms[0], given.contact, given.bcs)
    assert strange_gammas(problem) == []
    gamma = given.contact.gamma
    for factor in (1e-3, 1e3):
        scale.value = factor
        (text,) = strange_gammas(problem)
        now = factor * gamma
        assert f"gamma = {gamma:.3g} is {1.0 / factor:.3g} times" in text
        assert f"contact.set_gamma({now:.3g})" in text
        assert text in problem.describe()


@pytest.mark.mpi
def test_a_gamma_is_not_judged_by_an_iterate_that_ran_away():
    """Bodies squeezed to a hundredth are more than 1e4 times as stiff."""
    scene = two_blocks(COMM, 2, "quadrilateral", 2, 2)
    case = build(
        scene,
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top")],
    )
    u, problem = case.problem.u, case.problem
    u.interpolate(lambda x: -0.99 * x[:2])
    iterate = u.x.array.copy()
    assert strange_gammas(problem) == []
    assert (u.x.array == iterate).all()
    assert problem.contact.states.u_old.max() == 0.0
