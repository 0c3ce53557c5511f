"""Masters with facets that a slave meets on no path."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, fix, residual

from meshes.scenes import two_blocks
from raymortar import (
    Contact,
    ContactWarning,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    SNESSolver,
    rigid,
)
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
    assert "it ends 0.9 behind, at (" in text
    assert "Is a tag that of another face, or has a step gone" in text


def test_a_step_through_a_master_out_of_reach_is_told():
    (text,) = told([CONTACT], -6.3, gap=4.5)
    assert "has met no facet of master 'master'" in text and " behind, at (" in text


@pytest.mark.mpi
def test_a_motion_too_short_to_meet_is_told():
    (text,) = told([CONTACT], -0.001, gap=5.0)
    assert "it ends 5 away, at (" in text and "another unit?" in text


@pytest.mark.parametrize("ways", [(0.0,), (-0.05,), (-0.05, 0.5, 3.0)])
def test_nothing_is_told_at_rest_in_contact_or_after_it(ways):
    assert not told([CONTACT], *ways)


@pytest.mark.parametrize("side, count", [("upper_right", 1), ("upper_left", 0)])
def test_beside_contact_only_a_slave_behind_its_master_is_told(side, count):
    """The right side is behind the lower block's left one, the left one above it."""
    assert len(told([CONTACT, (side, "lower_left")], -0.05)) == count


@pytest.mark.parametrize(
    "way, beside, count",
    [(-6.3, 0.0, 1), (-0.5, 0.0, 0), (3.0, 0.0, 0), (-6.3, 1.2, 0)],
)
def test_a_solve_by_itself_tells_of_a_master_that_it_has_passed(way, beside, count):
    """Not of one that it has passed by, beside it, or that it may reach in steps as
    this one."""
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
    assert all(
        "(tag 4) so far: it ends" in text and " behind, at (" in text for text in texts
    )


def alone(pair, way, gap=0.0, loads=1, scale=1.0, friction=None, between=None):
    """Warnings of solves that are no part of a path; with friction they drag as well."""
    scene = two_blocks(COMM, 2, "quadrilateral", 3, 2, gap=gap)
    scene.mesh.geometry.x[:] *= scale
    V = vector_space(scene.mesh, 1)
    u, top = fem.Function(V), fem.Constant(scene.mesh, np.zeros(2))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]
    tags, named = scene.facet_tags, {"names": scene.tags}
    contact = Contact(u, tags, [pair], friction=friction, **named)
    problem = NonlinearProblem(residual(scene, u)[0], contact, bcs)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        for k in range(1, loads + 1):
            top.value[-1] = k * way * scale
            top.value[0] = 0.0 if friction is None else -k * way * scale
            problem.solve()
            if between is not None:
                between(contact)
    return [str(w.message) for w in caught]


@pytest.mark.mpi
@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize(
    "pair, gap, end",
    [
        (WRONG, 0.0, "it ends 0.9 behind"),
        (("upper_left", "master"), 0.5, "it ends 0.4"),
        (CONTACT, 5.0, "it ends 4.9"),
    ],
    ids=["behind", "turned away", "far"],
)
def test_a_solve_by_itself_tells_at_once_of_contact_that_it_cannot_meet(
    pair, gap, end, scale
):
    (text,) = alone(pair, -0.1, gap, scale=scale)
    assert "so far: it ends" in text and (end in text or scale != 1.0)


@pytest.mark.mpi
def test_a_solve_by_itself_tells_of_a_plane_far_below_once():
    plane = rigid.Line((0.0, -7.0), (0.0, 1.0))
    (text,) = alone(("slave", plane), -0.1, loads=2)
    assert "the rigid Line has met no facet of slave 'slave' (tag 3) so far" in text


@pytest.mark.parametrize(
    "pair, way, gap", [(CONTACT, -0.001, 1.0), (CONTACT, -0.3, 5.0), (WRONG, 0.0, 0.0)]
)
def test_a_solve_by_itself_is_silent_on_the_way_and_at_rest(pair, way, gap):
    assert not alone(pair, way, gap)


@pytest.mark.mpi
def test_solves_that_nobody_accepts_are_told_once_with_friction():
    (text,) = alone(CONTACT, -0.01, loads=5, friction=Coulomb(0.1))
    assert text.startswith("3 solves under other loads without contact.advance()")


@pytest.mark.parametrize("then", ["advance", "restore", "same loads", "no friction"])
def test_solves_that_are_accepted_or_taken_back_are_not_told(then):
    begin = []

    def between(contact):
        begin.append(contact.state())
        if then == "advance":
            contact.advance()
        elif then == "restore":
            contact.restore(begin[0])

    friction = None if then == "no friction" else Coulomb(0.1)
    way = 0.0 if then == "same loads" else -0.01
    assert not alone(CONTACT, way, loads=5, friction=friction, between=between)


def test_solves_that_stick_are_not_told():
    """Their end is the same however it is reached."""
    assert not alone(CONTACT, -0.01, loads=5, friction=Coulomb(2.0))
