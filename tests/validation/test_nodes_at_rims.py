"""The law at nodes where a rim of the master passes a node of its slave: what holds
within the rim does not jump, and a soft slave over the edge of a stiff master arrives.

Beyond the edge the slave's facet turns by more than the cone of friction, so that the
node behind it cannot take on the traction of its neighbour.
"""

from __future__ import annotations

import gathered
import numpy as np
import pytest
import states
from condensing import DUAL, iterates, newton, pressed
from friction_states import AT_NODES, FrictionCase, frictional_pairs, set_both
from problems import COMM, DIMENSION
from tangents import is_first_order, is_second_order, quiet_slopes
from test_nodal_tangent import FIRST_STEPS

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, CondensedProblem, Coulomb, SNESSolver, Tresca

PENETRATION = 0.05  # more than tractions open
POINTS, VECTOR = AugmentedLagrangian(), AugmentedLagrangian(condition="nodes")


def at_the_rim(cell):
    """Blocks with a row of the slave's nodes above the rim of the master."""
    dim = DIMENSION[cell]
    across = dim - 1
    return two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=(2,) * across + (1,),
        upper_divisions=(2,) * across + (1,),
        lower_size=(2.0,) * across + (0.7,),
        upper_size=(1.2,) * across + (0.4,),
        overhang=(1.0, 0.5)[:across],
    )


def rows(contact, scene, aside):
    """Residual with the slave shifted, and which of its rows are of nodes that nothing
    covers."""
    V = contact.u.function_space
    u = np.zeros((len(states.dof_positions(V)), V.mesh.geometry.dim))
    u[states.upper_dofs(scene, V), 0] = aside
    u[states.upper_dofs(scene, V), -1] = -PENETRATION
    contact.u.x.array[:] = u.ravel()
    contact.update()
    residual, zone = states.assembled(contact), contact.zones[0]
    marks, lam = np.zeros((2, contact.multiplier.x.array.size))
    lam[:] = contact.multiplier.x.array
    bare = zone.cpp.nodes()["status"] == states.NONE
    marks.reshape(-1, u.shape[1])[zone.multiplier_nodes[bare]] = 1.0
    contact.multiplier.x.array[:] = marks
    outer = states.unknowns(contact)
    contact.multiplier.x.array[:] = lam
    outer[: gathered.size_u(contact)] = 0.0
    return residual, outer != 0.0


@pytest.mark.mpi(where=lambda cell, **_: cell in ("triangle", "hexahedron"))
@pytest.mark.parametrize("cell", states.CELLS)
@pytest.mark.parametrize("multiplier", AT_NODES)
def test_what_holds_within_the_rim_does_not_jump(cell, multiplier):
    """A thousandth of a facet is covered, a tenth of that, or nothing of it."""
    scene = at_the_rim(cell)
    case = FrictionCase(cell, 1, 1, multiplier, "reference")
    contact = case.contact(scene, Coulomb(0.3))
    contact.update()
    states.set_multiplier(contact, np.random.default_rng(1))
    (outside, outer), *inside = (
        rows(contact, scene, aside) for aside in (6e-6, -6e-4, -6e-5)
    )
    assert np.count_nonzero(outer) == {2: 2, 3: 9}[DIMENSION[cell]]
    far, near = (np.abs(found - outside)[~outer].max() for found, _ in inside)
    assert 0.0 < near <= 0.2 * far


@pytest.mark.parametrize(
    "cell, multiplier", list(zip(states.CELLS, ("nodes", "dual") * 2))
)
def test_full_tangent_where_the_rim_has_just_entered_a_facet(cell, multiplier):
    """The tie begins there within the rim."""
    scene = at_the_rim(cell)
    case = FrictionCase(cell, 1, 1, multiplier, "reference", "coulomb", "slip")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        share = gathered.dictionary(contact.zones[0].cpp.segments())["covered"]
        return bool(np.any((share > 0.02) & (share < 0.2)))

    full, fixed = quiet_slopes(
        frictional_pairs(case, scene), prepare, first_steps=FIRST_STEPS
    )
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


