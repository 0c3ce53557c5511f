"""Contact that jumps from facet to facet of a curved surface is told."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from materials import lame
from slender import held_strip
from strips import strip, tag_where

from raymortar import ContactWarning, LoadSteps, Penalty, SNESSolver, rigid

LENGTH, THICK, TIP, WIDE = 10.0, 1.5, 8.0, 1.5


def lowest(x, lip):
    """Height of the lower side, with a round lip."""
    ramp = np.clip((x - TIP) / WIDE, -1.0, 1.0)
    return -0.5 * lip * (1.0 + np.cos(np.pi * ramp))


def passing(cells, lip, mu, overlap=0.2, **options):
    """What is told where a circle passes below a cantilever, across its lip."""

    def below(x):
        down = lowest(x[:, 0], lip) * (1.0 - x[:, 1] / THICK)
        return x + np.column_stack([np.zeros_like(down), down])

    mesh = strip(*cells, LENGTH, THICK, below)
    tags = tag_where(
        mesh,
        lambda x: (x[0] > 5.9) & np.isclose(x[1], lowest(x[0], lip)),
        lambda x: np.isclose(x[0], 0.0),
    )
    start = TIP + 1.0
    centre = start, lowest(start, lip) - 1.0
    circle = rigid.Body(rigid.Circle(centre, 1.0), name="nub")
    problem = held_strip(mesh, tags, lame(2500.0, 0.35), [circle], mu, **options)

    def apply(t):
        """Up first, then along."""
        up, along = min(4.0 * t, 1.0), max(4.0 * t - 1.0, 0.0) / 3.0
        circle.move((-0.9 * along, overlap * up - 0.1 * along))

    return narrow(problem, apply, 8)


def narrow(problem, apply, steps):
    """What a path tells of narrow contact."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        LoadSteps(SNESSolver(problem), apply, steps, progress=False).run()
    return [str(w.message) for w in caught if "narrower" in str(w.message)]


@pytest.mark.mpi
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_lip_of_few_facets_is_told_once_with_place_and_remedy(mu):
    found = passing((20, 3), 0.8, mu)
    assert len(found) == 1, found
    assert found[0].startswith("(1, 'nub') at (")
    assert "times smaller" in found[0]


@pytest.mark.mpi
def test_so_is_a_penalty_without_a_law_at_nodes():
    found = passing((20, 3), 0.8, 0.0, method=Penalty())
    assert len(found) == 1, found


@pytest.mark.mpi
def test_facets_of_one_plane_are_not_told():
    assert passing((20, 3), 0.0, 0.3) == []


def test_the_normal_of_the_law_does_not_matter():
    assert len(passing((20, 3), 0.8, 0.0, frame="master")) == 1


@pytest.mark.mpi
def test_contact_that_stays_elsewhere_on_the_surface_is_not_told():
    """A circle slides over the flat top of a block, another one rests below it."""
    mesh = strip(16, 8, 2.0, 1.0)
    tags = tag_where(
        mesh,
        lambda x: np.isclose(x[1], 0.0) | np.isclose(x[1], 1.0),
        lambda x: np.isclose(x[0], 0.0) | np.isclose(x[0], 2.0),
    )
    above = rigid.Body(rigid.Circle((0.5625, 1.3), 0.3), name="above")
    below = rigid.Body(rigid.Circle((1.0625, -0.3), 0.3), name="below")
    problem = held_strip(mesh, tags, lame(40.0, 0.3), [above, below], 0.0)

    def apply(t):
        down, along = min(5.0 * t, 1.0), max(t - 0.2, 0.0)
        above.move((0.875 * along, -0.01 * down))
        below.move((0.0, 0.01 * down))

    assert narrow(problem, apply, 12) == []
