"""The order of the library's stages, and the equations its comments cite."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "check_layers"

THEORY = "```math\na = b \\qquad (2.5)\n```\n```math\nc = d \\qquad (2.6)\n```\n"


def check(*arguments):
    """Return code of the script, and what it complained about."""
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.returncode, run.stderr


def make_tree(root: Path, files: dict[str, str]) -> Path:
    """A source tree with a header in every stage, and some more files."""
    stages = (
        "core",
        "geometry",
        "pairing",
        "mortar",
        "law",
        "element",
        "interface",
        "fem",
    )
    headers = {f"cpp/raymortar/{stage}/some.h": "" for stage in stages}
    empty = {"python/raymortar/__init__.py": "", "docs/theory/index.md": THEORY}
    for name, text in {**headers, **empty, **files}.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return root


@pytest.mark.quick
def test_this_tree_keeps_the_order():
    """The script that a developer runs by hand finds nothing."""
    code, complaint = check()
    assert (code, complaint) == (0, "")


@pytest.mark.parametrize(
    "name, text",
    [
        ("mortar/a.h", '#include "raymortar/pairing/some.h"\n#include <vector>'),
        ("mortar/a.h", "// petsc.h is not included"),
        ("element/a.cpp", '#include "raymortar/law/some.h"'),
        ("interface/a.h", '#include "raymortar/element/some.h"'),
        ("fem/a.cpp", '#include "raymortar/interface/some.h"'),
        ("fem/a.cpp", '#include "raymortar/element/some.h"\n#include <petscmat.h>'),
        ("law/a.h", "/// t = p n   [theory (2.5)-(2.6)]"),
        ("law/a.h", "/// t = p n, see theory\n/// (2.5) and (2.6)"),
    ],
)
def test_what_is_allowed_passes(tmp_path, name, text):
    """Stages may look down, fem may see PETSc, equations that exist are cited."""
    assert check(make_tree(tmp_path, {f"cpp/raymortar/{name}": text})) == (0, "")


# Files in which one rule is broken, and what is said of them
CPP = [
    ("geometry/a.h", '#include "raymortar/mortar/some.h"', "geometry may include"),
    ("law/a.h", '#include "raymortar/geometry/some.h"', "law may include only"),
    ("mortar/a.h", '#include "raymortar/law/some.h"', "mortar may include only"),
    ("element/a.cpp", "# include <mpi.h>", "only fem includes"),
    ("interface/a.h", "#include <mpi.h>", "only fem includes"),
    ("interface/a.h", '#include "raymortar/fem/some.h"', "interface may include"),
    ("element/a.h", '#include "raymortar/interface/some.h"', "element may include"),
    ("pairing/a.cpp", "  #include <petscsys.h>", "only fem includes"),
    ("fem/a.cpp", "#include <pybind11/pybind11.h>", "neither Python nor DOLFINx"),
    ("fem/a.cpp", '#include "zone.h"', "own headers are included as"),
    ("fem/a.cpp", '#include "raymortar/core/none.h"', "there is no such header"),
    ("extra/a.h", "", "extra is not one of"),
    ("law/a.h", "/// [theory (2.7)]", "cites theory (2.7)"),
    ("law/a.h", "/// [theory (2.5)-(2.8)]", "cites theory (2.7)"),
    ("law/a.h", "/// theory\n/// (2.5), (3.1)", "cites theory (3.1)"),
]
# Imports within functions and those of types count too
PYTHON = [
    (
        "core/interface/a.py",
        "if TYPE_CHECKING:\n    from ..contact import Contact",
        "imports contact, above it",
    ),
    ("core/problem.py", "from ..paths.b import c", "imports paths, above it"),
    ("core/problem.py", "from .. import tools", "imports tools, above it"),
    ("core/discretization/a.py", "from .. import contact", "imports contact, above it"),
    (
        "core/compat/a.py",
        "def f():\n    from ..discretization import b",
        "imports discretization, above it",
    ),
    ("results/a.py", "from ..paths import b", "imports paths, above it"),
    ("extra.py", "", "extra is not one of"),
    ("core/extra.py", "", "extra is not one of"),
    ("core/contact.py", "# theory (9.9)", "cites theory (9.9)"),
]
FAULTS = [("cpp", *fault) for fault in CPP] + [("python", *fault) for fault in PYTHON]


@pytest.mark.parametrize("language, name, text, complaint", FAULTS)
def test_what_is_not_allowed_is_named(tmp_path, language, name, text, complaint):
    """The file and the rule that it breaks."""
    path = f"{language}/raymortar/{name}"
    code, said = check(make_tree(tmp_path, {path: text}))
    assert code == 1
    assert path in said and complaint in said


def test_rooms_may_import_from_the_same_room_and_below(tmp_path):
    """Types, too."""
    text = (
        "from . import b\nfrom ... import _cpp\nfrom ..discretization.c import d\n"
        "if TYPE_CHECKING:\n    from ..discretization.e import F"
    )
    tree = make_tree(tmp_path, {"python/raymortar/core/interface/a.py": text})
    assert check(tree) == (0, "")


def test_floors_may_import_the_core_and_lower_floors(tmp_path):
    """A floor's modules import each other, too."""
    text = "from ..core import contact\nfrom ..rigid import a\nfrom .b import c"
    tree = make_tree(tmp_path, {"python/raymortar/paths/a.py": text})
    assert check(tree) == (0, "")


def test_an_equation_number_is_unique(tmp_path):
    """A number that is given twice says nothing."""
    code, said = check(make_tree(tmp_path, {"docs/theory/index.md": THEORY + THEORY}))
    assert code == 1 and "(2.5) more than once" in said