def soft_on_stiff(cell, divisions=(14, 10), stiff=1000.0, **options):
    """A soft block, 0.3 of it beside a stiff one."""
    flat = {2: 1.0, 3: (1.0, 0.3, 0.5)}[DIMENSION[cell]]
    few = {2: divisions, 3: ((14, 1, 2), (10, 1, 2))}[DIMENSION[cell]]
    sizes = {"lower": flat, "upper": flat, "divisions": few, "overhang": 0.3}
    return pressed(cell, stiff=stiff, **sizes, **options)


def over_the_edge(cell, steps=4, solver=SNESSolver, **options):
    """The soft block, pressed and dragged: force, and iterations of the steps."""
    blocks = soft_on_stiff(cell, **options)
    if solver is CondensedProblem:
        problem = blocks.condensed()

        def solve():
            return len(newton(problem, rtol=1e-8)) - 1

    else:
        coupled = solver(blocks.coupled())

        def solve():
            return coupled.solve()[0]

    iterations = []
    for k in range(steps):
        blocks.load.value[0], blocks.load.value[-1] = np.array([1, -1]) * (k + 1) / 40
        iterations.append(solve())
        blocks.contact.advance()
    return blocks.contact.resultant().force, iterations


@pytest.mark.parametrize(
    "method, law, solver",
    [
        (VECTOR, Coulomb(0.3), SNESSolver),
        (DUAL, Coulomb(0.3), SNESSolver),
        (DUAL, Tresca(0.02), SNESSolver),
        (DUAL, Coulomb(0.3), CondensedProblem),
    ],
    ids=["vector-coulomb", "dual-coulomb", "dual-tresca", "condensed-coulomb"],
)
def test_a_soft_slave_over_the_edge_of_a_stiff_master(method, law, solver):
    """The multiplier behind the edge is on its cone, not its neighbour's."""
    options = {"law": law, "solver": solver, "method": method}
    force, iterations = over_the_edge("quadrilateral", **options)
    assert max(iterations) <= 7
    reference, _ = over_the_edge("quadrilateral", law=law, method=POINTS)
    size = np.linalg.norm(reference)
    np.testing.assert_allclose(force, reference, atol=0.01 * size)


def test_a_soft_slave_over_the_edge_in_space():
    """Few facets, the first of which lift off beside the edge."""
    options = {"law": Coulomb(0.3), "steps": 2}
    force, iterations = over_the_edge("tetrahedron", **options)
    assert max(iterations) <= 10
    reference, _ = over_the_edge("tetrahedron", method=POINTS, **options)
    size = np.linalg.norm(reference)
    np.testing.assert_allclose(force, reference, atol=0.05 * size)


@pytest.mark.parametrize("divisions", [(7, 5), (14, 10)])
def test_condensed_under_tresca(divisions):
    """The node behind the edge has hardly any area, over which its forces are its
    multiplier: its row is a force too, and no quotient of small numbers."""
    options = {"method": DUAL, "law": Tresca(0.02), "divisions": divisions}
    force, iterations = over_the_edge(
        "quadrilateral", solver=CondensedProblem, **options
    )
    assert max(iterations) <= 8
    coupled, _ = over_the_edge("quadrilateral", **options)
    np.testing.assert_allclose(force, coupled, atol=0.002 * np.linalg.norm(coupled))


@pytest.mark.parametrize("law", [Tresca(0.02), Coulomb(0.3)])
def test_condensed_step_where_the_rim_has_just_entered_a_facet(law):
    """It is the step of the coupled system, whose tangent there is the derivative: out of
    balance, with a node that has hardly any area."""
    blocks, other = (
        soft_on_stiff("quadrilateral", stiff=10.0, law=law) for _ in range(2)
    )
    problem, coupled = blocks.condensed(), other.coupled()
    for one in (blocks, other):
        one.load.value[:] = 0.004, -0.03
    newton(problem, rtol=1e-9)
    share = gathered.dictionary(blocks.contact.zones[0].cpp.segments())["covered"]
    assert np.any((share > 0.0) & (share < 1e-3))
    state, rng = blocks.contact.state(), np.random.default_rng(0)
    aside = 1e-5 * rng.normal(size=len(blocks.u.x.array)) * ~coupled.prescribed
    for one in (blocks, other):
        one.contact.restore(state)
        one.u.x.array[:] += aside
    found, expected = (iterates(one, count=3) for one in (problem, coupled))
    assert np.abs(expected[1] - expected[0]).max() > 1e-6
    np.testing.assert_allclose(found, expected, atol=1e-11)
