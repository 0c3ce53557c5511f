"""Masters with facets that a slave meets on no path."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, fix, residual

from meshes.scenes import two_blocks
from raymortar import Contact, ContactWarning, LoadSteps, NonlinearProblem, SNESSolver
from raymortar.tools import vector_space

MISSED = "has met no facet"
WRONG, CONTACT = ("slave", "bottom"), ("slave", "master")


def told(pairs, *ways, gap=0.0, cell="quadrilateral"):
    """Warnings of paths that move the upper block, one after the other."""
    scene = two_blocks(COMM, DIMENSION[cell], cell, 3, 2, gap=gap)
    V = vector_space(scene.mesh, 1)
    u, top = fem.Function(V), fem.Constant(scene.mesh, np.zeros(V.mesh.geometry.dim))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]
    contacts = [
        Contact(u, scene.facet_tags, [pair], names=scene.tags) for pair in pairs
    ]
    given = contacts[0] if len(contacts) == 1 else contacts
    problem = NonlinearProblem(residual(scene, u)[0], given, bcs)
    solver, begin = SNESSolver(problem), 0.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        for way in ways:

            def move(t, begin=begin, way=way):
                top.value[-1] = begin + t * way

            LoadSteps(solver, move, 2).run()
            begin += way
    return [str(w.message) for w in caught if MISSED in str(w.message)]


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_a_wrong_tag_is_told_once(cell):
    (text,) = told([WRONG], -0.1, -0.1, cell=cell)
    assert text.startswith("slave 'slave' (tag 3) has met no facet of master 'bottom'")
    assert "it ends behind it, 0.9 away, at (" in text
    assert "Is a tag of the pair that of another face, or has a step gone" in text


def test_a_step_through_a_master_out_of_reach_is_told():
    (text,) = told([CONTACT], -6.3, gap=4.5)
    assert "has met no facet of master 'master'" in text and "ends behind it" in text


@pytest.mark.mpi
def test_a_motion_too_short_to_meet_is_told():
    (text,) = told([CONTACT], -0.001, gap=5.0)
    assert "it ends 5 away, at (" in text and "another unit than the mesh?" in text


@pytest.mark.parametrize("ways", [(0.0,), (-0.05,), (-0.05, 0.5, 3.0)])
def test_nothing_is_told_at_rest_in_contact_or_after_it(ways):
    assert not told([CONTACT], *ways)


@pytest.mark.parametrize("side, count", [("upper_right", 1), ("upper_left", 0)])
def test_beside_contact_only_a_slave_behind_its_master_is_told(side, count):
    """The right side is behind the lower block's left one, the left one above it."""
    assert len(told([CONTACT, (side, "lower_left")], -0.05)) == count


@pytest.mark.parametrize(
    "way, beside, count",
    [(-6.3, 0.0, 1), (-0.001, 0.0, 0), (3.0, 0.0, 0), (-6.3, 1.2, 0)],
)
def test_a_solve_by_itself_tells_of_a_master_that_it_has_passed(way, beside, count):
    """Not of one that it has passed by, beside it."""
    scene = two_blocks(COMM, 2, "quadrilateral", 3, 2, gap=4.5)
    x = scene.mesh.geometry.x
    x[x[:, 1] > 2.0, 0] += beside
    V = vector_space(scene.mesh, 1)
    u, top = fem.Function(V), fem.Constant(scene.mesh, np.zeros(2))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]
    contact = Contact(u, scene.facet_tags, [CONTACT], names=scene.tags)
    problem = NonlinearProblem(residual(scene, u)[0], contact, bcs)
    top.value[-1] = way
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        problem.solve()
        contact.advance()
        problem.solve()
    texts = [str(w.message) for w in caught]
    assert len(texts) == count
    assert all("(tag 4) so far: it ends behind it" in text for text in texts)
