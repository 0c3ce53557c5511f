"""Tension that multipliers show beside narrow contact is told, once."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from boxes import COMM
from rigid_scenes import E, press

from raymortar import (
    AugmentedLagrangian,
    ContactWarning,
    Coulomb,
    LoadSteps,
    Penalty,
    SNESSolver,
    rigid,
)


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
    """Warnings of a path."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        LoadSteps(scene.solver, apply, steps).run()
    return [str(w.message) for w in caught if "tension" in str(w.message)]


@pytest.mark.mpi
@pytest.mark.parametrize("multiplier", ["normal", "vector"])
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_tension_is_told_once_with_pair_share_and_place(cell, multiplier):
    method = AugmentedLagrangian(multiplier=multiplier)
    scene, apply = indented(cell, 6, 0.03, method)
    found = told(scene, apply)
    assert len(found) == 1, found
    assert "of the largest pressure between (1, 'ball')" in found[0]
    pressure = scene.contact.pressure().x.array
    ends = COMM.allgather((-pressure.min(initial=0.0), pressure.max(initial=0.0)))
    share = max(one[0] for one in ends) / max(one[1] for one in ends)
    assert share > 0.05
    apply(0.9)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "converged with tension")
        scene.solver.solve()


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
