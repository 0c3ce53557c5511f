"""Dual functions of each type of facet against exact arithmetic [theory (4.27), (4.28)],
and what they are for: slave rows with one multiplier each, forces in balance."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from math import factorial

import gathered
import numpy as np
import pytest
import states
from condensing import DUAL
from dolfinx import fem
from problems import COMM, DIMENSION

from meshes.scenes import two_blocks
from raymortar import Contact
from raymortar.condensed.condensation import Condensation
from raymortar.core import compat

ONE, HALF = Fraction(1), Fraction(1, 2)
# Polynomials of the reference coordinates: coefficients by exponents
HATS = {
    "interval": [{(0,): ONE, (1,): -ONE}, {(1,): ONE}],
    "triangle": [
        {(0, 0): ONE, (1, 0): -ONE, (0, 1): -ONE},
        {(1, 0): ONE},
        {(0, 1): ONE},
    ],
    "quadrilateral": [
        {(0, 0): ONE, (1, 0): -ONE, (0, 1): -ONE, (1, 1): ONE},
        {(1, 0): ONE, (1, 1): -ONE},
        {(0, 1): ONE, (1, 1): -ONE},
        {(1, 1): ONE},
    ],
}
BERNSTEIN = [
    {(0,): ONE, (1,): -2 * ONE, (2,): ONE},
    {(2,): ONE},
    {(1,): 2 * ONE, (2,): -2 * ONE},
]
FACET = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}


def times(p, q):
    """Product of two polynomials."""
    found = {}
    for (i, a), (j, b) in product(p.items(), q.items()):
        key = tuple(map(sum, zip(i, j)))
        found[key] = found.get(key, 0) + a * b
    return found


def integral(p, shape, begin=0 * ONE, end=ONE):
    """Integral of a polynomial over a reference facet, or a part of an interval."""
    total = Fraction(0)
    for powers, a in p.items():
        if shape == "triangle":
            i, j = powers
            total += a * Fraction(factorial(i) * factorial(j), factorial(i + j + 2))
            continue
        value = a
        for k in powers:
            value *= (end ** (k + 1) - begin ** (k + 1)) / (k + 1)
        total += value
    return total


def solved(m, right):
    """Solution of a system in exact arithmetic."""
    n = len(m)
    rows = [[*map(Fraction, row), b] for row, b in zip(m, right)]
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for i in range(n):
            if i != k:
                rows[i] = [a - rows[i][k] * b for a, b in zip(rows[i], rows[k])]
    return [row[-1] for row in rows]


def dual_coefficients(tests, shape, begin=0 * ONE, end=ONE):
    """Coefficients of the test functions of each dual function, (n, n): by (4.28)."""
    whole = integral({(0,) * len(next(iter(tests[0]))): ONE}, shape)
    share = (end - begin) if shape == "interval" else ONE
    n = range(len(tests))
    unit = [[integral(times(a, b), shape) / whole for b in tests] for a in tests]
    L = [[(sum(unit[a]) if a == b else 0) - unit[a][b] for b in n] for a in n]
    d = [integral(a, shape, begin, end) for a in tests]
    slack = (1 - share) ** 2 * share * whole
    m = [
        [
            integral(times(tests[a], tests[b]), shape, begin, end) + slack * L[a][b]
            for b in n
        ]
        for a in n
    ]
    return [solved(m, [d[a] if a == j else 0 for a in n]) for j in n], d


def values(p, xi):
    """Values of a polynomial at points (n, d - 1)."""
    terms = [float(a) * np.prod(xi ** np.array(k), axis=1) for k, a in p.items()]
    return np.sum(terms, axis=0)


def touching(cell, degree, lower=None, divisions=2, mesh_degree=1):
    """Flat blocks that overlap a little, with random multipliers."""
    dim = DIMENSION[cell]
    scene = two_blocks(
        COMM,
        dim,
        cell,
        3,
        divisions,
        lower_size=1.5 if lower is None else (lower, *(1.5,) * (dim - 2), 1.0),
        upper_size=1.0,
        geometry_degree=mesh_degree,
    )
    u = fem.Function(compat.vector_space(scene.mesh, degree))
    upper = states.upper_dofs(scene, u.function_space)
    u.x.array.reshape(-1, dim)[upper, -1] = -0.01
    tags = (scene.tags["slave"], scene.tags["master"])
    contact = Contact(u, scene.facet_tags, [tags], DUAL)
    contact.set_gamma(1.0)
    states.set_multiplier(contact, np.random.default_rng(1))
    contact.update()
    return contact


def nodal(contact):
    """Nodal tractions of each slave facet, (facets, nodes, components)."""
    lam = contact.multiplier.x.array.reshape(-1, contact.layout.components)
    return lam[contact.zones[0].multiplier_table]


@pytest.mark.parametrize(
    "cell, degree",
    [(cell, 1) for cell in states.CELLS] + [("triangle", 2), ("quadrilateral", 2)],
)
def test_functions_of_covered_facets(cell, degree):
    shape = FACET[cell]
    tests = BERNSTEIN if degree == 2 else HATS[shape]
    coefficients, _ = dual_coefficients(tests, shape)
    contact = touching(cell, degree)
    points, lam = contact.zones[0].points(), nodal(contact)
    B = np.stack([values(p, points["xi"]) for p in tests], axis=1)
    phi = B @ np.array(coefficients, dtype=float).T
    expected = np.einsum("qj,qji->qi", phi, lam[points["slave"]])
    np.testing.assert_allclose(points["traction"], expected, atol=1e-11)
    # Biorthogonal: the sum over a facet's points is diagonal
    for f in range(len(lam)):
        on = points["slave"] == f
        D = np.einsum("q,qa,qj->aj", points["weight"][on], B[on], phi[on])
        np.testing.assert_allclose(D, np.diag(np.diag(D)), atol=1e-14)


@pytest.mark.parametrize("degree", [1, 2])
def test_functions_of_a_facet_that_is_half_covered(degree):
    tests = BERNSTEIN if degree == 2 else HATS["interval"]
    contact = touching("triangle", degree, lower=0.75)
    points, lam = contact.zones[0].points(), nodal(contact)
    hit = points["master"] >= 0
    assert len(lam) == 2
    for f in range(2):
        on = hit & (points["slave"] == f)
        xi = points["xi"][on]
        begin = Fraction(0) if xi.min() < 0.2 else Fraction(1, 4)
        end = begin + Fraction(3, 4)
        coefficients, _ = dual_coefficients(tests, "interval", begin, end)
        B = np.stack([values(p, xi) for p in tests], axis=1)
        phi = B @ np.array(coefficients, dtype=float).T
        np.testing.assert_allclose(points["traction"][on], phi @ lam[f], atol=1e-11)
        # Constants are among them, and no function is large
        np.testing.assert_allclose(phi.sum(axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    "cell, degree",
    [
        ("triangle", 1),
        ("quadrilateral", 2),
        *product(("tetrahedron", "hexahedron"), (1, 2)),
    ],
)
def test_slave_rows_have_one_multiplier_and_forces_balance(cell, degree):
    """On facets that hang over the rim, curved and deformed, too."""
    case = states.Case(cell, degree, degree, "dual", "current")
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case, condition="nodes", tangent="full")
    states.set_state(contact, scene, "active", 3)
    K = states.tangent(contact, states.mass_form(contact.u.function_space))
    n = gathered.size_u(contact)
    rows = Condensation(contact).tests.convert("dense").getDenseArray()
    D = rows @ K[:n, n:]
    np.testing.assert_allclose(D, np.diag(np.diag(D)), atol=1e-13 * np.abs(D).max())
    R = states.assembled(contact)[:n].reshape(-1, case.dim)
    np.testing.assert_allclose(
        R.sum(axis=0), 0.0, atol=1e-13 * np.abs(R).max() * len(R)
    )
