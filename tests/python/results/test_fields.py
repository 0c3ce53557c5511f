"""Fields for output, segments as VTK files, tags by name."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, build
from squeezing import squeezed
from written import arrays

import raymortar
from meshes.scenes import two_blocks
from raymortar import ContactError, Coulomb
from raymortar.core import compat
from raymortar.io import write_xdmf

WIDTH, OVERHANG = 1.0, 0.25


@pytest.fixture
def overhanging(cell):
    """Upper block that sticks out by a quarter of its width, pressed in by 0.01."""
    scene = two_blocks(
        COMM,
        DIMENSION[cell],
        cell,
        4,
        3,
        overhang=OVERHANG,
        gap=-0.01,
        geometry_degree=1,
    )
    problem = build(scene, friction=Coulomb(0.3))
    problem.contact.update()
    return problem


# Fields


@pytest.mark.mpi
@pytest.mark.quick
def test_fields_have_the_results_of_the_single_calls(overhanging):
    contact = overhanging.contact
    fields = {f.name: f for f in contact.fields()}
    singles = [
        contact.multiplier,
        contact.gap(),
        contact.traction("normal"),
        contact.traction("tangential"),
        contact.status(),
        contact.slip(),
    ]
    assert set(fields) == {f.name for f in singles} | {"coverage"}
    for f in singles:
        exact = np.where(np.isnan(f.x.array), 0.0, f.x.array)
        assert np.array_equal(fields[f.name].x.array, exact)
    beyond = np.isnan(contact.gap().x.array)
    assert not fields["coverage"].x.array[beyond].any()


@pytest.mark.mpi
def test_coverage_is_one_under_the_master_and_zero_beyond_it(overhanging):
    """Of nodes with covered facets only and with uncovered facets only."""
    coverage = overhanging.contact.results.coverage()
    X = coverage.function_space.tabulate_dof_coordinates()
    nodes = np.concatenate([z.result_table.ravel() for z in overhanging.contact.zones])
    nodes = np.unique(nodes)
    x, values = X[nodes, 0], coverage.x.array[nodes]
    h, edge = WIDTH / 3, WIDTH  # the lower block ends at x = 1
    assert np.allclose(values[x < edge - h], 1.0, atol=1e-12)
    assert np.all((values >= 0.0) & (values <= 1.0))
    partly = COMM.allreduce(int(np.count_nonzero((values > 0.0) & (values < 1.0))))
    assert partly > 0
    # A rank may know nodes of the surface that none of its own facets has
    surface = np.concatenate(COMM.allgather(X[nodes]))
    apart = np.linalg.norm(X[:, None] - surface, axis=-1).min(axis=1) > 1e-12
    assert not coverage.x.array[: len(X)][apart].any()


@pytest.mark.mpi
@pytest.mark.quick
def test_fields_go_into_one_file(overhanging, folder):
    path = folder / "contact.xdmf"
    contact = overhanging.contact
    mesh = overhanging.u.function_space.mesh
    write_xdmf(path, mesh, [overhanging.u, *contact.fields()])
    COMM.barrier()
    text = path.read_text()
    for f in contact.fields():
        assert f'Name="{f.name}"' in text


# VTK files


def measures(data):
    """Lengths of the lines or areas of the plane polygons of a file."""
    ends = data["offsets"].astype(int)
    areas = []
    for begin, end in zip([0, *ends[:-1]], ends):
        p = data["Points"][begin:end]
        if end - begin == 2:
            areas.append(np.linalg.norm(p[1] - p[0]))
            continue
        fan = np.cross(p[1:-1] - p[0], p[2:] - p[0])
        areas.append(np.linalg.norm(fan.sum(axis=0)) / 2)
    return np.array(areas)


@pytest.mark.mpi
@pytest.mark.quick
def test_segments_of_all_ranks_tile_what_the_master_covers(overhanging, folder):
    """Area of the polygons and weights of the points, against the closed form."""
    path = folder / "segments.vtu"
    overhanging.contact.results.write_segments(path)
    rank = f"_{COMM.rank}" if COMM.size > 1 else ""
    polygons = arrays(path.with_name(f"segments{rank}.vtu"))
    points = arrays(path.with_name(f"segments_points{rank}.vtu"))
    covered = (WIDTH - OVERHANG) * WIDTH ** (overhanging.dim - 2)
    assert abs(COMM.allreduce(measures(polygons).sum()) / covered - 1) <= 1e-12
    hit = points["status"] >= 1
    assert abs(COMM.allreduce(points["weight"][hit].sum()) / covered - 1) <= 1e-12
    assert np.allclose(polygons["gap"], -0.01, atol=1e-14)
    assert np.allclose(points["gap"][hit], -0.01, atol=1e-14)
    # The multiplier is zero and nothing is solved: the law's pressure is gamma g
    gamma = overhanging.contact.gamma
    assert np.allclose(points["pressure"][hit], 0.01 * gamma, rtol=1e-12)
    if COMM.size > 1:
        sources = [
            e.get("Source")
            for e in ElementTree.parse(path.with_suffix(".pvtu")).iter("Piece")
        ]
        assert sources == [f"segments_{r}.vtu" for r in range(COMM.size)]


@pytest.mark.mpi
def test_segments_need_a_vtu_name_that_can_be_written(overhanging, tmp_path):
    with pytest.raises(ContactError, match="must end in .vtu"):
        overhanging.contact.results.write_segments(tmp_path / "segments.vtk")
    with pytest.raises(ContactError, match="nowhere/s.vtu cannot be written"):
        overhanging.contact.results.write_segments(tmp_path / "nowhere" / "s.vtu")


# Names


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("kind", ["tags", "groups"])
def test_pairs_by_name_are_those_by_number(kind):
    scene = two_blocks(COMM, 2, "triangle", 2, 2)
    names = scene.tags
    if kind == "groups":  # as Gmsh's physical groups are read
        names = {name: (1, tag) for name, tag in names.items()} | {"solid": (2, 7)}
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    named = raymortar.Contact(u, scene.facet_tags, [("slave", "master")], names=names)
    tags = [(scene.tags["slave"], scene.tags["master"])]
    numbered = raymortar.Contact(u, scene.facet_tags, tags)
    for a, b in zip(named.zones, numbered.zones):
        assert a.facets.slave_tag == b.facets.slave_tag
        assert a.facets.master_tags == b.facets.master_tags


@pytest.mark.mpi
@pytest.mark.parametrize(
    "pair, names, message",
    [
        (
            ("slave", "mster"),
            {"slave": 3, "master": 4},
            "'mster'; known names: 'slave'",
        ),
        (("slave", "master"), None, "'slave'; known names: none: pass names="),
        (("solid", "master"), {"solid": (2, 1), "master": (1, 4)}, "named 'solid'"),
    ],
)
def test_unknown_names_are_refused(pair, names, message):
    scene = two_blocks(COMM, 2, "triangle", 2, 2)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    with pytest.raises(ContactError, match=message):
        raymortar.Contact(u, scene.facet_tags, [pair], names=names)


@pytest.mark.mpi
def test_fields_of_a_solved_problem_without_friction():
    scene = two_blocks(COMM, 2, "triangle", 3, 2)
    problem = build(scene, material="neo-hookean", bcs=squeezed)
    problem.solve()
    names = [f.name for f in problem.contact.fields()]
    assert "slip" not in names and "multiplier" in names
