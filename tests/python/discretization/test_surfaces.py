"""Facets as arrays: tables, normals, identification."""

import sys

import numpy as np
import pytest
from boxes import (
    CELLS,
    COMM,
    DEGREES,
    box,
    curve,
    displacement,
    integrate,
    tag_sides,
    whole_boundary,
)

from raymortar.core.discretization.facets import (
    Facets,
    facet_node_table,
    facet_nodes,
    normals,
    shape_functions,
    tagged_facets,
)
from raymortar.core.discretization.surfaces import build_surface
from raymortar.setup.facets import check_areas, check_cells

pytestmark = pytest.mark.mpi


@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_tables_agree_with_the_geometry_of_the_facets(cell, p, g):
    mesh = box(cell, degree=g, move=curve)
    u, facets = displacement(mesh, p), whole_boundary(mesh)
    surface = build_surface(u, [facets])
    geometry = mesh.geometry.x[facet_node_table(mesh, facets), : surface.gdim]
    nodes = facet_nodes(surface.shape, surface.node_degree)
    values, _ = shape_functions(surface.shape, g, nodes)
    on_facet = np.einsum("qa,fad->fqd", values, geometry)
    assert np.allclose(surface.X[surface.facet_nodes], on_facet, atol=1e-13)

    u.interpolate(lambda x: x[: surface.gdim])
    at_dofs = u.x.array.reshape(-1, surface.gdim)[surface.dofs][surface.facet_dofs]
    nodes = facet_nodes(surface.shape, p)
    values, _ = shape_functions(surface.shape, g, nodes)
    on_facet = np.einsum("qa,fad->fqd", values, geometry)
    assert np.allclose(at_dofs, on_facet, atol=1e-13)


@pytest.mark.parametrize("ghosts", [False, True])
@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_closed_surface_has_outward_normals(cell, p, g, ghosts):
    mesh = box(cell, degree=g, ghosts=ghosts)
    gdim = mesh.geometry.dim
    surface = build_surface(displacement(mesh, p), [whole_boundary(mesh)])
    area = integrate(surface, lambda x, m: np.linalg.norm(m, axis=-1))
    volume = integrate(surface, lambda x, m: np.sum(x * m, axis=-1)) / gdim
    assert np.isclose(area, 2 * gdim, rtol=1e-12)
    assert np.isclose(volume, 1, rtol=1e-12)
    _, gradients = shape_functions(
        surface.shape, surface.node_degree, np.full((1, gdim - 1), 1 / 3)
    )
    nodes = surface.X[surface.facet_nodes]
    m = normals(np.einsum("iqa,fad->ifqd", gradients, nodes))[:, 0]
    assert np.all(np.sum(m * (nodes.mean(axis=1) - 0.5), axis=1) > 0)


@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_normals_of_a_closed_curved_surface_cancel(cell, p, g):
    mesh = box(cell, degree=g, move=curve)
    surface = build_surface(displacement(mesh, p), [whole_boundary(mesh)])
    assert np.allclose(integrate(surface, lambda x, m: m), 0, atol=1e-13)


@pytest.mark.parametrize("cell", CELLS)
def test_one_side_of_the_box(cell):
    mesh = box(cell, n=3)
    axis = mesh.geometry.dim - 1
    tags = tag_sides(mesh, (axis, 1.0), (axis, 0.0))
    top = tagged_facets(mesh, tags, 1, "slave")
    surface = build_surface(displacement(mesh), [top])
    assert np.allclose(integrate(surface, lambda x, m: m), np.eye(axis + 1)[axis])
    assert np.allclose(surface.X[:, axis], 1)


@pytest.mark.parametrize("p, g", DEGREES)
def test_ids_are_unique_over_ranks(p, g):
    mesh = box("tetrahedron", degree=g)
    surface = build_surface(displacement(mesh, p), [whole_boundary(mesh)])
    facets = np.concatenate(COMM.allgather(surface.facet_ids))
    assert len(facets) == len(set(facets)) == 6 * 2 * 2**2
    # A node has one position and a position one node, whichever rank looks.
    positions = np.vstack(COMM.allgather(surface.X)).round(9)
    node_ids = np.concatenate(COMM.allgather(surface.node_ids))
    pairs = {(i, *x) for i, x in zip(node_ids.tolist(), positions.tolist())}
    n_nodes = 26 if max(p, g) == 1 else 98
    assert len(pairs) == len(set(node_ids)) == n_nodes
    dof_ids = np.concatenate(COMM.allgather(surface.dof_ids))
    assert len(set(dof_ids)) == (26 if p == 1 else 98)


def test_zones_and_types():
    mesh = box("quadrilateral", n=3)
    tags = tag_sides(mesh, (1, 1.0), (1, 0.0))
    sets = [tagged_facets(mesh, tags, t, "master") for t in (2, 1)]
    surface = build_surface(displacement(mesh), sets)
    heights = surface.X[surface.facet_nodes, 1].mean(axis=1)
    assert np.allclose(heights, surface.zone)
    assert COMM.allreduce(len(surface.zone)) == 6
    for name in ("dofs", "facet_dofs", "facet_nodes", "zone"):
        assert getattr(surface, name).dtype == np.int32, name
    for name in ("dof_ids", "node_ids", "facet_ids"):
        assert getattr(surface, name).dtype == np.int64, name
    assert np.all(np.diff(surface.dofs) > 0)
    assert surface.facet_nodes is surface.facet_dofs


def test_rank_without_facets():
    mesh = box("hexahedron", n=1)
    facets = whole_boundary(mesh)
    none = Facets(3, *[facets.facets[:0]] * 3)
    surface = build_surface(displacement(mesh, 2), [none])
    assert surface.facet_dofs.shape == surface.facet_nodes.shape == (0, 9)
    assert surface.X.shape == (0, 3)
    assert len(surface.zone) == len(surface.facet_ids) == 0


def calls_of(action):
    """Number of function calls that an action makes, Python's and C's."""
    count = 0

    def note(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        action()
    finally:
        sys.setprofile(None)
    return count


def test_no_python_loop_runs_over_facets():
    mesh = box("hexahedron", n=3)
    u, facets = displacement(mesh, 2), whole_boundary(mesh)

    def make(repeats):
        names = ("facets", "cells", "local_facets")
        many = Facets(7, *[np.tile(getattr(facets, n), repeats) for n in names])
        build_surface(u, [many])
        check_areas(mesh, many)
        check_cells(mesh, many)

    make(1)  # tables that are made once
    # NumPy itself calls a little more for large arrays
    assert calls_of(lambda: make(1000)) < 1.1 * calls_of(lambda: make(1))
