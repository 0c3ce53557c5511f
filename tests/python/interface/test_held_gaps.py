"""Dual multipliers at nodes that are held, as is what they face: their gaps are tested
with functions that are nowhere negative [theory (4.56)]."""

import gathered
import numpy as np
import pytest
from condensing import DUAL, newton
from friction_states import OPEN
from materials import MATERIALS, lame
from problems import COMM, build, fix, residual, worst
from tangents import Branch, is_second_order, remainders_in_petsc, slopes

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, CondensedProblem, Coulomb, SNESSolver, Stick

NODES = AugmentedLagrangian(condition="nodes")
WALL = ["lower_left", "upper_left"]
# Height and load of two strips, on which the forces of dual functions were 6.6 and 1.9
# times the load
LENGTH = 4.0
STRIPS = {1: (0.4, 0.3), 2: (0.1, 0.002)}


def strips(degree, method, friction=None):
    """Clamped at one end; the lower one, of finer cells, is pulled off the upper one."""
    height, load = STRIPS[degree]
    size = (LENGTH, height)
    counts = [(16, 3 - degree), (8, 3 - degree)]
    scene = two_blocks(
        COMM, 2, "quadrilateral", *counts, lower_size=size, upper_size=size
    )
    return build(
        scene,
        degree,
        bcs=lambda V, s: [fix(V, s, WALL)],
        loaded=["bottom"],
        load=load,
        method=method,
        friction=friction,
    )


def at_wall(contact, what):
    """What the node at the wall has."""
    zone = contact.zones[0]
    X = contact.multiplier.function_space.tabulate_dof_coordinates()
    here = X[zone.multiplier_nodes, 0] < 1e-9
    return gathered.concatenated(zone.cpp.nodes()[what][here])[0]


@pytest.mark.quick
@pytest.mark.mpi(where=lambda degree, friction: degree == 1 or friction is None)
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
@pytest.mark.parametrize("degree", STRIPS)
def test_no_force_acts_where_all_opens(degree, friction):
    """Neither coupled nor condensed. The gap of the held node is that of the law at
    nodes."""
    dual, known = (strips(degree, method, friction) for method in (DUAL, NODES))
    dual.solve(SNESSolver)
    known.u.x.array[:] = dual.u.x.array
    known.contact.update()
    # Each iterate leaves 1e-16 of the last one's
    assert worst(dual.slave_multiplier()) <= np.finfo(float).eps * STRIPS[degree][1]
    gaps = [at_wall(case.contact, "gap") for case in (dual, known)]
    assert gaps[0] == pytest.approx(gaps[1], rel=1e-9)
    assert gaps[0] > 1e-3 * STRIPS[degree][0]
    other = strips(degree, DUAL, friction)
    F, _, load = residual(other.scene, other.u, loaded=["bottom"])
    load.value[:] = other.load.value
    newton(CondensedProblem(F, other.u, other.contact, other.problem.bcs))
    # Rounding of forces that stretch moves what bends, by the ratio of both stiffnesses
    rounding = np.finfo(float).eps * (LENGTH / STRIPS[degree][0]) ** 4
    change = worst(other.u.x.array - dual.u.x.array)
    assert change < 10.0 * rounding * worst(dual.u.x.array)


@pytest.mark.quick
@pytest.mark.parametrize("friction", [None, Stick()])
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_uniform_pressure_passes_up_to_held_nodes(cell, friction):
    """The whole boundary moves with a uniform compression."""
    scene = two_blocks(COMM, 2, cell, (4, 2), (3, 2))
    H = np.diag([0.0, -0.02])
    sides = [name for name in scene.tags if name not in ("master", "slave")]
    for degree in (1, 2):
        case = build(
            scene,
            degree,
            bcs=lambda V, s: [fix(V, s, sides, None, lambda x: x @ H.T)],
            method=DUAL,
            friction=friction,
        )
        case.solve(rtol=1e-14)
        assert worst(case.gradient() - H) < 1e-10
        stress = MATERIALS["linear"][1](H, *lame(2000.0, 0.3))[:, 1]
        off = case.slave_multiplier() + stress
        assert worst(off) < 1e-9 * np.abs(stress).max()


@pytest.mark.parametrize("degree", [1, 2])
def test_pressed_blocks_have_the_pressure_of_the_law_at_nodes(degree):
    """The wall shortens with the blocks; the top goes down further beside it."""

    def moved(x):
        return np.column_stack([0.0 * x[:, 0], -0.01 * x[:, 1] * (1.0 + x[:, 0] / 2.0)])

    found = []
    for method in (DUAL, NODES):
        case = build(
            two_blocks(COMM, 2, "quadrilateral", (8, 4), (6, 4)),
            degree,
            bcs=lambda V, s: [fix(V, s, ["bottom", "top", *WALL], None, moved)],
            method=method,
        )
        case.solve()
        force = case.contact.resultant(0).force[1]
        found.append([at_wall(case.contact, "pressure"), force])
    assert found[0] == pytest.approx(found[1], rel=0.05)


def turned(degree, friction, width, seed=3):
    """Blocks at a wall, at a state with pressure there and gaps beside it: the upper one
    is turned about the wall. On a lower one of less width a facet is covered in part.
    """
    scene = two_blocks(
        COMM,
        2,
        "quadrilateral",
        (3, 1),
        (2 if width == 1.0 else 1, 1),
        lower_size=(width, 1.0),
        overhang=(1.0 - width) / 2.0,
    )
    case = build(
        scene,
        degree,
        bcs=lambda V, s: [fix(V, s, name) for name in ("bottom", *WALL)],
        method=DUAL,
        friction=friction,
    )
    rng, V = np.random.default_rng(seed), case.u.function_space
    x = V.tabulate_dof_coordinates()[:, :2]
    cells = scene.cell_tags.find(scene.bodies["upper"])
    upper = np.unique([V.dofmap.cell_dofs(c) for c in cells])
    u = 0.02 * x[:, :1] * np.sin(x @ rng.normal(size=(2, 2)))
    u[upper, 1] += 0.1 * x[upper, 0]
    case.u.x.array[:] = u.ravel()
    contact = case.contact
    lam = contact.multiplier.x.array.reshape(-1, contact.layout.components)
    X = contact.multiplier.function_space.tabulate_dof_coordinates()
    lam[:] = 100.0 * rng.normal(size=lam.shape)
    pressure = np.where(X[:, 0] < 1e-9, -2000.0, -1.0)
    lam[:, -1] = pressure if lam.shape[1] == 1 else -pressure
    return case


@pytest.mark.quick
@pytest.mark.parametrize("width", [1.0, 0.7])
@pytest.mark.parametrize("friction", [None, Coulomb(0.3), Stick()])
@pytest.mark.parametrize("degree", [1, 2])
def test_tangent_is_exact_at_held_nodes(degree, friction, width):
    case = turned(degree, friction, width)
    problem, contact = case.problem, case.contact
    x = problem.start()
    problem.F(x, problem.create_vector())
    assert at_wall(contact, "status") > OPEN and at_wall(contact, "gap") > 1e-3
    n, direction = contact.layout.n_u, x.copy()
    direction.array[:] = np.random.default_rng(2).normal(size=x.getSize())
    direction.array[:n][
        contact.system.constrained(problem.bcs)[:n]
    ] = 0.0  # else lifted
    direction.array[n:] *= 10.0
    branch, steps = Branch(contact), 10.0 ** -np.arange(4.0, 6.0, 0.5)
    rest = remainders_in_petsc(problem, x, direction, steps)
    assert branch.holds(contact)
    assert is_second_order(slopes(steps, rest)), rest
