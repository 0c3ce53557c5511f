"""Penalties that let bodies pass are told, with the coefficient that holds them."""

import warnings

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, build, fix

from meshes.scenes import two_blocks
from raymortar import ContactWarning, LoadSteps, Penalty, SNESSolver

pytestmark = [pytest.mark.quick, pytest.mark.mpi]
FACET = 0.12


def told(gamma, push, unit=1.0, E=1.0, path=None):
    """Warnings of a solve, or of a path through several depths, and the case."""
    scene = two_blocks(
        COMM, 2, "quadrilateral", 6, 5, lower_size=unit, upper_size=0.6 * unit
    )
    down = fem.Constant(scene.mesh, 0.0)
    case = build(
        scene,
        E=E,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", 1, down)]
        + [fix(V, s, "top", 0)],
        method=Penalty(gamma),
    )
    solver = SNESSolver(case.problem)

    down.value = -push * unit
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        if path is None:
            solver.solve()
        else:

            def apply(t):
                down.value = -np.interp(t, np.linspace(0, 1, len(path)), path)

            LoadSteps(solver, apply, steps=len(path) - 1).run()
    return [str(w.message) for w in caught if "gamma" in str(w.message)], case


@pytest.mark.parametrize("unit, E", [(1.0, 1.0), (1e-3, 2e11)])
@pytest.mark.parametrize(
    "share, push, tells",
    [
        (1e-9, 0.05, True),
        (1e-2, 0.05, True),
        (0.1, 0.05, False),
        (1.0, 0.5, False),
        # A coefficient that is hardly larger would change hardly anything
        (0.92, 0.5, False),
    ],
)
def test_a_soft_penalty_is_told_with_the_right_coefficient(share, push, tells, unit, E):
    automatic = told(None, 0.0, unit, E)[1].contact.gamma
    found, case = told(share * automatic, push, unit, E)
    assert len(found) == tells
    for text in found:
        assert f"gamma = {share * automatic:.3g} is {share:.3g} times the auto" in text
        remedy = float(text.partition("contact.set_gamma(")[2].partition(")")[0])
        assert remedy == pytest.approx(automatic, rel=0.01)
        # With which nothing is told
        assert told(remedy, push, unit, E)[0] == []


def test_a_path_tells_once_and_where_it_is_twice_as_deep():
    depths = FACET * np.array([0.0, 0.08, 0.12, 0.2, 0.3, 0.5, 0.7])
    found, _ = told(1e-9, 0.0, path=depths)
    for text, share in zip(found, ("0.12", "0.3", "0.7"), strict=True):
        assert f", {share} of its facet" in text
