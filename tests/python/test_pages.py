"""Programs of the pages run as they are typed in, and print what the pages say."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from raymortar import compat

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")


def blocks_of(page, kind):
    """Fenced blocks of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{kind}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def run(program, folder, has_newton=compat.newton_solver_class()):
    """Output of a program; where DOLFINx has no Newton solver, with PETSc's."""
    if has_newton is None:
        program = program.replace("raymortar.NewtonSolver", "raymortar.SNESSolver")
    (folder / "program.py").write_text(program, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "program.py"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.quick
def test_first_contact_prints_what_its_page_says(tmp_path):
    pytest.importorskip("matplotlib")
    printed = run(blocks_of("docs/first_contact.md", "python")[0], tmp_path)
    said = blocks_of("docs/first_contact.md", "text")[0].strip()
    assert NUMBER.sub("", printed) == NUMBER.sub("", said)
    for ours, theirs in zip(printed.splitlines(), said.splitlines()):
        a, b = ([float(x) for x in NUMBER.findall(line)] for line in (ours, theirs))
        if ours.startswith("residual"):
            # To a digit on the page, and down to rounding
            assert a[:-1] == pytest.approx(b[:-1], rel=0.5) and a[-1] < 1e-12
        else:
            assert a == pytest.approx(b, rel=2e-3)
    for name in ("first_contact.png", "first_contact.xdmf", "first_contact.h5"):
        assert (tmp_path / name).stat().st_size > 0


def test_example_of_the_start_page_carries_its_load(tmp_path):
    """Iterations stay few, and the force grows faster than the compression."""
    printed = run(blocks_of("README.md", "python")[0], tmp_path)
    rows = [list(map(float, NUMBER.findall(line))) for line in printed.splitlines()]
    assert [row[0] for row in rows] == [0.1, 0.2, 0.3, 0.34]
    assert all(row[1] <= 8 for row in rows)
    stiffness = [row[-1] / row[0] for row in rows]
    assert stiffness == sorted(stiffness) and stiffness[0] > 0.0
