"""Hertz contact in 2D: convergence, NAFEMS, degree of the multiplier.

The spheres are in `test_demos`: they need their default size.
"""

import itertools
import sys
from pathlib import Path

from mpi4py import MPI

import pytest

import raymortar

pytest.importorskip("matplotlib")
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import hertz_cylinder as cylinder  # noqa: E402

COMM = MPI.COMM_WORLD


def cylinder_errors(*args, **options):
    """Relative errors of peak, half-width and (in L2) pressure; the result."""
    case = cylinder.SMALL
    result = cylinder.solve(COMM, case, *args, **options)
    found = cylinder.measure(result, case)
    peak, width = found.peak / found.p0 - 1.0, found.half_width / found.a - 1.0
    return (abs(peak), abs(width), found.l2), result


def decreasing(values):
    return all(b < a for a, b in itertools.pairwise(values))


def test_peak_and_half_width_improve_with_refinement():
    runs = [cylinder_errors(n) for n in (10, 20, 40)]
    peaks, widths, l2 = zip(*(errors for errors, _ in runs))
    assert decreasing(peaks) and decreasing(widths)
    assert peaks[1] < 0.005 and widths[1] < 0.01  # 3 % are asked for
    assert l2[1] < 0.03
    # What is left is no error of the mesh: the bodies are no half-spaces
    assert peaks[2] > 0.002 and widths[2] > 0.002


@pytest.mark.mpi
@pytest.mark.usefixtures("not_ahead")
def test_newton_needs_few_iterations_and_ends_quadratically():
    _, result = cylinder_errors(20)
    assert max(result.iterations) <= 8
    # The last two steps: the number of digits doubles
    a, b, c = (r / result.history[0] for r in result.history[-3:])
    assert b < 1e-2 * a and c < 1e-4 * b


@pytest.mark.mpi(
    where=lambda degree, master_ratio, **_: degree == 2 and master_ratio < 1.0
)
@pytest.mark.parametrize("master_ratio", [0.7, 1.25])
@pytest.mark.parametrize("degree, multiplier_degree", [(1, 1), (2, 2), (2, 1)])
def test_equal_order_is_as_good_as_lower_order(degree, multiplier_degree, master_ratio):
    """0.23 % of the peak's deviation is Hertz's own (docs/measured/equal_order.md)."""
    (peak, width, _), _ = cylinder_errors(
        20,
        degree,
        method=raymortar.AugmentedLagrangian(degree=multiplier_degree),
        master_ratio=master_ratio,
    )
    assert peak < 0.004 and width < 0.01


@pytest.mark.mpi(where=lambda degree: degree == 1)
@pytest.mark.parametrize("degree", [1, 2])
def test_nafems_benchmark(degree):
    """Konter (2006), benchmark 1; -1.2727 is code_aster's (cont008a)."""
    case = cylinder.NAFEMS
    result = cylinder.solve(COMM, case, 20, degree, force=35e3)
    found = cylinder.measure(result, case)
    assert found.force == pytest.approx(35e3, rel=1e-3)
    assert found.p0 == pytest.approx(3585.36, rel=1e-3)
    assert found.peak == pytest.approx(3585.36, rel=0.01)
    assert found.half_width == pytest.approx(6.2146, rel=0.01)
    assert cylinder.settling(result) == pytest.approx(-1.306904, rel=0.03)
    assert cylinder.settling(result) == pytest.approx(-1.2727, rel=0.003)
