"""Places of integration points in the mesh, pressures and slips of every method."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
from dolfinx import fem
from load_paths import blocks
from problems import COMM, DIMENSION, build, worst
from sheared_blocks import METHODS, SLIP, Blocks, limit_of
from slave_functions import function_of
from squeezing import squeeze

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    Coulomb,
    History,
    Penalty,
    rigid,
)
from raymortar.core import compat


def field(x):
    return 1.0 + 2.0 * x[0] - x[1] ** 2 + x[0] * x[-1]


def monomials(points):
    """Products of any of the coordinates, (n, 2^d)."""
    powers = np.indices((2,) * points.shape[1]).reshape(points.shape[1], -1).T
    return np.prod(points[:, None, :] ** powers[None], axis=2)


@pytest.mark.mpi
@pytest.mark.parametrize("geometry_degree", [1, 2])
def test_points_are_found_in_the_mesh(cell, geometry_degree):
    """A Function at the points, by DOLFINx and by hand on the reference cell."""
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, 3, 2, geometry_degree=geometry_degree)
    contact = build(scene).contact
    shift = np.linspace(0.01, 0.03, dim)
    contact.u.x.array[:] = np.tile(shift, len(contact.u.x.array) // dim)
    contact.update()
    points, mesh = contact.points(), scene.mesh
    X = points["X"]
    assert worst(points["x"] - X - shift) <= 1e-14
    f = function_of(mesh, field)
    padded = np.pad(X, ((0, 0), (0, 3 - dim)))
    values = f.eval(padded, points["cell"]).ravel() if len(X) else np.empty(0)
    assert worst(values - field(padded.T)) <= 1e-12
    # Vertices come first among the nodes of a cell; cells are straight
    vertices = compat.basix_element(cell, 1).vertices
    nodes = compat.geometry_dofmap(mesh)[points["cell"]][:, : len(vertices)]
    N = monomials(points["reference"]) @ np.linalg.pinv(monomials(vertices))
    corners = mesh.geometry.x[nodes, :dim]
    assert worst(np.einsum("qa,qad->qd", N, corners) - X) <= 1e-13
    tagged = scene.facet_tags.find(scene.tags["slave"])
    assert set(points["facet"]) <= set(tagged)
    assert np.array_equal(
        points["facet"], contact.zones[0].facets.slave.facets[points["slave"]]
    )


@pytest.mark.mpi
@pytest.mark.parametrize(
    "method",
    [AugmentedLagrangian(), AugmentedLagrangian(multiplier="vector"), Penalty(1e5)],
    ids=["normal", "vector", "penalty"],
)
def test_pressure_is_positive_in_compression(cell, method):
    """A uniform compression; 0 off the slave. Averages by hand are the same."""
    problem, _, P = squeeze(blocks(cell), method=method)
    problem.solve()
    contact = problem.contact
    pressure, normal = contact.pressure(), contact.traction("normal")
    nodes = np.unique(np.concatenate([z.result_table.ravel() for z in contact.zones]))
    penalty = isinstance(method, Penalty)
    found = pressure.x.array[nodes] / -P[-1, -1]
    assert worst(found - 1.0) <= (0.02 if penalty else 1e-6)
    vectors = normal.x.array.reshape(-1, problem.dim)
    assert (
        worst(np.linalg.norm(vectors, axis=1) - pressure.x.array) <= 1e-9 * -P[-1, -1]
    )
    points = contact.points()
    by_hand = contact.results.to_nodes(
        -np.einsum("qi,qi->q", points["traction"], points["normal"])
    )
    assert worst(by_hand.x.array[nodes] - pressure.x.array[nodes]) <= 1e-9 * -P[-1, -1]
    gap, again = contact.gap().x.array, contact.results.to_nodes(points["gap"], "g")
    assert again.name == "g"
    np.testing.assert_array_equal(again.x.array, gap)
    x = contact.results.to_nodes(points["x"]).x.array.reshape(-1, problem.dim)
    assert np.array_equal(np.isnan(x[:, 0]), np.isnan(gap))


@pytest.mark.mpi
def test_values_that_are_not_one_for_each_point_are_refused():
    contact = build(two_blocks(COMM, 2, "triangle", gap=-0.01)).contact
    contact.update()
    with pytest.raises(ContactError, match="are not one for each point"):
        contact.results.to_nodes(np.zeros(len(contact.points()["gap"]) + 1))


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
@pytest.mark.parametrize("method", [AugmentedLagrangian(), Penalty(10.0)])
def test_slip_without_friction_is_that_with_none(cell, method):
    """Of a random step; with friction it is known anyway."""
    found = []
    for friction in (None, Coulomb(0.0)):
        scene = two_blocks(COMM, DIMENSION[cell], cell, 3, 2, gap=-0.02)
        contact = build(scene, method=method, friction=friction).contact
        X = contact.u.function_space.tabulate_dof_coordinates()[:, : DIMENSION[cell]]
        for shift in (0.01, 0.03):
            u = shift * np.sin(3.0 * X + shift)
            contact.u.x.array[:] = u.ravel()
            contact.update()
            if shift == 0.01:
                contact.advance()
        found.append(contact.slip().x.array.copy())
        if friction is not None:
            points = contact.points()
            along = np.einsum("qi,qi->q", points["slip"], points["normal"])
            assert worst(along) <= 1e-16
            assert worst(points["slip"]) > 1e-3
        # Of the accepted step until the next one has an iterate
        contact.advance()
        np.testing.assert_array_equal(contact.slip().x.array, found[-1])
        contact.update()
        assert worst(contact.slip().x.array) <= 1e-15
    np.testing.assert_allclose(*found, atol=1e-15)


def test_slip_without_friction_on_a_tool():
    mesh = two_blocks(COMM, 2, "quadrilateral", 3, 2)
    u = fem.Function(compat.vector_space(mesh.mesh, 1))
    line = rigid.Body(rigid.Line((0.0, 1.01), (0.0, -1.0)))
    contact = Contact(u, mesh.facet_tags, [(mesh.tags["master"], line)])
    contact.update()
    line.move((0.3, 0.0))
    contact.update()
    points = contact.points()
    nodes = np.unique(contact.zones[0].result_table[points["slave"]])
    slip = contact.slip().x.array.reshape(-1, 2)[nodes]
    assert worst(slip - np.array([-0.3, 0.0])) <= 1e-15


def largest(vectors):
    """Largest length of any rank's vectors."""
    longest = np.linalg.norm(vectors, axis=1).max(initial=0.0)
    return COMM.allreduce(longest, op=MPI.MAX)


