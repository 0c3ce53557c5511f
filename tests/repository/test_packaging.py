"""What is written in several places agrees: the version, and the types of the module."""

import ast
import re
import runpy
from email import message_from_string
from pathlib import Path

import pytest
import tomllib

import raymortar
from raymortar import _cpp

ROOT = Path(__file__).parents[2]
STUB = ROOT / "python" / "raymortar" / "_cpp.pyi"
SPACK = "packaging/spack/packages/py-raymortar/package.py"


def first(pattern, name):
    """First match of a pattern in a file of the source tree."""
    return re.search(pattern, (ROOT / name).read_text(encoding="utf-8"), re.M)[1]


@pytest.mark.parametrize(
    "pattern, name",
    [
        (r"project\(raymortar VERSION ([\d.]+)", "CMakeLists.txt"),
        (r'^version = "([\d.]+)"', "pyproject.toml"),
        (r"^version: ([\d.]+)", "CITATION.cff"),
        (r'^{% set version = "([\d.]+)"', "packaging/conda/meta.yaml"),
        (r'^    version\("([\d.]+)"\)', SPACK),
        (r"^## ([\d.]+), \d+ \w+ \d{4}$", "CHANGELOG.md"),
    ],
)
def test_version_is_the_same_everywhere(pattern, name):
    assert first(pattern, name) == raymortar.__version__


@pytest.mark.parametrize(
    "wanted, conda, spack",
    [
        (r'"scikit-build-core>=([\d.]+)"', "scikit-build-core", "py-scikit-build-core"),
        (r'"pybind11>=([\d.]+)"', "pybind11", "py-pybind11"),
        (r'^requires-python = ">=([\d.]+)"', "python", "python"),
    ],
)
def test_recipes_ask_for_the_versions_that_the_project_asks_for(wanted, conda, spack):
    version = first(wanted, "pyproject.toml")
    assert first(rf"^    - {conda} >=([\d.]+)$", "packaging/conda/meta.yaml") == version
    assert first(rf'depends_on\("{spack}@([\d.]+):"', SPACK) == version


def test_recipes_build_in_the_environment_at_hand():
    """With the packages that are there, of which DOLFINx brings most."""
    for name in ("packaging/Dockerfile", "packaging/conda/meta.yaml"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert "--no-build-isolation" in text and "--no-deps" in text
    cmake = first(r"cmake_minimum_required\(VERSION ([\d.]+)\)", "CMakeLists.txt")
    assert first(r'depends_on\("cmake@([\d.]+):"', SPACK) == cmake
    assert first(r"^    - cmake >=([\d.]+)$", "packaging/conda/meta.yaml") == cmake


@pytest.mark.parametrize("mpi", ["openmpi", "mpich"])
def test_conda_recipe_is_jinja_and_yaml(mpi):
    """As conda-build renders it, with names in place of its functions."""
    jinja2, yaml = pytest.importorskip("jinja2"), pytest.importorskip("yaml")
    folder = ROOT / "packaging" / "conda"
    variants = yaml.safe_load((folder / "conda_build_config.yaml").read_text())
    assert mpi in variants["mpi"]
    template = jinja2.Environment(undefined=jinja2.StrictUndefined).from_string(
        (folder / "meta.yaml").read_text()
    )
    values = {"PYTHON": "python", "CONDA_PY": "311", "PKG_HASH": "0123456", "mpi": mpi}
    functions = {"compiler": "{}_compiler".format, "stdlib": "{}_stdlib".format}
    recipe = yaml.safe_load(template.render(**values, **functions))
    assert (folder / recipe["source"]["path"]).resolve() == ROOT.resolve()
    needs = recipe["requirements"]
    assert {"cxx_compiler", "ninja"} <= set(needs["build"])
    for part in ("host", "run"):
        assert {mpi, "petsc * real_*", "petsc4py", "mpi4py"} <= set(needs[part])
    names = {one.split()[0] for one in needs["run"]}
    project = first(r"^dependencies = \[(.*)\]", "pyproject.toml")
    asked = set(re.findall(r'"([\w-]+)', project))
    assert asked <= names


def members(owner):
    """Public names of a module or class of its own, as pybind11 gives them."""
    names = {name for name in vars(owner) if not name.startswith("_")}
    # Of an enumeration's own machinery only the values are ours
    return names - {"name", "value"} if hasattr(owner, "__members__") else names


def annotated(body):
    """Public names that a stub defines."""
    names = set()
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign):
            names.add(node.target.id)
    return {name for name in names if not name.startswith("_")}


@pytest.mark.quick
def test_every_bound_name_has_a_type():
    stub = ast.parse(STUB.read_text(encoding="utf-8"))
    assert annotated(stub.body) == members(_cpp)
    for node in stub.body:
        if isinstance(node, ast.ClassDef) and node.name != "Error":
            bound = members(getattr(_cpp, node.name))
            assert annotated(node.body) == bound, node.name


def arguments(node):
    """Names of the arguments of a function of the stub."""
    parts = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
    return [part.arg for part in parts]


def bound_arguments(function):
    """Those of a function of the module, from the signature that pybind11 writes.

    Of several versions of it, those of the longest.
    """
    head = rf"^(?:\d+\. )?{function.__name__}\((.*)\)(?: ->.*)?$"
    versions = re.findall(head, function.__doc__, re.MULTILINE)
    names = (re.findall(r"(?:^|, )(\w+)(?=:|,|$)", version) for version in versions)
    return max(names, key=len)


def functions(body, owner):
    """Pairs of a stub's function and the bound one, of classes too."""
    for node in body:
        if isinstance(node, ast.ClassDef):
            yield from functions(node.body, getattr(owner, node.name))
        elif isinstance(node, ast.FunctionDef) and not node.decorator_list:
            yield node, getattr(owner, node.name)


@pytest.mark.quick
def test_every_bound_function_has_the_arguments_of_its_type():
    stub = ast.parse(STUB.read_text(encoding="utf-8"))
    pairs = list(functions(stub.body, _cpp))
    assert len(pairs) > 30
    for node, bound in pairs:
        names = bound_arguments(bound)
        # Names that pybind11 was not told are arg0, arg1, ...
        given = [
            ours for ours, name in zip(arguments(node), names) if "arg" not in name
        ]
        assert given == [name for name in names if "arg" not in name], node.name
        assert len(arguments(node)) == len(names), node.name


def test_every_public_name_is_documented():
    pages = (ROOT / "docs" / "api").glob("*.md")
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    marked = " ".join(re.findall(r"^<!-- api: (.*) -->$", text, re.M))
    named = set(re.findall(r"raymortar\.(\w+)", marked))
    assert set(raymortar.__all__) <= named


def test_wheels_of_cmake_have_the_metadata_of_the_project():
    """Those that are packed where there is no scikit-build-core."""
    names = runpy.run_path(str(ROOT / "packaging" / "wheel.py"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    found = message_from_string(names["metadata"](project))
    assert (found["Name"], found["Version"]) == (project["name"], project["version"])
    needs = [one for one in found.get_all("Requires-Dist") if "extra" not in one]
    assert needs == project["dependencies"]
    assert set(found.get_all("Provides-Extra")) == set(project["optional-dependencies"])
    assert found.get_payload().startswith("# raymortar")
