"""Tools that a slave meets on no path: in another unit, or beside it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from rigid_scenes import press

from raymortar import ContactWarning, LoadSteps, SNESSolver, rigid

MISSED = "has met no facet"


def told(found, *applied):
    """Warnings of missed tools on paths, one after the other."""
    solver = SNESSolver(found.problem)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        for apply in applied:
            LoadSteps(solver, apply, 2).run()
    return [str(w.message) for w in caught if MISSED in str(w.message)]


def scene(x, y, radius=0.3):
    body = rigid.Body(rigid.Circle((x, y), radius))
    return body, press("quadrilateral", body, n=3)


def down(body, depth):
    return lambda t: body.move((0.0, -depth * t))


@pytest.mark.mpi
@pytest.mark.parametrize(
    "x, y, radius, depth",
    (
        (500.0, 1300.0, 300.0, 0.0),
        (500.0, 1300.0, 300.0, 10.0),
        (5.0, 1.35, 0.3, 0.1),
    ),
    ids=("at rest in another unit", "moved in another unit", "moved beside the slave"),
)
def test_a_tool_that_is_met_nowhere_is_told(x, y, radius, depth):
    body, found = scene(x, y, radius)
    (text,) = told(found, down(body, depth))
    assert "rigid Circle has met no facet of slave tag 1" in text
    assert f"({x:g}, {y - depth:g})" in text and "(0, 1) and (1, 1)" in text


@pytest.mark.mpi
def test_a_tool_that_waits_for_a_later_path_is_not_told():
    """One presses, the other one rests three sizes of the block away."""
    pressed = rigid.Body(rigid.Circle((0.5, 1.31), 0.3))
    waiting = rigid.Body(rigid.Circle((0.5, 4.3), 0.3))
    found = press("quadrilateral", [pressed, waiting], n=3)
    assert not told(found, down(pressed, 0.05))


@pytest.mark.mpi
def test_a_tool_that_was_met_may_leave():
    body, found = scene(0.5, 1.31)
    away = (lambda t: body.move((0.0, -0.05 + t)), lambda t: body.move((0.0, 1.0 + t)))
    assert not told(found, down(body, 0.05), *away)
    assert found.u.x.array == pytest.approx(np.zeros_like(found.u.x.array), abs=1e-9)
