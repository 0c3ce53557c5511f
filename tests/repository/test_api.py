"""Pages of docs/api are what signatures and docstrings say."""

from __future__ import annotations

import dataclasses
import importlib.machinery
import importlib.util
import inspect
import re
import subprocess
import sys

import pytest
from programs import ROOT

import raymortar
from raymortar import dynamics, fluxes, io, paths, results, rigid, solvers, tools
from raymortar.io import partitions
from raymortar.results.sums import Resultant, Statistics

FOLDER = ROOT / "docs" / "api"


@pytest.fixture(scope="module")
def api():
    """`scripts/api` as a module."""
    sys.path.insert(0, str(ROOT / "scripts"))
    loader = importlib.machinery.SourceFileLoader("api", str(ROOT / "scripts" / "api"))
    spec = importlib.util.spec_from_loader("api", loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def page():
    """Text of all pages."""
    return "\n".join(path.read_text(encoding="utf-8") for path in FOLDER.glob("*.md"))


@pytest.mark.quick
def test_every_page_is_up_to_date():
    command = [sys.executable, str(ROOT / "scripts" / "api"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_page_that_is_out_of_date_is_named(api, tmp_path):
    path = tmp_path / "page.md"
    path.write_text("# A page\n\n<!-- api: raymortar.Search -->\n<!-- end -->\n")
    make = api.Writer([path]).made
    assert api.generated.update([path], "api", make, check=False) == [path]
    assert api.generated.update([path], "api", make, check=True) == []
    path.write_text(path.read_text().replace("depth=None", "depth=1.0"))
    assert api.generated.update([path], "api", make, check=True) == [path]


@pytest.mark.quick
@pytest.mark.parametrize(
    "name",
    [
        name
        for name in raymortar.__all__
        if inspect.isclass(getattr(raymortar, name))
        and not issubclass(getattr(raymortar, name), (Exception, int))
    ],
)
def test_signatures_are_those_that_python_sees(page, name):
    """The pages are read off the sources, this is what is imported."""
    made = getattr(raymortar, name)
    parameters = list(inspect.signature(made).parameters)
    shown = re.search(rf"^raymortar\.{name}\((.*)\)$", page, re.MULTILINE)
    if shown is None:  # what users do not make has attributes instead
        names = [field.name for field in dataclasses.fields(made)]
        assert names == parameters
        section = page[page.index(f"## {name}\n") :]
        assert all(f"`{one}`" in section for one in names)
    else:
        call = inspect.signature(eval(f"lambda {shown[1]}: 0", {"nan": 0.0}))
        assert list(call.parameters) == parameters


@pytest.mark.quick
@pytest.mark.parametrize(
    "module", [dynamics, fluxes, io, partitions, paths, results, rigid, solvers, tools]
)
def test_every_name_of_a_module_is_on_a_page(page, module):
    public = [name for name in module.__all__ if callable(getattr(module, name))]
    assert len(public) > 1
    missing = [
        name
        for name in public
        if f"## {name}\n" not in page and f"- **`{name}(" not in page
    ]
    assert missing == []


@pytest.mark.quick
@pytest.mark.parametrize("kind", [Statistics, Resultant])
def test_results_are_listed_by_name(page, kind):
    section = page[page.index(f"## {kind.__name__}\n") :]
    rows = re.findall(r"^\| (`.*?) \|.*\| (.*) \|$", section, re.MULTILINE)
    said = {one.strip("`") for row, text in rows if text for one in row.split(", ")}
    assert {field.name for field in dataclasses.fields(kind)} <= said


@pytest.mark.quick
def test_points_and_history_list_their_names(page):
    contact = page[page.index("## Contact\n") :]
    points = contact[contact.index("**`points(zone=0, master=None)`**") :][:4000]
    for name in ("gap", "pressure", "traction", "slip", "status", "weight", "pair"):
        assert f"`{name}`" in points
    history = page[page.index("## History\n") :]
    for name in ("time", "iterations", "force_ring_plate_x", "friction_work", "energy"):
        assert f"`{name}`" in history
