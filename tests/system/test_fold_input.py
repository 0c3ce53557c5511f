"""Folds that cannot meet as they are given, and what is told of them."""

from __future__ import annotations

import contextlib
import warnings

import numpy as np
import pytest
import states
from balances import nodal_forces, out_of_balance
from dolfinx import fem
from dolfinx import mesh as dmesh
from folding import SKIN, pinched, u_strip
from problems import fix, residual

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ContactWarning,
    ConvergenceError,
    NonlinearProblem,
    Penalty,
)
from raymortar.core import compat

pytestmark = [pytest.mark.mpi, pytest.mark.quick]
GAMMA = 50.0


def start(cell, depth):
    """Solve a fold whose legs overlap by a depth in the mesh, all of it held."""
    scene = u_strip(cell)
    x, dim = scene.mesh.geometry.x, scene.mesh.geometry.dim
    x[:, :dim] += pinched(x[:, :dim].copy(), depth)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    skin = scene.tags["skin"]
    contact = Contact(u, scene.facet_tags, [(skin, skin)], Penalty(GAMMA))
    F = residual(scene, u, "neo-hookean", 10.0)[0]
    problem = NonlinearProblem(F, contact, [fix(u.function_space, scene, "outer")])
    problem.solve()


def test_a_start_that_overlaps_is_told_with_its_depth():
    message = r"tag 77 starts 0.0[78]\d* deep in tag 77 at"
    with pytest.warns(ContactWarning, match=message):
        start("quadrilateral", 0.08)


@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_walls_that_start_deep_in_themselves_are_told_with_their_place(cell):
    """Deeper than half of their thickness, where rays see another wall."""
    message = r"tag 77 starts inside itself, deeper than 0\.\d* \(half of .* at \("
    with pytest.warns(ContactWarning, match=message):
        with contextlib.suppress(ConvergenceError):
            start(cell, 0.25)


def test_walls_that_touch_are_not_told():
    """Legs on each other, and wholly apart."""
    for depth in (0.0, -0.1):
        with warnings.catch_warnings():
            warnings.simplefilter("error", ContactWarning)
            start("quadrilateral", depth)


@pytest.mark.parametrize("method", [None, AugmentedLagrangian(1.0)])
def test_multipliers_are_refused_with_what_to_take(method):
    scene = u_strip("triangle")
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    with pytest.raises(ContactError, match=r"take method=Penalty\(\)"):
        Contact(u, scene.facet_tags, [(SKIN, SKIN)], method)


def test_tags_that_share_vertices_meet_with_a_penalty():
    """Legs that are tags of their own, with the bottom of the fold in one of them."""
    whole = u_strip("quadrilateral")
    tags, mesh = whole.facet_tags, whole.mesh
    right = dmesh.locate_entities_boundary(mesh, 1, lambda x: x[0] > -1e-9)
    values = np.where(
        (tags.values == SKIN) & np.isin(tags.indices, right), 78, tags.values
    )
    halves = compat.meshtags(mesh, 1, tags.indices, values.astype(np.int32))
    u = fem.Function(compat.vector_space(mesh, 1))
    with pytest.raises(ContactError, match="share 1 vertex.*or take method=Penalty"):
        Contact(u, halves, [(SKIN, 78)])
    contact = Contact(u, halves, [(SKIN, 78)], Penalty(GAMMA))
    u.x.array[:] = pinched(states.dof_positions(u.function_space), 0.03).ravel()
    contact.update()
    force, moment = out_of_balance(contact)
    assert force < 1e-13
    assert moment < 1e-12
    assert np.abs(contact.resultant().force[0]) > 0.1


def test_a_mesh_that_is_turned_over_has_outward_normals_all_the_same():
    """Cells of negative orientation: the mirrored forces, in balance."""
    found = []
    for sign in (1.0, -1.0):
        scene = u_strip("triangle")
        u = fem.Function(compat.vector_space(scene.mesh, 1))
        moved = pinched(states.dof_positions(u.function_space), 0.03)
        u.x.array[:] = (moved * [sign, 1.0]).ravel()
        scene.mesh.geometry.x[:, 0] *= sign
        contact = Contact(u, scene.facet_tags, [(SKIN, SKIN)], Penalty(GAMMA))
        contact.update()
        found.append(nodal_forces(contact) * [sign, 1.0])
        assert out_of_balance(contact)[0] < 1e-13
    assert np.abs(found[0]).max() > 0.01
    np.testing.assert_allclose(*found, atol=1e-12)
