"""A slave that hangs over the rim of its master: the force, and what tells nodes there.

Wide soft blocks are slaves on narrow stiff ones. With the roles swapped every slave
facet is covered, and gamma has no part in the force.
"""

import numpy as np
import pytest
import states
import ufl
from condensing import DUAL, newton
from dolfinx import fem
from problems import (
    CELLS,
    COMM,
    DIMENSION,
    SOLVERS,
    Problem,
    build,
    fix,
    residual,
    symmetry,
    worst,
)
from states import Case, name_of
from tangents import remainders_of, slopes
from uncovered import boundary_of, load_of_the_rest

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    CondensedProblem,
    Contact,
    NonlinearProblem,
    Penalty,
)
from raymortar.core import compat

FACTORS = (0.1, 1.0, 10.0)  # times E / h
STIFF = 1000.0


def force(
    cell, degree, below, above, gamma, swap=False, width=1.8, share=0.03, **options
):
    """Force on a master that is pressed by a share of its height, 1, and iterations."""
    dim = DIMENSION[cell]
    scene = two_blocks(
        COMM,
        dim,
        cell,
        below,
        above,
        upper_size=(width,) * (dim - 1) + (1.0,),
        **options,
    )
    down = np.eye(dim)[-1] * -share
    problem = build(
        scene,
        degree,
        method=AugmentedLagrangian(gamma),
        E={"lower": STIFF, "upper": 1.0},
        swap=swap,
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", None, fem.Constant(scene.mesh, down)),
        ],
    )
    iterations = problem.solve()
    return abs(problem.contact.resultant().force[-1]), iterations


def check(reference, mine, swapped):
    """Forces do not depend on gamma, and are as near as with the roles swapped.

    What they vary by then too is of points that open: gamma times the gap between nodes
    outweighs the traction.
    """
    assert np.ptp(mine) <= 1e-3 * mean(mine) + 1.5 * np.ptp(swapped)
    assert abs(mean(mine) - reference) <= 1.5 * abs(mean(swapped) - reference)


def mean(forces):
    return float(np.mean(forces))


@pytest.fixture(scope="module")
def plane():
    """Forces in the plane by the width and the share, of a fine mesh, swapped."""
    fine = {"degree": 2, "gamma": 20.0, "swap": True}
    return {
        width: force("triangle", below=20, above=n, width=width, share=share, **fine)[0]
        for width, share, n in ((2.0, 0.05, (40, 20)), (1.8, 0.03, (36, 20)))
    }


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("n", [4, 8])
def test_force_with_the_rim_at_nodes(n, plane):
    """P1 of the validation: the rim is at a node and moves to either side of it."""

    def pressed(factor, swap=False):
        sizes = {"below": n, "above": (2 * n, n), "width": 2.0, "share": 0.05}
        return force("triangle", 1, gamma=factor * n, swap=swap, **sizes)

    forces, iterations = zip(*(pressed(factor) for factor in FACTORS))
    check(plane[2.0], forces, [pressed(factor, True)[0] for factor in FACTORS])
    assert max(iterations) <= 4


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_force_with_the_rim_inside_facets(degree, plane):
    h = 0.125
    mesh = {"pattern": "random", "perturb": 0.2, "perturb_sides": 0.2}

    def pressed(factor, swap=False):
        sizes = {"below": 8, "above": (20, 11), **mesh}
        return force("triangle", degree, gamma=factor / h, swap=swap, **sizes)

    forces, iterations = zip(*(pressed(factor) for factor in FACTORS))
    check(plane[1.8], forces, [pressed(factor, True)[0] for factor in FACTORS])
    assert max(iterations) <= 5


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_force_in_space(cell):
    def pressed(factor, swap=False, n=3, m=6):
        sizes = {"below": n, "above": (m, m, n)}
        return force(cell, 1, gamma=factor * n, swap=swap, **sizes)

    forces, iterations = zip(*(pressed(factor) for factor in FACTORS))
    swapped = [pressed(factor, True)[0] for factor in FACTORS]
    fine = pressed(1.0, True, 5, 9)[0]
    assert np.ptp(forces) <= 1e-3 * mean(forces) + 1.5 * np.ptp(swapped)
    # Forces come down with the size of cells: the fine one is above the solution's
    assert abs(mean(forces) - fine) <= 1.5 * abs(mean(swapped) - fine)
    assert max(iterations) <= 6


