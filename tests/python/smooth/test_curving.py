"""Straight facets as arcs: where their mid nodes lie."""

import warnings

from mpi4py import MPI

import numpy as np
import press_fits
import pytest
from dolfinx import fem
from problems import COMM, build, worst

from meshes.blocks import Block
from meshes.hertz import two_cylinders, two_spheres
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_blocks
from raymortar import Contact, ContactError, ContactWarning
from raymortar.core import compat
from raymortar.core.discretization.facets import N_CORNERS
from raymortar.core.discretization.surfaces import surface_areas

RADIUS, CHORD = 2.0, 0.27


def balls(cell, geometry_degree=1, comm=COMM):
    """Parts of two discs or balls with facets of one to three chords."""
    flat = cell in ("triangle", "quadrilateral")
    return (two_cylinders if flat else two_spheres)(
        comm,
        cell,
        geometry_degree,
        radius=RADIUS,
        contact_half_width=0.8,
        facets_across=6,
        sector="half" if flat else "quarter",
    )


def surfaces(contact):
    facets = contact.zones[0].facets
    return facets.slave_surface, facets.master_surface


def mid_nodes(surface):
    return surface.X[surface.facet_nodes[:, N_CORNERS[surface.shape] :]]


def off_the_balls(contact):
    """Largest distance of the surfaces' nodes from the two discs or balls."""
    found = 0.0
    for surface, side in zip(surfaces(contact), (1.0, -1.0)):
        X = surface.X.copy()
        X[:, -1] -= side * RADIUS
        found = max(found, worst(np.linalg.norm(X, axis=1) - RADIUS))
    return found


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("degree", (1, 2))
def test_mid_nodes_lie_on_a_circle_or_sphere(cell, degree):
    """At the poles, planes of symmetry and rims, too, and over the borders of ranks."""
    contact = build(balls(cell), degree, smooth=True).contact
    straight = off_the_balls(build(balls(cell), 2).contact)
    assert straight > 0.5 * CHORD**2 / (8.0 * RADIUS)
    # The middles of quadrilaterals are off by the fourth power of their sizes
    allowed = 5e-3 * straight if cell == "hexahedron" else 1e-14
    assert off_the_balls(contact) < allowed
    assert all(surface.node_degree == 2 for surface in surfaces(contact))


def sorted_mid_nodes(contact, comm):
    """Mid nodes of all ranks."""
    own = [mid_nodes(s).reshape(-1, s.gdim) for s in surfaces(contact)]
    found = np.concatenate(comm.allgather(np.concatenate(own)))
    return found[np.lexsort(np.round(found, 9).T)]


@pytest.mark.mpi
def test_ranks_agree(cell):
    alone, spread = (
        sorted_mid_nodes(build(balls(cell, comm=comm), smooth=True).contact, comm)
        for comm in (MPI.COMM_SELF, COMM)
    )
    assert np.abs(alone - spread).max() < 1e-13


@pytest.mark.mpi
def test_integrals_go_over_the_arc():
    scene = press_fits.scene_of(4, 5, geometry_degree=1)
    contact = press_fits.press_fit(scene, 1.0, 0.3, 0.0, 1, smooth=True).contact
    contact.update()
    exact = 0.5 * np.pi * press_fits.SHAFT
    area = COMM.allreduce(surface_areas(surfaces(contact)[0]).sum())
    assert area == pytest.approx(exact, rel=1e-4)
    weight = COMM.allreduce(contact.points()["weight"].sum())
    assert weight == pytest.approx(exact, rel=1e-4)


def test_a_function_puts_mid_nodes_on_the_true_surface(cell):
    def on_balls(x):
        y, side = x.copy(), np.sign(x[last])
        y[last] -= side * RADIUS
        y *= RADIUS / np.linalg.norm(y, axis=0)
        y[last] += side * RADIUS
        return y

    last = 1 if cell in ("triangle", "quadrilateral") else 2
    assert off_the_balls(build(balls(cell), smooth=on_balls).contact) < 1e-14


@pytest.mark.parametrize("dim", (2, 3))
def test_sharp_edges_and_flat_faces_stay(dim):
    """One tag on all sides of a block."""
    sides = ("left", "right", "bottom", "top", "front", "back")[: 2 * dim]
    blocks = [
        Block((2,) * dim, (0.0,) * dim, (1.0,) * dim, tags=dict.fromkeys(sides, 1)),
        Block((2,) * dim, (2.0,) * dim, (3.0,) * dim, tags=dict.fromkeys(sides, 2)),
    ]
    cell = "quadrilateral" if dim == 2 else "hexahedron"
    scene = Scene(*assemble_blocks(COMM, blocks, cell), {"slave": 1, "master": 2}, {})
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    contact = Contact(u, scene.facet_tags, [(1, 2)], smooth=True)
    for surface in surfaces(contact):
        corners = surface.X[surface.facet_nodes[:, : N_CORNERS[surface.shape]]]
        assert worst(surface.arcs) == 0.0
        assert worst(mid_nodes(surface)[:, -1] - corners.mean(axis=1)) < 1e-15


@pytest.mark.parametrize("smooth", (True, lambda x: x + 1.0))
def test_curved_meshes_stay(cell, smooth):
    with_it, without = (
        surfaces(build(balls(cell, 2), **options).contact)
        for options in ({"smooth": smooth}, {})
    )
    for one, other in zip(with_it, without):
        assert np.array_equal(one.X, other.X) and one.arcs is None


@pytest.mark.mpi
@pytest.mark.parametrize(
    "smooth, message",
    [
        ("yes", r"smooth = 'yes' must be True, False, or a function"),
        (lambda x: x[:, 0], r"smooth gives an array of shape \(3,\) for points"),
        (lambda x: x + 1.0, r"smooth moves the middle of an edge by 1\.4"),
        (lambda x: np.nan * x, r"smooth moves the middle of an edge by nan"),
    ],
)
def test_what_is_no_surface_is_refused(smooth, message):
    with pytest.raises(ContactError, match=message):
        build(two_blocks(COMM, 2), smooth=smooth)


def told(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        call()
    return [str(w.message) for w in caught]


@pytest.mark.mpi
@pytest.mark.parametrize("degrees, count", [(10.0, 0), (20.0, 1)])
def test_arcs_that_do_not_turn_with_their_facets_are_told_once(degrees, count):
    scene = press_fits.scene_of(geometry_degree=1)
    contact = press_fits.press_fit(scene, 1.0, 0.3, 0.1, 1, smooth=True).contact
    c, s = (f(np.deg2rad(degrees)) for f in (np.cos, np.sin))
    contact.u.interpolate(lambda x: np.array([[c - 1.0, -s], [s, c - 1.0]]) @ x[:2])
    found = told(contact.advance)
    assert len(found) == count
    if count:
        assert "slave tag 1 or its masters have turned by 20 degrees" in found[0]
    assert told(contact.advance) == []


def test_flat_surfaces_may_turn():
    contact = build(two_blocks(COMM, 2), smooth=True).contact
    contact.u.interpolate(lambda x: np.array([-x[1] - x[0], x[0] - x[1]]))
    assert told(contact.advance) == []
