"""The law that a contact chooses where its method leaves it open, and what it says."""

from __future__ import annotations

import logging

import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import field_space
from problems import COMM, stack
from strips import neo_hookean, strip, tag_where

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    Coulomb,
    NonlinearProblem,
    Penalty,
    Tie,
    rigid,
    tools,
)
from raymortar.core import compat
from raymortar.fluxes import Flux

pytestmark = pytest.mark.mpi


def assert_alike(found, wanted):
    """Two forces are equal but for rounding: ranks add in any order."""
    assert np.linalg.norm(found - wanted) <= 1e-9 * np.linalg.norm(wanted)


OPEN = AugmentedLagrangian(condition=None)
DUAL = AugmentedLagrangian(condition="nodes", multiplier="dual")


def blocks(cell, degree, method, **options):
    scene = stack(cell, (2, 3))
    u = fem.Function(compat.vector_space(scene.mesh, degree), name="u")
    pair = scene.tags["slave"], scene.tags["master"]
    return scene, Contact(u, scene.facet_tags, [pair], method, **options)


def pressed(scene, contact):
    """Solve for blocks that are pressed together and, below, dragged."""
    u = contact.u
    v = ufl.TestFunction(u.function_space)
    dim = scene.mesh.geometry.dim
    F = ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx
    down = np.zeros(dim)
    down[0], down[-1] = 0.01, -0.02
    V, tags = u.function_space, scene.facet_tags
    bcs = [
        tools.prescribe(V, tags.find(scene.tags["bottom"])),
        tools.prescribe(V, tags.find(scene.tags["top"]), down),
    ]
    problem = NonlinearProblem(F, contact, bcs)
    problem.solve()
    return contact.resultant().force


def condition_of(contact):
    return contact.method.condition, contact.method.multiplier


@pytest.mark.parametrize("friction", [None, Coulomb(0.3)], ids=["none", "friction"])
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral", "tetrahedron"])
def test_degree_1_has_dual_multipliers_at_nodes(cell, friction, caplog, monkeypatch):
    monkeypatch.setattr(logging.root.manager, "disable", 0)  # by demos of this process
    with caplog.at_level(logging.INFO, logger="raymortar"):
        scene, chosen = blocks(cell, 1, OPEN, friction=friction)
    assert condition_of(chosen) == ("nodes", "dual")
    assert "condition='nodes') as displacements have degree 1" in repr(chosen)
    told = [m for m in caplog.messages if "law at nodes with dual multipliers" in m]
    assert len(told) == (1 if COMM.rank == 0 else 0)
    same, given = blocks(cell, 1, DUAL, friction=friction)
    assert_alike(pressed(scene, chosen), pressed(same, given))
    assert " as " not in repr(given)


@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_degree_2_has_a_law_at_points(cell):
    scene, chosen = blocks(cell, 2, OPEN)
    same, given = blocks(cell, 2, AugmentedLagrangian())
    assert_alike(pressed(scene, chosen), pressed(same, given))
    assert condition_of(chosen) == ("points", None)
    assert "as displacements have degree 2" in repr(chosen)


@pytest.mark.parametrize("degree, condition", [(1, "nodes"), (2, "points")])
@pytest.mark.parametrize("multiplier", ["normal", "vector"])
def test_a_multiplier_that_is_given_stays(degree, condition, multiplier):
    method = AugmentedLagrangian(condition=None, multiplier=multiplier)
    _, contact = blocks("triangle", degree, method)
    assert condition_of(contact) == (condition, multiplier)
    method = AugmentedLagrangian(condition=None, multiplier="dual")
    _, contact = blocks("triangle", degree, method)
    assert condition_of(contact) == ("nodes", "dual")


def test_a_law_that_is_given_stays():
    for method in (AugmentedLagrangian(condition="points"), DUAL, Penalty()):
        scene, contact = blocks("triangle", 1, method)
        assert contact.method == method
        pressed(scene, contact)
        assert contact.method == method