def patch(
    cell,
    degree,
    parts,
    pressure,
    method=AugmentedLagrangian(1.0),
    make=NonlinearProblem,
):
    """A wide block on a narrow one, both under a pressure from above and below."""
    dim = DIMENSION[cell]
    width, below = (1.8, 3) if dim == 2 else (1.5, 2)
    scene = two_blocks(
        COMM,
        dim,
        cell,
        below,
        (parts,) * (dim - 1) + (2,),
        upper_size=(width,) * (dim - 1) + (1.0,),
        overhang=(0.5 * (width - 1.0),) * (dim - 1),
    )
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    F, moduli, load = residual(scene, u, E=1.0, loaded=["top"])
    load.value[-1, -1] = -pressure
    ds = boundary_of(F)
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = Contact(u, scene.facet_tags, [pair], method)
    f = load_of_the_rest(contact, ds)
    (v,) = F.arguments()
    F -= pressure * ufl.inner(f, v) * ds
    bcs = [*symmetry(V, scene), fix(V, scene, "bottom", dim - 1)]
    problem = make(F, contact, bcs)
    return Problem(scene, u, contact, problem, "linear", moduli, load)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("rim", ["nodes", "inside"])
@pytest.mark.parametrize("cell", CELLS)
def test_patch_with_an_overhang(cell, rim, degree):
    """P2 of the validation: the uncovered face carries the pressure as a dead load."""
    parts = {"nodes": (9, 3), "inside": (7, 4)}[rim][DIMENSION[cell] - 2]
    pressure = 0.01
    problem = patch(cell, degree, parts, pressure)
    problem.solve()
    assert worst(problem.stress() - problem.load.value) <= 1e-10 * pressure
    zone = problem.contact.zones[0]
    share = zone.cpp.segments()["covered"]
    assert np.any((share > 0.1) & (share < 0.9)) == (rim == "inside")
    covered = zone.cpp.covered_nodes() != 0
    lam = problem.contact.multiplier.x.array[zone.multiplier_nodes]
    assert worst(lam[covered] + pressure) <= 1e-9 * pressure
    assert not covered.all() and not lam[~covered].any()


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_condensed_patch_with_an_overhang(cell, degree):
    """The same with dual functions of the covered parts, in the user's unknowns."""
    pressure, parts = 0.01, (7, 4)[DIMENSION[cell] - 2]

    def make(F, contact, bcs):
        return CondensedProblem(F, contact.u, contact, bcs)

    found = patch(cell, degree, parts, pressure, DUAL, make)
    norms = newton(found.problem)
    assert len(norms) <= 9
    assert worst(found.stress() - found.load.value) <= 1e-10 * pressure
    zone = found.contact.zones[0]
    covered = zone.cpp.nodes()["status"] != states.NONE
    lam = found.slave_multiplier()
    up = np.eye(found.dim)[-1]
    assert worst(lam[covered] - pressure * up) <= 1e-10 * pressure
    assert not covered.all() and not lam[~covered].any()


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_nothing_is_left_where_a_held_tool_lifts_off(solver):
    """No free row would tell of a traction that is left."""
    scene = two_blocks(COMM, 2, "triangle", 3, 4, upper_size=(1.8, 1.0))
    top = fem.Constant(scene.mesh, np.zeros(2))
    upper = [name for name in scene.tags if "upper" in name]

    def bcs(V, scene):
        held = [fix(V, scene, "bottom")]
        return [*held, fix(V, scene, ["top", "slave", *upper], None, top)]

    problem = build(scene, 1, E=1.0, bcs=bcs)
    for height in (-0.01, 0.5):
        top.value[-1] = height
        problem.solve(solver)
    assert worst(problem.slave_multiplier()) <= 1e-30


def tangent_cases():
    for cell in states.CELLS:
        for degrees, method, measure in (
            ((1, 1), "vector", "reference"),
            ((2, 2), "normal", "current"),
        ):
            for regime in ("open", "mixed"):
                case = Case(cell, *degrees, method, measure)
                yield pytest.param(case, regime, id=f"{name_of(case)}-{regime}")


@pytest.mark.parametrize("case, regime", list(tangent_cases()))
def test_full_tangent_with_the_rim_inside_facets(case, regime):
    """Open points leave the multiplier to what stands for the uncovered part."""
    scene = case.scene("overhang")
    for seed in range(40):
        contact = states.make_contact(scene, case, quadrature_degree=2, tangent="full")
        states.set_state(contact, scene, regime, seed)
        share = contact.zones[0].cpp.segments()["covered"]
        if not states.in_regime(contact, regime) or not np.any(share * (1 - share)):
            continue
        K = states.tangent(contact, states.mass_form(contact.u.function_space))
        found = remainders_of(contact, K, seed)
        if found is not None:
            assert np.abs(slopes(*found) - 2.0).max() <= 0.05
            return
    raise AssertionError("no random state without a kink nearby")


@pytest.mark.mpi
def test_penalty_knows_nothing_of_it():
    """It has no multiplier: what is uncovered has no point."""
    scene = two_blocks(COMM, 2, "triangle", 3, 4, upper_size=(1.8, 1.0))
    problem = build(scene, 1, method=Penalty(1.0))
    problem.contact.update()
    assert np.all(problem.contact.points()["seed"] >= 0)
