"""The speed benchmark runs, and what it counts agrees."""

import csv
import subprocess
import sys
from pathlib import Path
from statistics import median

import pytest
from problems import COMM

pytest.importorskip("matplotlib")
if COMM.size > 1:
    pytest.skip("the benchmark is serial", allow_module_level=True)
RUN = Path(__file__).parents[2] / "benchmarks" / "speed" / "run.py"
# What pairing anew costs at least, in calls that find nothing moved
UNMOVED = 20


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def results(tmp_path):
    """Make a quick run of parts of it, in a process of its own: module names are common
    ones. Gives its folder."""

    def run(parts):
        command = [sys.executable, str(RUN), "--quick", "--output", str(tmp_path)]
        subprocess.run([*command, "--parts", parts], check=True, timeout=300)
        return tmp_path

    return run


def test_strategies_find_the_same_number_of_pairs(results):
    found = {}
    for row in read(results("pairing") / "pairing.csv"):
        found.setdefault((row["shape"], row["facets"]), set()).add(row["candidates"])
    assert len(found) == 6
    for numbers in found.values():
        assert len(numbers) == 1 and int(min(numbers)) > 0


def test_stages_are_counted_and_timed(results):
    folder = results("stages")
    rows = read(folder / "stages.csv")
    assert len(rows) == 18
    assert sum(row["contact"] == "friction" for row in rows) == 6
    for row in rows:
        assert int(row["points"]) > int(row["segments"]) >= int(row["pairs"]) > 0
        assert float(row["s_tangent"]) > 0.0 < float(row["s_floor"])
    # One row may be of a moment in which the machine did something else
    ratios = [float(row["s_first"]) / float(row["s_unmoved"]) for row in rows]
    assert median(ratios) > UNMOVED
    assert (folder / "stages.png").stat().st_size > 0


def test_ironing_agrees_with_getfem(results):
    rows = read(results("ironing") / "ironing.csv")
    assert rows[0]["program"] == "raymortar"
    for row in rows:
        if row["program"] == "raymortar":
            assert 0.0 < float(row["contact_share"]) < 1.0
    for row in rows[1:]:
        assert row["steps"] == rows[0]["steps"]
        for force, allowed in (("V", 1e-4), ("H", 2e-3)):  # measured 1e-5, 5e-4
            assert abs(float(row[force]) / float(rows[0][force]) - 1.0) < allowed
