"""The law at nodes: sign and cone hold at each node, whatever gamma (T1, T2)."""

from __future__ import annotations

from mpi4py import MPI

import gathered
import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, build, fix

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Friction
from raymortar.results import Status

MU = 0.3
PRESSED, SLID = 0.05, 0.02


def dragged(cell, degree, factor, law=Coulomb(MU), multiplier=None):
    """A soft block pressed on a wider stiff one and dragged, so that part of it slips."""
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, 3, 4, lower_size=1.3, upper_size=1.0)
    load = fem.Constant(scene.mesh, np.zeros(dim))
    problem = build(
        scene,
        degree,
        "neo-hookean",
        AugmentedLagrangian(factor, multiplier, condition="nodes"),
        E={"lower": 50.0, "upper": 1.0},
        friction=law,
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", None, load),
        ],
    )
    for down, aside in ((0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0)):
        load.value[-1], load.value[0] = -down * PRESSED, aside * SLID
        problem.solve(rtol=1e-13)
        problem.contact.advance()
    return problem


def nodes(contact):
    """Status, normal and tangential traction of all nodes of the first surface."""
    zone = contact.zones[0]
    found = zone.cpp.nodes()
    lam = contact.multiplier.x.array.reshape(-1, found["normal"].shape[1])
    found = gathered.dictionary(found | {"lam": lam[zone.multiplier_nodes]})
    normal = np.einsum("qi,qi->q", found["lam"], found["normal"])
    along = found["lam"] - normal[:, None] * found["normal"]
    return found["status"], normal, np.linalg.norm(along, axis=1)


@pytest.mark.mpi(where=lambda cell, **_: cell == "quadrilateral")
@pytest.mark.parametrize("cell, degree", [("triangle", 1), ("quadrilateral", 2)])
def test_sign_and_cone_hold_at_each_node(cell, degree):
    problem = dragged(cell, degree, 4.0)
    status, normal, along = nodes(problem.contact)
    size = np.abs(normal).max()
    assert {2, 3} <= set(status.tolist())
    assert normal.max() <= 1e-12 * size
    assert np.all(along <= -MU * normal + 1e-10 * size)
    slips = status == 3
    np.testing.assert_allclose(along[slips], -MU * normal[slips], atol=1e-10 * size)


@pytest.mark.mpi(where=lambda multiplier, **_: multiplier == "dual")
@pytest.mark.parametrize("multiplier", ["vector", "normal", "dual"])
def test_fields_are_the_values_of_the_nodes(multiplier):
    """Tractions at nodes, with dual functions too, that swing between the nodes."""
    law = Coulomb(MU) if multiplier != "normal" else None
    problem = dragged("quadrilateral", 2, 4.0, law, multiplier)
    contact, lam = problem.contact, problem.contact.multiplier.x.array
    size, d = np.abs(lam).max(), 2
    pressure = contact.pressure().x.array
    assert 0.5 * size < COMM.allreduce(pressure.max(), MPI.MAX)
    assert pressure.min() >= -1e-12 * size
    traction, normal, along = (
        contact.traction(part).x.array.reshape(-1, d)
        for part in ("total", "normal", "tangential")
    )
    np.testing.assert_allclose(normal + along, traction, atol=1e-14 * size)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), pressure, rtol=1e-12)
    if multiplier == "normal":
        np.testing.assert_allclose(pressure, -lam, atol=1e-14 * size)
        return
    np.testing.assert_allclose(traction.ravel(), lam, atol=1e-14 * size)
    status = contact.status().x.array
    slips, sticks = status == Status.SLIP, status == Status.STICK
    force = np.linalg.norm(along, axis=1)
    np.testing.assert_allclose(force[slips], MU * pressure[slips], atol=1e-10 * size)
    slip = np.linalg.norm(contact.slip().x.array.reshape(-1, d), axis=1)
    assert slip[sticks].max(initial=0.0) < 1e-9 * SLID
    assert slip[slips].min(initial=SLID) > 1e-6 * SLID


@pytest.mark.parametrize("cell, degree", [("triangle", 1), ("quadrilateral", 2)])
def test_answers_do_not_depend_on_gamma(cell, degree):
    forces = [
        dragged(cell, degree, factor).contact.resultant(0).force
        for factor in (0.04, 0.4, 4.0)
    ]
    for force in forces[1:]:
        np.testing.assert_allclose(force, forces[0], rtol=1e-9)


@pytest.mark.mpi
def test_a_law_of_the_user_is_that_of_the_library():
    """Evaluated at nodes, with the place and the accumulated slip as arguments."""
    law = Friction(lambda p, v, x, slip: MU * p + 0.0 * (x[0] + slip))
    found, known = (dragged("triangle", 1, 0.4, one) for one in (law, Coulomb(MU)))
    force, other = (one.contact.resultant(0).force for one in (found, known))
    np.testing.assert_allclose(force, other, rtol=1e-10)
    work, expected = (one.contact.friction_work() for one in (found, known))
    assert work == pytest.approx(expected, rel=1e-9) and work > 0.0
