"""Programs of the pages run as they are typed in, and print what the pages say."""

import inspect
import re

import numpy as np
import pytest
from programs import ROOT, blocks_of, run

import raymortar

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")


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


def test_a_ball_on_a_disc_prints_what_its_page_says(tmp_path):
    page = "docs/axisymmetry.md"
    (program,) = [text for text in blocks_of(page, "python") if "import" in text]
    printed = run(program, tmp_path)
    said = blocks_of(page, "text")[0].strip()
    assert NUMBER.sub("", printed) == NUMBER.sub("", said)
    for ours, theirs in zip(NUMBER.findall(printed), NUMBER.findall(said)):
        assert float(ours) == pytest.approx(float(theirs), rel=2e-3)


def test_a_slit_that_closes_prints_what_its_page_says(tmp_path):
    """Iterations may differ by one: many points close at a time."""
    page = "docs/surfaces.md"
    (program,) = [text for text in blocks_of(page, "python") if "import" in text]
    printed = run(program, tmp_path).splitlines()
    said = blocks_of(page, "text")[0].strip().splitlines()
    assert len(printed) == len(said) == 4
    for ours, theirs in zip(printed, said):
        a, b = ([float(x) for x in NUMBER.findall(line)] for line in (ours, theirs))
        assert a[0] == b[0] and np.abs(np.subtract(a[1:3], b[1:3])).max() <= 1
        assert a[3:] == b[3:]


@pytest.mark.parametrize("ranks", [1, 2])
def test_bodies_of_two_gmsh_models_print_what_their_page_says(ranks, tmp_path):
    pytest.importorskip("gmsh")
    page = "docs/unknowns.md"
    (program,) = [text for text in blocks_of(page, "python") if "gmsh" in text]
    printed = run(program, tmp_path, ranks)
    said = blocks_of(page, "text")[0].strip()
    assert NUMBER.sub("", printed) == NUMBER.sub("", said)
    for ours, theirs in zip(printed.splitlines(), said.splitlines()):
        a, b = ([float(x) for x in NUMBER.findall(line)] for line in (ours, theirs))
        # Versions of Gmsh make other meshes
        assert a[0] == b[0] and a[1] == pytest.approx(b[1], rel=2e-2)
        assert abs(a[2] - b[2]) <= 1
    for name in ("plate", "disc"):
        assert (tmp_path / f"{name}.xdmf").stat().st_size > 0


@pytest.mark.quick
def test_ten_lines_of_the_start_page_solve_contact(tmp_path):
    """Iterations stay few, and the force grows faster than the compression."""
    pytest.importorskip("matplotlib")
    program = blocks_of("README.md", "python")[0]
    printed = run(program, tmp_path)
    rows = [list(map(float, NUMBER.findall(line))) for line in printed.splitlines()]
    assert [row[0] for row in rows] == [0.25, 0.5, 0.75, 1.0]
    assert all(row[1] <= 8 for row in rows)
    stiffness = [row[-1] / row[0] for row in rows]
    assert stiffness == sorted(stiffness) and stiffness[0] > 0.0
    assert (tmp_path / "example.png").stat().st_size > 0
    of_contact = program[program.index("import raymortar\n") :].split("\n")
    assert len(list(filter(None, of_contact))) <= 10


def test_the_ball_of_the_start_page_goes_as_far_as_it_says(tmp_path):
    """In balance, without a warning, and as deep as the page says."""
    plain, ball = blocks_of("README.md", "python")[:2]
    plain = plain[: plain.index("import raymortar\n")]
    loud = "import warnings, raymortar\n"
    loud += "warnings.simplefilter('error', raymortar.ContactWarning)\n"
    results = "print(*contact.results.resultant_on(ball).force)"
    way, *_, force = map(float, run(plain + loud + ball + results, tmp_path).split())
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    said, finer = map(
        float, re.search(r"(-0\.\d+) \((-0\.\d+) on a mesh", text).groups()
    )
    assert force == pytest.approx(1.0, rel=1e-6)
    assert way == pytest.approx(said, abs=1e-3)
    assert way == pytest.approx(finer, rel=2e-2)


@pytest.mark.quick
def test_the_start_page_is_read_at_once():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.count("\n") <= 110
    rows = text[text.index("## What it can do") :].count("\n| [")
    assert rows == 12


def test_a_solver_that_was_not_used_leaves_no_options(tmp_path):
    """PETSc, asked what options nothing has read, names none of ours at the end."""
    program = blocks_of("README.md", "python")[0]
    program = program[: program.index("for step in")]
    assert "SNESSolver" in program
    said = run(program, tmp_path, PETSC_OPTIONS="-options_left")
    asked = "options_left" in said or "no unused options" in said  # PETSc 3.25
    assert asked and "raymortar_snes" not in said


# What None means, where the page says that instead
STANDS_FOR_NONE = {
    "method": "AugmentedLagrangian()",
    "search": "Search()",
    "reach": "twice the facet's size",
    "depth": "twice the facet's size, less in thin bodies",
    "skin": "half the facet's size",
}


def rows_of(heading):
    """First two columns of the table of arguments in a section of the guide."""
    pages = ("parameters", "solving", "load_steps", "output")
    guide = "\n".join(
        (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in pages
    )
    section = re.search(
        rf"^## `{heading}\(.*?(?=^## |\Z)", guide, re.MULTILINE | re.DOTALL
    )[0]
    table = re.search(r"^\| argument .*?(?=^$|\Z)", section, re.MULTILINE | re.DOTALL)[
        0
    ]
    return dict(re.findall(r"^\| `(\w+)` \| *(.*?) *\|", table, re.MULTILINE))


@pytest.mark.quick
@pytest.mark.parametrize(
    "name",
    """Contact AugmentedLagrangian Penalty Search NonlinearProblem
    LoadSteps History plot""".split(),
)
def test_every_argument_has_a_row_with_its_default(name):
    rows = rows_of(name)
    parameters = inspect.signature(getattr(raymortar, name)).parameters
    assert list(rows) == list(parameters)
    for parameter in parameters.values():
        default, said = parameter.default, rows[parameter.name].strip("`")
        if default is inspect.Parameter.empty:
            assert said == ""
        elif parameter.name in STANDS_FOR_NONE:
            assert default is None and STANDS_FOR_NONE[parameter.name] in said
        else:
            assert said.replace('"', "'") == repr(default)
