"""Decks for CalculiX, what it writes, and that all peers find the same contact."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from problems import COMM
from programs import more_ranks_than_cores

if COMM.size > 1:
    pytest.skip("decks are of one rank", allow_module_level=True)
ROOT = Path(__file__).parents[2]
PEERS = ROOT / "benchmarks" / "peers"
sys.path.insert(0, str(PEERS))

import calculix_cases  # noqa: E402
import calculix_deck  # noqa: E402
import calculix_results  # noqa: E402
import peer_scenes  # noqa: E402
from peer_case import FACES, Found  # noqa: E402

HAS_CCX = pytest.mark.skipif(
    calculix_cases.PROGRAM is None, reason=calculix_cases.MISSING
)
# Corners between which each middle lies, in the order of the nodes of Abaqus
EDGES = {
    "quadrilateral": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetrahedron": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hexahedron": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4))
    + ((0, 4), (1, 5), (2, 6), (3, 7)),
}


def cases():
    """One of each cell, of degree 2, with straight sides."""
    yield peer_scenes.patch(2, 2)
    yield peer_scenes.patch(2, 2, cell="tetrahedron")
    yield peer_scenes.hertz(2, 4, 1)


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: case.cell)
def test_nodes_of_cells_are_in_the_order_of_abaqus(case):
    x = case.places[case.cells]
    corners = x.shape[1] - (len(EDGES[case.cell]) if case.degree == 2 else 0)
    if case.degree == 2:
        for k, (a, b) in enumerate(EDGES[case.cell]):
            middle = 0.5 * (x[:, a] + x[:, b])
            np.testing.assert_allclose(x[:, corners + k], middle, atol=1e-12)
    # Faces' normals point out of the cell, or into it, all alike: none is crossed
    frame = x[:, [1, 3] if case.cell == "quadrilateral" else [1, 2, 3]] - x[:, :1]
    if case.cell == "hexahedron":
        frame = x[:, [1, 3, 4]] - x[:, :1]
    assert np.linalg.det(frame).min() > 0.0


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: case.cell)
def test_faces_of_a_surface_lie_on_it_and_have_its_area(case):
    """The slave of the patch is 1 x 1; Hertz's is an arc."""
    nodes = set(case.nodes(case.slave))
    for corners in case.corners(case.slave):
        assert nodes >= set(corners)
    _, area = case.vertices
    found = case.faces(case.slave)
    assert len(found) == len(case.scene.find(case.slave))
    assert len(FACES[case.cell]) > found[:, 1].max()
    if case.dim == 3:
        assert area.sum() == pytest.approx(1.0)


def test_a_deck_has_the_path_and_the_law_of_its_case():
    case = peer_scenes.ironing(10, 1)
    lines = calculix_deck.write(case, "surface").splitlines()
    legs = [k for k, line in enumerate(lines) if line.startswith("*STATIC")]
    assert [lines[k + 1] for k in legs] == ["0.1, 1, , 0.1", "0.02, 0.2, , 0.02"]
    assert sum(line.endswith("NLGEOM") for line in lines) == 2
    assert lines[lines.index("*FRICTION") + 1] == "0.3, 3448"
    along = lines.index("*AMPLITUDE, NAME=A1, TIME=TOTAL TIME")
    down = lines.index("*AMPLITUDE, NAME=A2, TIME=TOTAL TIME")
    assert lines[down + 11] == "1, -1" and lines[down - 1] == "1.2, 2"
    assert lines[along + 1] == "0, 0"
    # E / 4 / (1 + nu), and 2 over the bulk modulus
    law = lines[lines.index("*HYPERELASTIC, NEO HOOKE") + 1].split(", ")
    assert float(law[0]) == pytest.approx(689.6 / 4.0 / 1.32)
    assert float(law[1]) == pytest.approx(2.0 * 3.0 * (1.0 - 0.64) / 689.6)
    hard = calculix_deck.write(case, "mortar")
    assert "PRESSURE-OVERCLOSURE=HARD" in hard and "TYPE=MORTAR" in hard


def test_long_rows_of_a_deck_go_on_after_a_comma():
    assert calculix_deck.listed(range(10)) == ["0, 1, 2, 3, 4, 5, 6, 7", "8, 9"]
    deck = calculix_deck.write(peer_scenes.patch(2, 2), "surface")
    first = deck[deck.index("*ELEMENT") :].splitlines()[1:4]
    assert [line.endswith(",") for line in first] == [True, True, False]
    assert sum(len(line.rstrip(",").split(",")) for line in first) == 21


