"""The automatic coefficient of bodies that bend: of arcs, too, and of loose bodies."""

import numpy as np
import pytest
from pathing import take
from problems import COMM, build, fix
from slender import belt, bent

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Penalty
from raymortar.bending.compliance import NODES, SurfaceCompliance
from raymortar.core import compat
from raymortar.core.gamma.probing import VolumePattern

NODES_LAW = AugmentedLagrangian(condition="nodes")


def compliance_of(problem, bcs):
    """Mean compliance of the slave's side of the upper body."""
    surfaces = problem.contact.surfaces
    volume = VolumePattern(problem.problem.a, problem.contact.layout)
    found = SurfaceCompliance(volume, surfaces.unknowns, surfaces.bodies, bcs, False)
    sides = [zone.facets.slave_surface for zone in surfaces.zones]
    values = found.of_side(sides)
    found.destroy()
    volume.destroy()
    return float(COMM.allreduce(values.max()) / COMM.size)


def blocks(n=(3, 3), size=None, bcs=None, nu=0.0):
    """Linear elastic blocks, E = 1."""
    scene = two_blocks(COMM, 2, "quadrilateral", *n, upper_size=size or (1.0, 1.0))
    return build(scene, E=1.0, nu=nu, bcs=bcs)


@pytest.mark.quick
@pytest.mark.mpi
def test_a_row_of_cells_yields_as_a_dense_matrix_says():
    """All nodes of a small side: diagonal of the inverse, times the nodes' areas."""
    held = lambda V, s: [fix(V, s, ["top", "bottom"])]  # noqa: E731
    problem = blocks(bcs=held)
    found = compliance_of(problem, problem.problem.bcs)
    if COMM.size > 1:
        assert found > 0.0
        return
    matrix = compat.form(problem.problem.forms[1])
    from dolfinx.fem.petsc import assemble_matrix

    K = assemble_matrix(matrix, problem.problem.bcs)
    K.assemble()
    inverse = np.linalg.inv(K.convert("dense").getDenseArray())
    surface = problem.contact.zones[0].facets.slave_surface
    nodes, counts = np.unique(surface.dofs[surface.facet_dofs], return_counts=True)
    assert len(nodes) <= NODES
    area = counts / counts.sum()
    down = inverse[2 * nodes + 1, 2 * nodes + 1]
    assert found == pytest.approx(np.mean(down * area), rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("shift", [0.0, 1e3])
def test_a_loose_body_yields_by_its_strains_alone(shift):
    """As it does on supports that let it strain; wherever it is."""
    problem = blocks()
    problem.u.function_space.mesh.geometry.x[:, 0] += shift
    loose = compliance_of(problem, [])
    held = blocks(bcs=lambda V, s: [fix(V, s, "top"), fix(V, s, "bottom")])
    supported = compliance_of(held, held.problem.bcs)
    assert 0.5 * supported < loose < 3.0 * supported


@pytest.mark.mpi
def test_slender_bodies_have_less():
    """And penalties what they had: their answer depends on it."""
    found, shares = [], []
    for slenderness in (2, 20, 100):
        augmented, penalty = (
            bent(slenderness, method=method).problem.contact.gamma
            for method in (NODES_LAW, Penalty())
        )
        found.append(augmented)
        shares.append(10.0 * augmented / penalty)
    assert 0.05 < shares[0] < 1.0
    assert shares[1] < 0.4 * shares[0] and shares[2] < 0.2 * shares[1]


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("slenderness", [2, 20, 100])
def test_forces_of_bent_strips_do_not_depend_on_it(slenderness, mu):
    forces = []
    for factor in (1.0, 3.0):
        path = bent(slenderness, mu, method=NODES_LAW)
        contact = path.problem.contact
        contact.set_gamma(factor * contact.gamma)
        assert take(path).arrived
        forces.append(path.result()[1])
    assert forces[1] == pytest.approx(forces[0], rel=1e-8)


def test_a_belt_on_a_pulley_slides_in_few_solves():
    """Full steps throughout, on a path that took 2303 tangents by the law at points."""
    path = belt(method=NODES_LAW)
    found = take(path)
    assert found.arrived and found.halvings == 0
    assert found.tangents <= 200
    # exp(mu pi) less what the thickness and bending take
    assert path.result()[0] == pytest.approx(np.exp(0.3 * np.pi), rel=0.006)
