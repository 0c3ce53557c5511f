"""Folds that cannot meet as they are given, and what is told of them."""

from __future__ import annotations

import numpy as np
import pytest
import states
from balances import out_of_balance
from dolfinx import fem
from dolfinx import mesh as dmesh
from folding import SKIN, pinched, u_strip
from problems import fix, residual

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ContactWarning,
    NonlinearProblem,
    Penalty,
    compat,
)

pytestmark = [pytest.mark.mpi, pytest.mark.quick]
GAMMA = 50.0


def test_a_start_that_overlaps_is_told_with_its_depth():
    scene = u_strip("quadrilateral")
    x = scene.mesh.geometry.x
    x[:, :2] += pinched(x[:, :2], 0.08)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    skin = scene.tags["skin"]
    contact = Contact(u, scene.facet_tags, [(skin, skin)], Penalty(GAMMA))
    F = residual(scene, u, "neo-hookean", 10.0)[0]
    problem = NonlinearProblem(F, contact, [fix(u.function_space, scene, "outer")])
    with pytest.warns(
        ContactWarning, match=r"tag 77 starts 0.0[78]\d* deep in tag 77 at"
    ):
        problem.solve()


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