DAT = """
 total force (fx,fy,fz) for set TOP and time  0.5000000E+00

        1.000000E-03 -2.000000E+00  0.000000E+00

 total force (fx,fy,fz) for set TOP and time  0.1000000E+01

       -1.000000E-03 -4.000000E+00  3.000000E+00
"""
CVG = """SUMMARY OF C0NVERGENCE INFORMATION
  STEP   INC  ATT ITER   CONT.   RESID.  CORR.  RESID.  CORR.
     1     1   1     1      10  0.1E+00 0.1E-1 0.0 0.0
     1     1   2     1      10  0.1E+00 0.1E-1 0.0 0.0
     1     1   2     2      12  0.1E+00 0.1E-1 0.0 0.0
     1     2   1     1      12  0.1E+00 0.1E-1 0.0 0.0
"""
STA = """ SUMMARY OF JOB INFORMATION
  STEP      INC     ATT  ITRS     TOT TIME     STEP TIME      INC TIME
     1        1      2     2  0.250000E+00  0.250000E+00  0.250000E+00
     1        2      1     1  0.100000E+01  0.100000E+01  0.750000E+00
"""
FRD = """    1C
    2C                             2                                     1
 -1         1 1.00000E+00 2.00000E+00-3.00000E+00
 -1        12 1.50000E+00 2.00000E+00-3.00000E+00
 -3
 -4  CONTACT     6    1
 -5  COPEN       1    4    1    1
 -5  CPRESS      1    4    4    4
 -1         1 9.00000E+00 9.00000E+00
 -3
 -4  CONTACT     6    1
 -5  COPEN       1    4    1    1
 -5  CPRESS      1    4    4    4
 -1         1-1.00000E-03 2.00000E+02
 -1        12 1.00000E-03-0.00000E+00
 -3
 -4  DISP        4    1
 -5  D1          1    2    1    0
 -1         1 7.00000E+00
 -3
"""


def test_what_calculix_writes_is_read(tmp_path):
    times, forces = calculix_results.totals(DAT)
    np.testing.assert_array_equal(times, [0.5, 1.0])
    np.testing.assert_array_equal(forces[1], [-1e-3, -4.0, 3.0])
    effort = calculix_results.effort(CVG, STA)
    assert (effort.iterations, effort.increments, effort.cutbacks) == (4, 2, 1)
    assert calculix_results.effort("", "").increments == 0
    file = tmp_path / "job.frd"
    file.write_text(FRD)
    nodes, columns, values = calculix_results.last_field(file, "CONTACT")
    np.testing.assert_array_equal(nodes, [1, 12])
    np.testing.assert_array_equal(values[:, columns.index("CPRESS")], [200.0, 0.0])
    nodes, x = calculix_results.places(file)
    np.testing.assert_array_equal(x[1], [1.5, 2.0, -3.0])


def test_a_pressure_off_by_a_tenth_has_that_error():
    case = peer_scenes.patch(2, 1)
    nodes, _ = case.vertices
    at, p = case.pressures(case.places[nodes[::-1]], np.full(len(nodes), 0.11))
    np.testing.assert_allclose(at, case.places[nodes])
    found = Found(np.ones(1), np.full((1, 3), 0.1), at, p)
    assert case.error(case, found) == pytest.approx(0.1)
    assert case.unlike(found, np.full(len(nodes), 0.1)) == pytest.approx(0.1)


@HAS_CCX
def test_the_patch_in_calculix_has_the_force_of_its_penalty():
    """Two cubes of modulus E in series with a spring of 50 E: 1 / (1 + 1 / 100)."""
    case = peer_scenes.patch(2, 1)
    peer = calculix_cases.CalculiX(case, "surface")
    effort = peer.solve()
    assert effort.cutbacks == 0 and effort.increments == 1
    found = peer.found()
    exact = peer_scenes.PATCH_MODULUS * peer_scenes.PATCH_STRAIN / 1.01
    assert found.forces[-1, 2] == pytest.approx(exact, rel=1e-5)
    np.testing.assert_allclose(found.p, exact, rtol=5e-3)


@HAS_CCX
def test_what_calculix_does_not_solve_is_said():
    case = peer_scenes.ironing(10, 1)
    with pytest.raises(calculix_cases.Failed, match="ERROR in catsmpcslavno"):
        calculix_cases.CalculiX(case, "mortar").solve()


@pytest.mark.parametrize("program", ["raymortar", "GetFEM"])
def test_a_patch_in_a_process_of_its_own_has_its_force(program):
    pytest.importorskip("getfem" if program == "GetFEM" else "raymortar")
    form = "rays" if program == "GetFEM" else "points"
    key = json.dumps(["patch", program, form, "alike", 1, 2, 1])
    command = [sys.executable, str(PEERS / "run.py"), "--one", key]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    row = json.loads(done.stdout.splitlines()[-1])
    exact = peer_scenes.PATCH_MODULUS * peer_scenes.PATCH_STRAIN
    assert row["vertical"] == pytest.approx(exact, rel=1e-4)
    assert row["seconds"] > 0.0
    if program == "raymortar":
        assert row["error"] < 1e-6


def test_strong_scaling_has_a_row_of_two_ranks():
    """All slave facets are on some rank, and columns share them alike."""
    program = str(ROOT / "benchmarks" / "parallel" / "strong.py")
    command = ["mpirun", *more_ranks_than_cores(), "-n", "2", sys.executable, program]
    yields = {"OMPI_MCA_mpi_yield_when_idle": "1"}
    done = subprocess.run(
        [*command, "--here", "1", "columns"],
        capture_output=True,
        text=True,
        env=os.environ | yields,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout.strip().splitlines()[-1])
    assert row["ranks"] == 2 and row["without"] == 0
    assert 2.0 * row["mean_share"] == row["slave_facets"] == 9
    assert row["largest_share"] <= 6
    for stage in ("setup", "pairing", "residual", "tangent", "volume", "solver"):
        assert row[stage] > 0.0
    assert row["matrix_bytes"] > 0 and row["krylov"] > 0
