"""A squeezed rubber cord has Lindley's force, and needs its pressure as an unknown."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from o_ring import DIAMETER, MODULUS, Ring
from problems import SOLVERS

SQUEEZES = (0.1, 0.2, 0.3)


def lindley(share):
    """Force over plane-strain modulus and diameter."""
    return 1.25 * share**1.5 + 50.0 * share**6


@lru_cache(maxsize=None)
def path():
    """Force, width and peak of the contact at the squeezes, and the path's steps."""
    ring, found, steps = Ring(), {}, []
    for step in ring.squeeze(SQUEEZES[-1], 6):
        steps.append(step)
        for share in SQUEEZES:
            if step.factor == pytest.approx(share):
                found[share] = ring.force(), ring.width(), ring.peak()
    return found, steps


@lru_cache(maxsize=None)
def squeezed(mixed, nu):
    """A cord squeezed by 10 %, and the path's steps."""
    kappa = 2.0 * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu))
    ring = Ring(kappa, mixed)
    return ring, ring.squeeze(0.1, 4, strategy="halve", max_halvings=8).run()


@pytest.mark.mpi
@pytest.mark.parametrize("share", SQUEEZES)
def test_force_width_and_peak_are_lindleys(share):
    """Semi-empirical: 10 %. Width and peak are Hertz's for the force."""
    f = lindley(share)
    force, width, peak = path()[0][share]
    assert force == pytest.approx(f, rel=0.1)
    assert width == pytest.approx(DIAMETER * np.sqrt(8.0 * f / np.pi), rel=0.1)
    assert peak == pytest.approx(MODULUS * np.sqrt(2.0 * f / np.pi), rel=0.1)


@pytest.mark.mpi
def test_the_force_is_that_of_a_cylinder_between_plates():
    """Johnson (1985), (5.57), for small squeezes: an independent closed form."""
    ring = Ring(facets_across=16)
    ring.squeeze(0.02, 2).run()
    f = ring.force()
    half_width = DIAMETER * np.sqrt(2.0 * f / np.pi)
    squeeze = 2.0 * f / np.pi * (2.0 * np.log(2.0 * DIAMETER / half_width) - 1.0)
    assert squeeze == pytest.approx(0.02, rel=0.03)


@pytest.mark.mpi
def test_steps_are_easy():
    _, steps = path()
    assert len(steps) == 6 and steps[-1].halvings == 0
    assert max(step.iterations for step in steps) <= 8


def test_the_displacement_alone_locks():
    """It takes many halvings, and its pressure jumps from cell to cell."""
    (good, easy), (bad, hard) = squeezed(True, 0.4999), squeezed(False, 0.4999)
    assert easy[-1].halvings == 0 and hard[-1].halvings >= 3
    assert bad.roughness() > 2.0 * good.roughness()


def test_the_pressure_has_no_checkerboard():
    """Its jumps are those of a compressible cord's, where nothing locks."""
    good, _ = squeezed(True, 0.4999)
    compressible, _ = squeezed(False, 0.49)
    assert good.roughness() < 1.2 * compressible.roughness()
    assert good.force() == pytest.approx(compressible.force(), rel=0.05)


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_both_solvers_squeeze_it(solver):
    ring = Ring(facets_across=8)
    ring.squeeze(0.1, 2, solver).run()
    assert ring.force() == pytest.approx(lindley(0.1), rel=0.1)
