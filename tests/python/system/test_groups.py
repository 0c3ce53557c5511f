"""Rows of a coupled system by body, patch of contact, free rigid body and field."""

from __future__ import annotations

import numpy as np
import pytest
from problems import COMM, build, fix, stack, worst

from raymortar import AugmentedLagrangian, Coulomb, Penalty

pytestmark = pytest.mark.mpi

WIDTHS = [1.0, 0.8]


def held(V, scene):
    return [fix(V, scene, "bottom")]


def blocks(cell, method, friction=None, unit=1.0):
    """Two blocks whose slave side has a known area."""
    scene = stack(cell, (2, 3), [unit, unit], [0.0, 0.0], [w * unit for w in WIDTHS])
    return build(scene, 1, method=method, friction=friction, bcs=held)


def grouped(case):
    return case.problem.convergence.groups


@pytest.mark.parametrize("unit", [1.0, 1e-3])
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_each_row_has_one_group(cell, unit):
    """Two bodies and one patch; the patch has the multiplier's rows, and its area."""
    case = blocks(cell, AugmentedLagrangian(), Coulomb(0.3), unit)
    groups = grouped(case)
    layout, d = case.contact.layout, case.dim
    assert (groups.bodies, groups.free, groups.count, groups.forces) == (2, 0, 3, 3)
    assert list(groups.is_patch) == [False, False, True]
    rows = groups.sum(np.ones(layout.size))
    space = case.u.function_space.dofmap.index_map.size_global * d
    assert rows[:2].sum() == space
    nodes = COMM.allreduce(len(layout.owned_multipliers))
    assert rows[2] == nodes * layout.components
    area = (WIDTHS[1] * unit) ** (d - 1)
    mass = COMM.allreduce(groups.mass.sum()) / layout.components
    assert mass == pytest.approx(area, rel=1e-12)
    assert groups.area == pytest.approx([area], rel=1e-12)


def test_sizes_are_those_of_the_bodies():
    """The diagonal of a box, or its distance from the origin if that is larger."""
    groups = grouped(blocks("quadrilateral", AugmentedLagrangian()))
    boxes = sorted(groups.size[:2])
    assert groups.largest >= boxes[-1]
    assert boxes[0] >= np.sqrt(2.0) - 1e-12
    assert groups.size[2] == groups.largest


def test_names_say_where():
    names = grouped(blocks("triangle", AugmentedLagrangian())).names()
    assert [name.split(" around ")[0] for name in names] == [
        "the body", "the body", "the contact"
    ]  # fmt: skip
    assert len(set(names)) == 3


def test_a_penalty_has_no_patch():
    groups = grouped(blocks("triangle", Penalty(100.0)))
    assert groups.count == groups.bodies == 2 and not groups.is_patch.any()


def test_largest_values_are_those_of_all_ranks():
    groups = grouped(blocks("triangle", AugmentedLagrangian()))
    local = np.arange(len(groups.of_row) * 9)[groups.fields[0].local]
    values = np.zeros(local.max() + 1)
    values[local] = -1.0 - COMM.rank
    assert worst(groups.largest_of_fields(values) - COMM.size) == 0.0