def slid(contact):
    """Largest accumulated slip, for the columns of a history."""
    return lambda: largest(contact.results.accumulated_slip().x.array[:, None])


@pytest.mark.mpi
@pytest.mark.parametrize("method", METHODS)
def test_slip_accumulates_over_accepted_steps(cell_2d, method):
    """Forth and back, in steps of two sizes; `restore` brings it back."""
    law = Coulomb(0.3)
    slides = {1: (0.1, 0.0), 2: (0.05, 0.1, 0.05, 0.0)}
    for parts, path in slides.items():
        block = Blocks(cell_2d, METHODS[method](), law)
        block.press()
        contact, k, total = block.contact, limit_of(law, 2), 0.0
        for number, slide in enumerate(path):
            sign = 1.0 if number < len(path) // 2 else -1.0
            block.drive(sign * k, slide)
            block.problem.solve()
            assert block.statuses() == {SLIP}
            total += largest(contact.points()["slip"])
            before = contact.state()
            recorded = History(block.problem.problem, more={"slid": slid(contact)})
            recorded.record(0.0, 0, 0)
            assert recorded["slid"][0] == slid(contact)() < total
            contact.advance()
            assert slid(contact)() == pytest.approx(total, rel=1e-7)
        contact.update()
        points = contact.points()
        assert worst(points["accumulated_slip"] - total) <= 1e-7 * total
        contact.restore(before)
        assert (
            largest(contact.results.accumulated_slip().x.array[:, None]) < 0.8 * total
        )


@pytest.mark.mpi
def test_accumulated_slip_needs_friction():
    contact = build(two_blocks(COMM, 2, "triangle")).contact
    with pytest.raises(ContactError, match="slip is accumulated with friction only"):
        contact.results.accumulated_slip()
