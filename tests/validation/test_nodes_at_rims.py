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
from condensing import newton
from dolfinx import fem
from friction_states import AT_NODES, FrictionCase
from problems import COMM, DIMENSION, build, fix

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, CondensedProblem, Coulomb, Tresca

PENETRATION = 0.05  # more than tractions open
STEPS = (0.25, 0.5, 0.75, 1.0)


def at_the_rim(cell):
    """Blocks with a row of the slave's nodes above the rim of the master."""
    dim = DIMENSION[cell]
    across = (dim - 1,)
    return two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=(2,) * across[0] + (1,),
        upper_divisions=(2,) * across[0] + (1,),
        lower_size=(2.0,) * across[0] + (0.7,),
        upper_size=(1.2,) * across[0] + (0.4,),
        overhang=(1.0, 0.5)[: dim - 1],
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



def over_the_edge(law, divisions=(14, 10), **method):
    """A soft block, 0.3 of it beside a stiff one, that is pressed and dragged."""
    scene = two_blocks(COMM, 2, "quadrilateral", *divisions, overhang=0.3)
    load = fem.Constant(scene.mesh, np.zeros(2))
    problem = build(
        scene,
        1,
        "neo-hookean",
        AugmentedLagrangian(**method),
        E={"lower": 1000.0, "upper": 1.0},
        friction=law,
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", None, load),
        ],
    )
    iterations = []
    for t in STEPS:
        load.value[:] = 0.1 * t, -0.1 * t
        iterations.append(problem.solve())
        problem.contact.advance()
    return problem.contact.resultant().force, iterations


@pytest.mark.parametrize(
    "multiplier, law",
    [("vector", Coulomb(0.3)), ("dual", Coulomb(0.3)), ("dual", Tresca(0.02))],
    ids=["vector-coulomb", "dual-coulomb", "dual-tresca"],
)
def test_a_soft_slave_over_the_edge_of_a_stiff_master(multiplier, law):
    """The multiplier behind the edge is on its cone, not its neighbour's."""
    force, iterations = over_the_edge(law, condition="nodes", multiplier=multiplier)
    assert max(iterations) <= 7
    reference, _ = over_the_edge(law)
    size = np.linalg.norm(reference)
    np.testing.assert_allclose(force, reference, atol=0.01 * size)
