"""Tension that multipliers show beside narrow contact is a finding, and no warning."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from boxes import COMM
from dolfinx import fem
from problems import fix, residual
from rigid_scenes import E, press

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactWarning,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    rigid,
)
from raymortar.core import compat


def indented(cell, n, depth=0.02, method=None, **options):
    """A block below a ball that touches few facets."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    centre = (0.45, 1.3, 0.0) if dim == 2 else (0.45, 0.5, 1.3)
    ball = rigid.Circle(centre[:2], 0.3) if dim == 2 else rigid.Sphere(centre, 0.3)
    scene = press(cell, rigid.Body(ball, name="ball"), n, method=method, **options)
    scene.solver = SNESSolver(scene.problem)
    down = np.eye(dim)[-1]

    def apply(t):
        scene.body.move(-depth * t * down)

    return scene, apply


def told(scene, apply, steps=2):
    """Findings of tension of each step of a path, which warns of none."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".*tension", ContactWarning)
        path = LoadSteps(scene.solver, apply, steps).run()
    return [one for step in path for one in step.findings if "tension" in one.text]


@pytest.mark.mpi
@pytest.mark.parametrize("multiplier", ["normal", "vector"])
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_tension_is_found_with_pair_share_and_place(cell, multiplier):
    method = AugmentedLagrangian(multiplier=multiplier)
    scene, apply = indented(cell, 6, 0.03, method)
    *_, last = told(scene, apply)
    assert last.pair == "(1, 'ball')" and len(last.place) == len(
        scene.contact.resultant().force
    )
    pressure = scene.contact.pressure().x.array
    ends = COMM.allgather((-pressure.min(initial=0.0), pressure.max(initial=0.0)))
    share = max(one[0] for one in ends) / max(one[1] for one in ends)
    assert share > 0.05
    assert last.size == pytest.approx(share, rel=0.5)
    assert last.remedy == "Refine the slave there if tractions count"
    (again,) = (one for one in scene.problem.check() if "tension" in one.text)
    assert again == last


@pytest.mark.mpi
@pytest.mark.parametrize(
    "method, friction, depth",
    [
        (Penalty(10.0 * E), None, 0.03),  # has none
        (None, Coulomb(0.3), 0.03),  # the law at points decides there
        (None, None, -0.01),  # does not touch
    ],
)
def test_no_tension_is_told_where_none_is_wrong(method, friction, depth):
    scene, apply = indented("quadrilateral", 6, depth, method, friction=friction)
    assert told(scene, apply) == []


@pytest.mark.mpi(where=lambda below, **_: below == 20)
@pytest.mark.parametrize(
    "below, above, stiffer, proposed",
    [(20, 50, 1e3, True), (20, 50, 0.01, False), (18, 6, 1e3, False)],
)
def test_the_other_order_is_proposed_to_fine_slaves(below, above, stiffer, proposed):
    """A round punch on a block: it is no better as the slave, finer and not softer."""
    contact, found = pressed(("punch", "block"), below, above, stiffer)
    ends = "pairs=[('block', 'punch')] lessens that"
    assert any(one.remedy.startswith(ends) for one in found) is proposed, found
    if proposed:
        other, found = pressed(("block", "punch"), below, above, stiffer)
        assert not any("lessens" in one.remedy for one in found)
        assert share_of_tension(other) < 0.5 * share_of_tension(contact)


def pressed(pair, below, above, stiffer):
    """A punch that is led at its back, pressed on a block, and what is told of tension."""
    sizes = dict.fromkeys(("lower_size", "upper_size"), (1.0, 1.0))
    scene = two_blocks(COMM, 2, "quadrilateral", below, above, gap=1e-3, **sizes)
    x = scene.mesh.geometry.x
    bulge = 0.8 * (x[:, 0] - 0.5) ** 2 * (2.0 - x[:, 1])
    x[:, 1] += np.where(x[:, 1] > 1.0, bulge, 0.0)
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    form, *_ = residual(scene, u, E={"lower": 1.0, "upper": stiffer})
    V, down = u.function_space, fem.Constant(scene.mesh, np.array((0.0, -0.02)))
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", value=down)]
    names = {"punch": scene.tags["slave"], "block": scene.tags["master"]}
    contact = Contact(u, scene.facet_tags, [pair], names=names)
    problem = NonlinearProblem(form, contact, bcs)
    problem.solve()
    return contact, [one for one in problem.check() if "tension" in one.text]


def share_of_tension(contact):
    """Largest tension of a node over the largest pressure."""
    normal = contact.multiplier.x.array
    ends = COMM.allgather((normal.max(initial=0.0), -normal.min(initial=0.0)))
    return max(end[0] for end in ends) / max(end[1] for end in ends)
