"""The benchmarks run, raymortar needs what they say, and GetFEM finds the same."""

import csv
import importlib.util
import itertools
import sys
from pathlib import Path

import pytest
from problems import CELLS, COMM

pytest.importorskip("matplotlib")
if COMM.size > 1:
    pytest.skip("the benchmark is serial", allow_module_level=True)
ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"
FOLDERS = [BENCHMARKS, BENCHMARKS / "accuracy", BENCHMARKS / "stress", ROOT / "demos"]
sys.path[:0] = [str(folder) for folder in FOLDERS]

import edge_friction  # noqa: E402
import edge_scenes  # noqa: E402
import edges  # noqa: E402
import plots  # noqa: E402
import published_shells  # noqa: E402
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


@pytest.mark.parametrize("law", edge_scenes.METHODS)
def test_the_push_up_a_wedge_is_the_closed_form(law):
    """To what a load of 1e-4 of the modulus bends."""
    _, error, _ = edge_friction.solve_wedge(2, 1, law)
    assert error() < 1e-4  # measured 4e-5


@pytest.mark.parametrize("law", ["nodes", "dual"])
def test_a_compact_body_is_not_softened(law):
    """A half-plane lets tractions reach further than a facet, but does not bend."""
    _, _, iterations = edge_scenes.solve_pressed(edge_scenes.punch(16, 1), 1, law)
    assert iterations <= 4  # measured 3; 5 and 6 with softened tangents


def test_getfem_has_the_force_of_the_punch():
    """Each program's pressures balance its own force; the forces are the same."""
    pytest.importorskip("getfem")
    from edge_peer import Peer

    case = edge_scenes.punch(8, 1)
    contact, error, _ = edge_scenes.solve_pressed(case, 1, "points")
    peer = Peer(case, 1)
    peer.solve()
    theirs = abs(peer.force())
    assert theirs == pytest.approx(abs(contact.resultant(0).force[1]), rel=0.01)
    assert error() < peer.error() < 0.2  # measured 0.09, 0.16


def test_every_scene_with_an_edge_has_its_rows():
    """Those that are committed are of all scenes and laws."""
    found = edges.rows_of(BENCHMARKS / "accuracy" / "results" / "edges.csv")
    kinds = {(row["scene"], row["law"]) for row in found}
    assert kinds >= set(itertools.product(edges.SCENES, edges.LAWS))


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


def test_shells_of_the_published_radii_have_more_than_the_published_force(tmp_path):
    """The curves are of other shells, whose radii nobody gives."""
    assert published_shells.SCENES[0] == ((10.0, 12.0), (12.0, 14.0), 14.0)
    file = tmp_path / "shells.csv"
    published_shells.main(["--scenes", "1", "--output", str(file)])
    with file.open() as lines:
        published, ours = csv.DictReader(lines)
    for name in (name for name in ours if name.startswith("at_")):
        assert float(ours[name]) > 1.5 * float(published[name])


@pytest.fixture(scope="module")
def stress():
    """`benchmarks/stress/run.py`; another benchmark has a module `run` too."""
    return module_of("stress_matrix", BENCHMARKS / "stress" / "run.py")


def module_of(name, place):
    """A program under a name of its own."""
    spec = importlib.util.spec_from_file_location(name, place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SOUND = {"imbalance": 0.0, "penetration": 0.0, "volume": 1.0, "warned": False}
NAN = float("nan")


@pytest.mark.parametrize(
    "scene, errors, verdict",
    [
        ("column", {"exact": 1e-7}, "one step"),
        ("column", {"exact": 1e-4}, "wrong"),
        ("column", {"exact": NAN}, "no reference"),
        ("punch", {"steps": 1e-7, "swapped": 0.02}, "one step"),
        ("punch", {"steps": 1e-7, "swapped": 0.2}, "wrong"),
        ("punch", {"steps": 0.1, "swapped": 0.02}, "another equilibrium"),
        ("punch", {"steps": NAN, "swapped": 0.02}, "one step"),
        ("punch", {"steps": NAN, "swapped": NAN}, "no reference"),
        ("slide", {"free": 0.0, "work": 0.01}, "one step"),
        ("slide", {"free": 0.0, "work": 0.5}, "wrong"),
    ],
)
def test_nothing_passes_the_stress_matrix_without_a_reference(
    stress, scene, errors, verdict
):
    answer = {"way": "one step", "message": ""} | SOUND | errors
    assert stress.judge(stress.Setting(scene), answer) == verdict


def test_stress_matrix_goes_on_where_it_was_left(stress, tmp_path):
    arguments = ["--only", "slivers", "--output", str(tmp_path)]
    assert stress.main(arguments) == 0
    kept = (tmp_path / "answers.jsonl").read_text()
    assert stress.main([*arguments, "--resume"]) == 0
    assert (tmp_path / "answers.jsonl").read_text() == kept
    with (tmp_path / "matrix.csv").open() as lines:
        assert all(float(row["exact"]) < 1e-5 for row in csv.DictReader(lines))


def test_stress_matrix_has_every_cell_and_degree_in_each_scene(stress):
    kinds = {(s.scene, s.cell, s.degree) for s in stress.all_settings()}
    assert kinds == set(itertools.product(stress.REFERENCES, CELLS, (1, 2)))


@pytest.fixture(scope="module")
def parameters():
    """`benchmarks/parameters/run.py`."""
    return module_of("parameters_tables", BENCHMARKS / "parameters" / "run.py")


def test_every_table_of_the_parameters_has_a_script_and_its_rows(parameters):
    """The rows that are committed are those that the script writes."""
    folder = BENCHMARKS / "parameters"
    assert {file.stem for file in folder.glob("*.csv")} == set(parameters.TABLES)


@pytest.mark.parametrize(
    "name", ["holding", "gamma_blocks", "gamma_cylinder", "quadrature", "oscillation"]
)
def test_tables_of_small_scenes_still_run(parameters, name, tmp_path):
    assert parameters.main([name, "--quick", "--output", str(tmp_path)]) == 0
    with (tmp_path / f"{name}.csv").open() as lines:
        assert len(list(csv.DictReader(lines))) == 1
