"""Gmsh problems in metres that arrive as they are set up at first, default by default."""

import warnings

import numpy as np
import pytest
from first_tries import E, disc_on_block, ring_in_groove, snap_fit
from told import refuse_warnings

from raymortar import LoadSteps

pytest.importorskip("gmsh")


def run(problem, apply, steps, **options):
    """The path, without a warning of contact."""
    path = LoadSteps(problem.solver, apply, steps, **options)
    with warnings.catch_warnings():
        refuse_warnings()
        path.run()
    return path


def test_a_ring_is_squeezed_in_its_groove():
    """Free but for contact, it lies on the groove's bottom, under the lid, at first."""
    ring = ring_in_groove()

    def apply(t):
        ring.moves["lid"].value[1] = -1e-3 * t

    path = run(ring, apply, 10)
    assert path.halvings == 0
    supports = dict(zip(("groove", "lid"), ring.problem.bcs))
    forces = ring.problem.reactions(supports)
    lid = forces["lid"]
    assert np.abs(forces["groove"] + lid).max() <= 1e-9 * abs(lid[1])
    # Lindley's formula, at a fifth of the thickness: a fit to cords of other rubber
    expected = (1.25 * 0.2**1.5 + 50.0 * 0.2**6) * E * 5e-3
    assert -lid[1] == pytest.approx(expected, rel=0.25)
    assert abs(lid[0]) < 0.02 * abs(lid[1])


@pytest.mark.parametrize("gap", [0.0, 1e-6, 0.1, 5.0])
def test_a_free_disc_finds_its_seat(gap):
    """Under its weight alone, from a gap in diameters."""
    disc = disc_on_block(0.2 * gap)
    path = run(disc, disc.load, 4, stabilize=True)
    assert path.halvings == 0
    # The mesh's area of a circle of radius 0.1
    weight = 1e5 * np.pi * 0.01
    force = disc.contact.resultant().force
    assert force[1] == pytest.approx(weight, rel=1e-4)
    assert abs(force[0]) <= 1e-6 * weight
    assert disc.contact.points()["gap"].min() > -1e-3 * 0.1


def test_a_hook_snaps_past_a_latch():
    hook = snap_fit()
    pushes = []

    def apply(t):
        hook.moves["root"].value[0] = 12e-3 * t

    path = LoadSteps(hook.solver, apply, 24)
    with warnings.catch_warnings():
        refuse_warnings()
        for _ in path:
            pushes.append(-float(hook.contact.resultant().force[0]))
    # Where equilibria end there are other ways than ever smaller steps
    assert path.halvings <= 4
    # The push rises, turns into a pull behind the nose's top, and ends
    assert max(pushes) > 0.5 and min(pushes) < -0.5 and pushes[-1] == 0.0
    # The hook is straight again
    u = hook.u.x.array.reshape(-1, 2)
    moved = u[u[:, 0] > 6e-3]
    assert np.abs(moved - [12e-3, 0.0]).max() <= 1e-9 * 12e-3
