"""Patch tests on every combination of facets, at the default degree of integration.

The functions of slave and master are of different degrees on a segment, and the rule has
to be exact for both.
"""

from __future__ import annotations

from itertools import product

import hosts
import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import prescribe
from hosts import LOWER, UPPER
from problems import DIMENSION, SOLVERS, worst

from raymortar import AugmentedLagrangian, Penalty, Tie
from raymortar.core import compat
from raymortar.fluxes import FieldProblem, FieldTie, Flux

GAMMA = 1e3
WAYS = {
    "points": {"method": AugmentedLagrangian(GAMMA)},
    "penalty": {"method": Penalty(GAMMA)},
    "nodes": {"method": AugmentedLagrangian(GAMMA, condition="nodes")},
    "dual": {
        "method": AugmentedLagrangian(GAMMA, condition="nodes", multiplier="dual")
    },
    "tie": {"kind": Tie, "method": AugmentedLagrangian(GAMMA)},
}
CELLS = [
    ("triangle", "quadrilateral"),
    *product(("tetrahedron", "hexahedron"), repeat=2),
]
# Cells and degrees of the lower body, whose surface is the master, and of the upper
# one. Those for every push have masters with four times the degree of a multiplier
SIDES = [
    pytest.param(
        cells,
        degrees,
        marks=[pytest.mark.quick]
        if cells == ("hexahedron", "tetrahedron") and degrees[0] == 2
        else [],
        id="-".join(f"{cell}{degree}" for cell, degree in zip(cells, degrees)),
    )
    for cells, *degrees in product(CELLS, (1, 2), (1, 2))
]
TOLERANCE = 1e-10


def sides(cells):
    """Blocks on each other, of equal width and without common nodes."""
    divisions = (2, 3) if DIMENSION[cells[0]] == 3 else (4, 5)
    return hosts.meshes(cells, divisions, widths=(1.0, 1.0))


def is_linear(f):
    """Whether a function is linear on its mesh, to rounding of its largest value."""
    V = f.function_space
    X = V.tabulate_dof_coordinates()
    values = f.x.array.reshape(len(X), -1)
    X = np.hstack([np.ones((len(X), 1)), X])
    fitted = X @ np.linalg.lstsq(X, values, rcond=None)[0]
    return worst(values - fitted) <= TOLERANCE * worst(values)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("cells, degrees", SIDES)
def test_a_uniform_squeeze_is_exact(cells, degrees, way):
    found = hosts.apart(sides(cells), degree=degrees, rollers=True, **WAYS[way])
    found.move[-1].value = -0.2
    _, converged = SOLVERS[-1](found.problem).solve()
    assert converged
    assert all(is_linear(u) for u in found.functions)
    points = found.contact.points()
    assert (points["status"] > 1).all()
    p = points["pressure"]
    force = found.contact.resultant().force[-1]
    assert force > 0.0
    assert worst(p * points["area"].sum() / force - 1.0) <= TOLERANCE


def check_field(cells, degrees, way, displacement):
    """A field is linear in each body, without a jump between them or with a uniform one."""
    scenes = sides(cells)
    T = [fem.Function(compat.scalar_space(s.mesh, k)) for s, k in zip(scenes, degrees)]
    F = [
        ufl.inner(ufl.grad(f), ufl.grad(ufl.TestFunction(f.function_space))) * ufl.dx
        for f in T
    ]
    bcs = [
        prescribe(f.function_space, s, name, value)
        for f, s, name, value in zip(T, scenes, ("bottom", "top"), (0.0, 1.0))
    ]
    if way == "field tie":
        tie = FieldTie(T, [s.facet_tags for s in scenes], [(UPPER + 1, LOWER + 2)])
        FieldProblem(F, T, tie, bcs).solve()
        rate = tie.rate()
    else:  # a third of the drop is the jump's
        fluxes = []

        def beside(contact):
            fluxes.append(Flux(contact, T, lambda T_s, T_m, p, g, v: T_s - T_m))
            return F, fluxes, bcs, T

        found = hosts.apart(scenes, degree=displacement, rollers=True, beside=beside)
        found.move[-1].value = -0.01
        found.problem.solve()
        rate = 1.5 * fluxes[0].rates().through
    assert abs(rate - 0.5) <= TOLERANCE
    assert all(is_linear(f) for f in T)


@pytest.mark.parametrize("way", ("field tie", "flux"))
@pytest.mark.parametrize("cells, degrees", SIDES)
def test_a_linear_field_is_exact(cells, degrees, way):
    check_field(cells, degrees, way, degrees)


@pytest.mark.parametrize("cells", CELLS)
def test_a_flux_of_a_field_of_higher_degree_than_the_displacement(cells):
    check_field(cells, (2, 2), "flux", (1, 1))