@pytest.mark.parametrize("friction", [None, Coulomb(0.2)], ids=["none", "friction"])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_bodies_that_bend_have_the_law_at_nodes(friction, unit, caplog):
    """A strip 60 times as long as thick, and a block, of degree 2 below a circle."""
    for length, bends in ((60.0, True), (2.0, False)):
        mesh = strip(20 if bends else 4, 1 if bends else 2, length * unit, unit)
        tags = tag_where(
            mesh,
            lambda x: x[1] > (1.0 - 1e-6) * unit,
            lambda x: np.abs(x[0] - 0.5 * length * unit) > (0.5 * length - 1e-6) * unit,
        )
        u = fem.Function(compat.vector_space(mesh, 2), name="u")
        circle = rigid.Body(
            rigid.Circle((0.5 * length * unit, 1.5 * unit), 0.5 * unit), name="tool"
        )
        contact = Contact(u, tags, [(1, circle)], OPEN, friction=friction)
        bcs = [tools.prescribe(u.function_space, tags.find(2))]
        with caplog.at_level(logging.INFO, logger="raymortar"):
            problem = NonlinearProblem(neo_hookean(u, 1e3 / unit), contact, bcs)
        assert contact.method.condition == ("nodes" if bends else "points")
        assert ("bodies bend" in repr(contact)) == bends
        circle.move((0.0, -0.02 * unit))
        problem.solve()
        assert contact.method.condition == ("nodes" if bends else "points")
        given = AugmentedLagrangian(condition=contact.method.condition)
        u.x.array[:] = 0.0
        circle.move((0.0, 0.0))
        other = Contact(u, tags, [(1, circle)], given, friction=friction)
        again = NonlinearProblem(neo_hookean(u, 1e3 / unit), other, bcs)
        circle.move((0.0, -0.02 * unit))
        again.solve()
        assert_alike(contact.resultant().force, other.resultant().force)
        assert str(contact.gamma) == str(other.gamma)


def test_what_takes_tractions_at_points_has_a_vector():
    scene, contact = blocks("triangle", 1, OPEN)
    T = fem.Function(field_space(scene.mesh, 1), name="T")
    Flux(contact, T, lambda T_s, T_m, p, g, v: p * (T_s - T_m))
    assert condition_of(contact) == ("nodes", "vector")
    assert "as Flux takes tractions at points" in repr(contact)
    same, given = blocks(
        "triangle", 1, AugmentedLagrangian(condition="nodes", multiplier="vector")
    )
    assert_alike(pressed(scene, contact), pressed(same, given))


@pytest.mark.parametrize("cell", ["triangle", "tetrahedron"])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
@pytest.mark.parametrize("radius, condition", [(0.1, "points"), (1.0, "nodes")])
def test_tools_smaller_than_a_facet_meet_points(cell, unit, radius, condition):
    scene = stack(cell, (2, 2), heights=[unit] * 2, widths=[unit] * 2)
    u = fem.Function(compat.vector_space(scene.mesh, 1), name="u")
    dim = scene.mesh.geometry.dim
    centre = unit * np.array((0.5,) * (dim - 1) + (2.0 + radius,))
    tool = (rigid.Circle if dim == 2 else rigid.Sphere)(centre, radius * unit)
    contact = Contact(u, scene.facet_tags, [(scene.tags["top"], tool)], OPEN)
    assert contact.method.condition == condition
    small = "a master is smaller than the slave's facets"
    assert (small in repr(contact)) == (condition == "points")


def test_a_law_that_is_in_use_stays():
    scene, contact = blocks("triangle", 1, OPEN)
    pressed(scene, contact)
    T = fem.Function(field_space(scene.mesh, 1), name="T")
    with pytest.raises(ContactError, match="take multiplier='vector'"):
        Flux(contact, T, lambda T_s, T_m, p, g, v: p * (T_s - T_m))
    assert condition_of(contact) == ("nodes", "dual")


def test_a_tie_holds_at_points():
    scene = stack("triangle", (2, 3))
    u = fem.Function(compat.vector_space(scene.mesh, 1), name="u")
    pair = scene.tags["slave"], scene.tags["master"]
    tie = Tie(u, scene.facet_tags, [pair], OPEN)
    assert condition_of(tie) == ("points", None)
    assert " as " not in repr(tie)


@pytest.mark.skipif(COMM.size > 1, reason="ranks refuse it together, in a Contact")
def test_a_condition_that_is_none_of_these_is_refused():
    with pytest.raises(ContactError, match="condition must be one of"):
        AugmentedLagrangian(condition="nowhere")
    with pytest.raises(ContactError, match="needs condition='nodes'"):
        AugmentedLagrangian(condition="points", multiplier="dual")
