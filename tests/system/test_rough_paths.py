"""Paths that arrive with nothing tuned, at few iterations a step."""

import loose_scenes
import numpy as np
import pytest
from pathing import take
from slender import BELT_FRICTION, belt


@pytest.mark.parametrize("cells", [67, 134])
def test_a_belt_slides_around_its_pulley(cells):
    """Every sliding step but the first two by full steps; exp(mu pi), less what
    thickness and bending take."""
    path = belt(cells)
    found = take(path)
    assert found.arrived and found.halvings == 0
    assert found.tangents <= 230
    assert found.ways["full"] >= 26
    assert max(step.iterations for step in found.steps[6:]) <= 8
    assert path.result()[0] == pytest.approx(np.exp(BELT_FRICTION * np.pi), rel=6e-3)


def test_all_tangents_are_counted():
    """Those of solves that failed, too: the belt's first sliding step has some."""
    found = take(belt(67))
    assert sum(step.tangents for step in found.steps) == found.tangents
    assert found.tangents > found.iterations
    assert all(step.solves >= 1 for step in found.steps)
    assert any(step.solves > 1 for step in found.steps)


@pytest.mark.parametrize("stabilize", [None, True])
def test_a_free_disc_lands_and_stays(stabilize):
    """Also with nothing said; a caught body costs nothing in later steps."""
    pytest.importorskip("gmsh")
    path = loose_scenes.disc()
    found = take(path, stabilize=stabilize)
    assert found.arrived and found.halvings == 0
    assert found.tangents <= 80
    assert max(step.tangents for step in found.steps[1:]) <= 16
    assert abs(path.result()[0]) < 0.5
    force = path.problem.contact.resultant().force
    assert force[1] == pytest.approx(5.0, rel=1e-2)
