"""The core of the package stands alone."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import raymortar

PROGRAM = Path(__file__).resolve().parents[1] / "helpers" / "core_alone.py"
PACKAGE = Path(raymortar.__file__).parent


def run(parts, law):
    """What the program prints, of which the last line is its own."""
    command = [sys.executable, str(PROGRAM), str(PACKAGE), parts, law]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    "law, iterations, force",
    [
        ("none", [3, 3, 3, 3], (0.0, 0.0, -9.35268904e-02)),
        ("friction", [6, 4, 4, 4], (2.27132823e-02, 0.0, -9.56952597e-02)),
    ],
)
def test_the_core_alone_solves_as_the_whole_package_does(law, iterations, force):
    """Floors are not loaded, and change no digit of two blocks in contact."""
    alone, whole = (run(parts, law) for parts in ("alone", "whole"))
    assert alone["iterations"] == whole["iterations"] == iterations
    assert alone["force"] == pytest.approx(whole["force"], abs=1e-12)
    assert alone["force"] == pytest.approx(force, abs=1e-9)
    rooms = {name.split(".")[1] for name in alone["modules"]}
    assert rooms == {"_cpp", "core"}
    # With the whole package, floors judge the same solves
    assert {"raymortar.diagnose", "raymortar.solvers"} < set(whole["modules"])
