"""The Gmsh scripts in meshes/: each writes the file beside it, which users can read."""

import re
import subprocess
import sys
from pathlib import Path

import mesh_measures as measure
import numpy as np
import pytest
from problems import COMM

from raymortar import ContactError, io
from raymortar.core import compat
from raymortar.core.discretization.surfaces import find_bodies

gmsh = pytest.importorskip("gmsh")

FOLDER = Path(__file__).parents[2] / "meshes"
FILES = sorted(FOLDER.glob("*.msh"))
NAMES = [file.stem for file in FILES]
# Versions of Gmsh make other meshes of what is not structured
UNSTRUCTURED = {"cylinder_on_block", "ball_on_block", "ring_in_groove"}
EACH = pytest.mark.parametrize("name", NAMES)


def counts(file):
    """Nodes, elements by type, and physical groups by name, of a Gmsh file."""
    gmsh.initialize(["", "-v", "1"])
    try:
        gmsh.open(str(file))
        model = gmsh.model
        types, tags, _ = model.mesh.getElements()
        numbers = dict(zip(map(int, types), map(len, tags)))
        nodes = len(model.mesh.getNodes()[0])
        groups = {model.getPhysicalName(*g): g for g in model.getPhysicalGroups()}
    finally:
        gmsh.finalize()
    return nodes, numbers, groups


def test_every_file_has_a_script_and_a_row():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)
    with_main = [
        script.stem
        for script in FOLDER.glob("*.py")
        if "main(draw, __file__)" in script.read_text(encoding="utf-8")
    ]
    assert sorted(rows) == sorted(with_main) == NAMES
    assert all(file.stat().st_size < 200_000 for file in FILES)


@EACH
def test_a_script_writes_the_file_beside_it(name, tmp_path):
    written = tmp_path / f"{name}.msh"
    command = [sys.executable, str(FOLDER / f"{name}.py"), "--output", str(written)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    ours, kept = counts(written), counts(FOLDER / f"{name}.msh")
    assert f"{ours[0]} nodes" in said
    assert ours[2] == kept[2] and list(ours[1]) == list(kept[1])
    if name not in UNSTRUCTURED:
        assert ours[:2] == kept[:2]
    assert ours[0] == pytest.approx(kept[0], rel=0.2)


def read(name):
    """A file as a user reads it. Collective."""
    _, _, groups = counts(FOLDER / f"{name}.msh")
    gdim = max(dim for dim, _ in groups.values())
    return io.read_gmsh(FOLDER / f"{name}.msh", COMM, gdim=gdim), groups


@EACH
@pytest.mark.mpi
def test_bodies_are_apart_and_surfaces_on_their_outside(name):
    bodies, groups = read(name)
    mesh, dim = bodies.mesh, bodies.mesh.topology.dim
    assert bodies.names == groups
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    row = re.search(rf"^\| `{name}` \|.*$", page, re.MULTILINE)[0]
    assert set(re.findall(r"`(\w+)`", row)) == {name, *groups}
    exterior = set(compat.exterior_facets(mesh))
    for group, (of_dim, tag) in groups.items():
        found = bodies.find(group)
        assert COMM.allreduce(len(found)) > 0
        tags = bodies.cell_tags if of_dim == dim else bodies.facet_tags
        assert np.array_equal(found, tags.indices[tags.values == tag])
        if of_dim < dim:
            owned = measure.owned_facets(mesh, bodies.facet_tags, tag)
            assert set(owned) <= exterior
    of_dim = [group for group in groups.values() if group[0] == dim]
    assert find_bodies(compat.vector_space(mesh, 1)).count == len(of_dim)


@pytest.mark.mpi
def test_curved_bodies_have_the_areas_of_their_shapes():
    """Facets of degree 2 follow circles to 1e-3 of what straight ones miss."""
    bodies, groups = read("press_fit")
    for name, radius in {
        "bore": 0.5,
        "shaft_outside": 1.002,
        "hub_inside": 1.0,
    }.items():
        length = measure.area(bodies.mesh, bodies.facet_tags, groups[name][1])
        assert length == pytest.approx(2.0 * np.pi * radius, rel=1e-5)
    bodies, groups = read("ball_on_block")
    area = measure.area(bodies.mesh, bodies.facet_tags, groups["sphere"][1])
    # A quarter of half a sphere
    assert area == pytest.approx(0.5 * np.pi, rel=2e-3)


@pytest.mark.mpi
def test_a_name_that_is_no_group_is_refused():
    bodies, _ = read("two_blocks_2d")
    with pytest.raises(ContactError, match="is named 'lid'; known names: 'bottom'"):
        bodies.find("lid")
