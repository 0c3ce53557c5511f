"""What a failure says."""

import warnings

import pytest
from petsc4py import PETSc
from problems import COMM, build, fix, tolerate
from raymortar import ContactWarning, ConvergenceError, SNESSolver
from raymortar.failure import describe_failure, list_of_residuals, reason_in_words
from raymortar.results import Statistics
from raymortar.scenes import two_blocks

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
    ],
)
def test_advice_goes_by_what_was_seen(history, statistics, unheld, advice):
    text = describe_failure(history, statistics, unheld, "; out of balance: x")
    assert all(body in text for body in unheld)
    assert (". Try " in text) == bool(advice)
    assert advice in text.rpartition(". Try ")[2]


@pytest.mark.mpi
def test_a_rigid_slave_is_named():
    """Finer than its soft master: its multiplier asks for more than the facets can."""
    scene = two_blocks(COMM, 2, "quadrilateral", 5, 9)
    down = lambda x: -0.1 + 0 * x  # noqa: E731
    case = build(
        scene,
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, ["top", "slave"], value=down)],
    )
    tag = scene.tags["slave"]
    with pytest.raises(ConvergenceError, match=f"all of slave tag {tag} is prescribed"):
        case.solve(SNESSolver)


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
