"""The benchmarks run, raymortar needs what they say, and GetFEM finds the same."""

import csv
import sys
from pathlib import Path

import pytest

from problems import COMM

pytest.importorskip("matplotlib")
if COMM.size > 1:
    pytest.skip("the benchmark is serial", allow_module_level=True)
ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"
sys.path[:0] = [str(BENCHMARKS), str(BENCHMARKS / "accuracy"), str(ROOT / "demos")]

import plots  # noqa: E402
import rows  # noqa: E402
import run  # noqa: E402
import tangent  # noqa: E402


def test_quick_run_leaves_results_and_plots(tmp_path):
    assert run.main(["--quick", "--output", str(tmp_path)]) == 0
    found = rows.read(tmp_path / "accuracy.csv")
    mine = [row for row in found if row["program"] == "raymortar"]
    assert len(mine) == len(list(run.quick()))
    for row in mine:
        assert 0.0 < row["error_u"] < 0.2
        stages = sum(row[name] for name in plots.STAGES)
        assert row["seconds"] == pytest.approx(stages, rel=0.01)
    coarse, fine = mine[:2]
    assert coarse["error_u"] > 7.0 * fine["error_u"]
    assert (tmp_path / "pareto_B2.png").stat().st_size > 0


@pytest.mark.parametrize("problem, cell", [("B2", "triangle"), ("B1", "tetrahedron")])
def test_getfem_finds_the_same(problem, cell):
    """On the same mesh, of degree 2; errors measured by the same code."""
    pytest.importorskip("getfem")
    kind = (problem, cell, 2, 2, 8)
    peer = run.getfem(run._alike(*kind))
    mine = run.measure(run._alike(*kind))
    for name in ("error_u", "error_H", "error_multiplier"):
        assert peer[name] == pytest.approx(mine[name], rel=2e-3)


def test_front_has_what_nothing_beats():
    times, errors = (1.0, 2.0, 3.0, 4.0), (0.1, 0.2, 0.01, 0.01)
    found = [{"seconds": t, "error": e} for t, e in zip(times, errors)]
    assert plots.pareto(found, "error") == [found[0], found[2]]
    # Between sizes a straight line on log scales; nothing beyond the last
    assert plots.seconds_at(found, "error", 0.1) == pytest.approx(1.0)
    middle = plots.seconds_at(found, "error", 10**-1.5)
    assert middle == pytest.approx(3.0**0.5)
    assert plots.seconds_at(found, "error", 1e-3) is None


def test_moving_segments_save_iterations_where_the_slave_overhangs(tmp_path):
    """With either method; the benchmark counts what both tangents need."""
    file = tmp_path / "tangent.csv"
    scene = "slave overhangs, quadrilateral 1"
    tangent.main(["--repeat", "1", "--only", scene, "--output", str(file)])
    with file.open() as lines:
        found = list(csv.DictReader(lines))
    assert [row["tangent"] for row in found] == ["fixed", "full"] * 2
    for fixed, full in zip(found[::2], found[1::2]):
        assert fixed["steps"] == full["steps"] == str(tangent.STEPS)
        assert int(full["iterations"]) < 0.75 * int(fixed["iterations"])
