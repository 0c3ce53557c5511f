"""Scenes at the edge of what numbers hold: what converges there is the answer."""

import numpy as np
import pytest
from dolfinx import fem
from materials import MATERIALS, lame
from problems import CELLS, COMM, DIMENSION, SOLVERS, build, fix, worst
from squeezing import squeeze

import raymortar
from meshes.scenes import two_blocks

SHARE = 0.05


def pushed(V, scene, share=SHARE):
    """Bottom held, top pushed down by a share of the height of a block, 1."""
    down = fix(V, scene, "top", value=lambda x: np.outer(np.ones(len(x)), [0, -share]))
    return [fix(V, scene, "bottom"), down]


def between_walls(V, scene):
    sides = [f"{body}_{side}" for body in scene.bodies for side in ("left", "right")]
    return [*pushed(V, scene), fix(V, scene, sides, 0)]


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("soft", ["lower", "upper"])
def test_forces_below_the_rounding_error_of_a_stiff_body_are_found(soft, solver):
    """Uniaxial strain in cells a thousand times as high as wide, 1e6 times softer.

    The stiff body takes 1e-6 of the shortening, the soft one gives the pressure.
    """
    size = (1e-3, 1.0)
    scene = two_blocks(
        COMM, 2, "triangle", (7, 5), (5, 5), lower_size=size, upper_size=size
    )
    moduli = dict.fromkeys(scene.bodies, 2e9) | {soft: 2e3}
    problem = build(scene, 1, "neo-hookean", E=moduli, bcs=between_walls)
    problem.solve(solver)
    H = np.diag([0.0, -SHARE])
    pressure = MATERIALS["neo-hookean"][1](H, *lame(2e3, 0.3))[1, 1]
    # What the test is about: an error of a twentieth is taken for rounding
    assert SHARE * abs(pressure) * size[0] < problem.problem.residual_floor()
    assert worst(problem.slave_multiplier() / pressure - 1.0) < 3e-6


def flanked(share, width=0.6, rows=5):
    """A punch pressed by a share of its height, its flanks slave surfaces as well."""
    scene = two_blocks(COMM, 2, "triangle", (7, 5), (5, rows), upper_size=(width, 1.0))
    names = ["slave", "upper_left", "upper_right"]
    return build(
        scene,
        1,
        "neo-hookean",
        pairs=[(name, "master") for name in names],
        bcs=lambda V, scene: pushed(V, scene, share),
    )


@pytest.mark.mpi(where=lambda share: share == 0.05)
@pytest.mark.filterwarnings("error::raymortar.ContactWarning")
@pytest.mark.parametrize("share", [0.01, 0.05, 0.1])
def test_flanks_beside_a_sharp_corner_do_not_hit_the_master_below(share):
    """Rays of the flanks run backwards over the master that pokes over the corner."""
    problem = flanked(share)
    assert problem.solve() <= 8
    for zone in problem.contact.zones:
        points = zone.points()
        closed = points["pressure"] > 0.0
        # Of the slave's facets, 0.12 long
        assert worst(points["gap"][closed]) < 0.1 * 0.12


@pytest.mark.mpi
def test_block_that_snaps_off_an_edge_says_that_newton_cycles():
    """Pushed over the edge with friction 1 it sticks by a corner, then hangs by it.

    There the path of equilibria ends, and no step is small enough.
    """
    scene = two_blocks(COMM, 2, "triangle", (7, 5), (5, 5), upper_size=(0.4, 1.0))
    top = fem.Constant(scene.mesh, np.zeros(2))
    problem = build(
        scene,
        1,
        "neo-hookean",
        friction=raymortar.Coulomb(1.0),
        tangent="full",
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", None, top),
        ],
    )

    def apply(t):
        top.value[:] = max(t - 0.1, 0.0) / 0.9, -min(10.0 * t, 1.0) * SHARE

    solver = raymortar.SNESSolver(problem.problem)
    steps = raymortar.LoadSteps(solver, apply, 60, strategy="halve")
    cycle = r"load factor 0\.64.*repeats every \d residuals: points open and close, or"
    with pytest.raises(raymortar.ConvergenceError, match=cycle):
        steps.run()


# Simplices: of two other cells a rank would have none, where DOLFINx 0.5 crashes in
# V.sub(i).collapse()
@pytest.mark.mpi(where=lambda cell: cell in ("triangle", "tetrahedron"))
@pytest.mark.parametrize("cell", CELLS)
def test_surfaces_of_one_facet_meet(cell):
    """G-21: a cell on a cell (simplices: the halves of a face)."""
    problem, F, P = squeeze(two_blocks(COMM, DIMENSION[cell], cell, 1, 1))
    problem.solve()
    assert worst(problem.gradient() + np.eye(problem.dim) - F) < 1e-9
    assert worst(problem.slave_multiplier() / P[-1, -1] - 1.0) < 1e-9


@pytest.mark.mpi
def test_flanks_pressed_deep_are_told_of():
    """By 0.3 heights in one step a flank's point is a quarter of a facet deep, in
    balance."""
    problem = flanked(0.3, width=0.5, rows=6)
    with pytest.warns(
        raymortar.ContactWarning, match=r"deep in the master, 0\.2.* of its"
    ):
        problem.solve(SOLVERS[-1])


@pytest.mark.mpi
def test_a_path_tells_of_deep_flanks_once():
    """Steps that stay as they are say nothing new; a solve by itself does."""
    problem = flanked(0.3, width=0.5, rows=6)
    solver = SOLVERS[-1](problem.problem)
    solver.solve()
    with pytest.warns(raymortar.ContactWarning, match="deep in the master") as caught:
        raymortar.LoadSteps(solver, lambda t: None, 3).run()
    assert sum("deep in the master" in str(one.message) for one in caught) == 1
    with pytest.warns(raymortar.ContactWarning, match="deep in the master"):
        solver.solve()
