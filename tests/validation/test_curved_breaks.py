"""Chords in place of bent edges of the master: what they change converges faster than
the solution."""

import gathered
import numpy as np
import pytest
from manufactured import Manufactured
from manufactured_fields import CUBE

from raymortar import Search

BEND = 0.1
# Stands for exact integration: chords of half edges, and points on both sides of kinks
EXACT = {"quadrature_degree": 16, "search": Search(subdivide=True)}


def solve(cell, n, **options):
    problem = Manufactured(CUBE, cell, n, 2, bend=BEND, **options)
    problem.solve()
    return problem


def apart(cell, n):
    """Differences of displacement and multiplier from exact integration, and errors,
    all relative."""
    found, exact = solve(cell, n), solve(cell, n, **EXACT)
    p, q = found.contact.points(), exact.contact.points()
    assert len(q["gap"]) > 4 * len(p["gap"])
    differences = [
        np.linalg.norm(a.x.array - b.x.array) / np.linalg.norm(b.x.array)
        for a, b in (
            (found.u, exact.u),
            (found.contact.multiplier, exact.contact.multiplier),
        )
    ]
    errors = exact.errors()
    return np.array(differences), np.array([errors["u_upper"], errors["multiplier"]])


def test_what_chords_change_falls_faster_than_the_error(record_property):
    sizes = np.array([2, 6])
    differences, errors = zip(*(apart("hexahedron", n) for n in sizes))
    orders = [
        np.log(found[0] / found[1]) / np.log(sizes[1] / sizes[0])
        for found in (differences, errors)
    ]
    record_property("orders", [order.tolist() for order in orders])
    assert np.all(differences[0] < 1e-3 * errors[0])
    assert np.all(orders[0] >= orders[1] + 1.0)


@pytest.mark.mpi
def test_points_lie_beyond_chords_of_bent_edges_only(record_property):
    """What is measured above is there, and straight edges are cut along exactly."""
    straight, bent = (
        Manufactured(CUBE, "hexahedron", 2, 2, bend=bend, quadrature_degree=12)
        for bend in (0.0, BEND)
    )
    for problem in (straight, bent):
        problem.solve()
    own = [
        np.mean(p["master"][p["seed"] >= 0] == p["seed"][p["seed"] >= 0])
        for p in (gathered.points(straight.contact), gathered.points(bent.contact))
    ]
    record_property("own", own)
    assert own[0] == 1.0 > own[1]
