"""Slave and master with facets of different shapes and degrees."""

from __future__ import annotations

import warnings

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import problems
import pytest
from problems import SOLVERS, worst

from raymortar import AugmentedLagrangian, Coulomb, Penalty

# Cells of the lower body and of the upper one, whose surface is the slave; degrees of
# their displacements; degrees of their geometries
KINDS = {
    "lines 1 on 2": (("triangle", "quadrilateral"), (2, 1), (1, 1)),
    "lines 2 on 1": (("quadrilateral", "triangle"), (1, 2), (1, 1)),
    "lines 1 on curved": (("triangle", "triangle"), (1, 1), (2, 1)),
    "triangles on squares": (("hexahedron", "tetrahedron"), (1, 1), (1, 1)),
    "squares on triangles": (("tetrahedron", "hexahedron"), (1, 1), (1, 1)),
    "triangles 2 on squares 1": (("hexahedron", "tetrahedron"), (1, 2), (1, 1)),
    "squares 1 on triangles 2": (("tetrahedron", "hexahedron"), (2, 1), (1, 1)),
    "triangles 1 on 2": (("tetrahedron", "tetrahedron"), (2, 1), (1, 1)),
    "squares 2 on curved": (("hexahedron", "hexahedron"), (1, 2), (2, 1)),
}
QUICK = ("lines 2 on 1", "triangles on squares")
EVERY_KIND = [
    pytest.param(kind, marks=[pytest.mark.quick] if kind in QUICK else [])
    for kind in KINDS
]
LAWS = {
    "normal": {"method": AugmentedLagrangian(40.0)},
    "vector": {"method": AugmentedLagrangian(40.0, multiplier="vector")},
    "friction": {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(40.0), "friction": Coulomb(0.3)},
    "nodes": {
        "method": AugmentedLagrangian(40.0, condition="nodes"),
        "friction": Coulomb(0.3),
    },
    "deformed": {"method": AugmentedLagrangian(40.0), "measure": "current"},
}


def divisions(kind):
    return (3, 2) if problems.DIMENSION[KINDS[kind][0][0]] == 3 else (5, 4)


def scenes(kind, **options):
    cells, _, geometry = KINDS[kind]
    return hosts.meshes(cells, divisions(kind), geometry_degrees=geometry, **options)


def bent(X):
    """A shear that bends horizontal planes, the interface among them."""
    Y = X.copy()
    Y[:, -1] += 0.05 * np.sin(2.0 * X[:, 0] + 0.3) + 0.03 * X[:, 0] * X[:, -2]
    return Y


@pytest.mark.mpi
@pytest.mark.parametrize("law", ("normal", "friction"))
@pytest.mark.parametrize("kind", EVERY_KIND)
def test_a_uniform_squeeze_is_exact(kind, law):
    found = hosts.apart(
        scenes(kind, widths=(1.0, 1.0)),
        degree=KINDS[kind][1],
        rollers=True,
        **LAWS[law],
    )
    last = len(found.move) - 1
    found.move[last].value = -0.2
    iterations, converged = SOLVERS[-1](found.problem).solve()
    assert converged and iterations < 10
    for u in found.functions:
        V = u.function_space
        n = V.dofmap.index_map.size_local
        X = V.tabulate_dof_coordinates()[:n, : last + 1]
        values = u.x.array[: X.size].reshape(X.shape)
        assert worst(values[:, last] + 0.1 * X[:, last]) < 1e-10
        # The side that is not held has spread by the same share everywhere
        spread = problems.COMM.allreduce(values[:, 0].max(initial=0.0), op=MPI.MAX)
        assert spread > 0.0 and worst(values[:, 0] - spread * X[:, 0]) < 1e-10


def pressed(kind, law, size=0.02):
    """Bodies that are bent, pressed and moved along each other."""
    found = hosts.apart(scenes(kind, mapping=bent), degree=KINDS[kind][1], **LAWS[law])
    found.push(*([0.01] * (len(found.move) - 1)), -size)
    _, converged = SOLVERS[-1](found.problem).solve()
    assert converged
    return found


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", EVERY_KIND)
def test_the_tangent_is_the_derivative(kind, law):
    found = pressed(kind, law)
    assert gathered.points(found.contact)["status"].max() > 1
    # A solution lies on kinks of the law, other states seldom do
    aways = (0.004, 0.007, 0.01)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 1e-7


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ("lines 2 on 1", "triangles 2 on squares 1"))
def test_forces_balance_and_ranks_agree(kind, monkeypatch):
    found = pressed(kind, "friction")
    force = found.contact.resultant(0).force
    above = [bc for i, bc in enumerate(found.problem.bcs) if i % 2]
    reaction = found.problem.reactions({"above": above})["above"]
    assert reaction == pytest.approx(-force, rel=1e-8)
    with monkeypatch.context() as patch:
        patch.setattr(problems, "COMM", MPI.COMM_SELF)
        patch.setattr(hosts, "COMM", MPI.COMM_SELF)
        alone = pressed(kind, "friction")
        assert alone.contact.resultant(0).force == pytest.approx(force, rel=1e-10)


@pytest.mark.parametrize("dim", (2, 3))
def test_degree_1_where_the_other_side_has_degree_2(dim):
    """Against both sides of degree 2: the error is that of the coarser one."""
    cells = ("triangle",) * 2 if dim == 2 else ("tetrahedron",) * 2
    n = (8, 6) if dim == 2 else (3, 2)
    forces = []
    for degrees in ((2, 2), (1, 2), (1, 1)):
        found = hosts.apart(hosts.meshes(cells, n), degree=degrees)
        found.push(*([0.0] * (dim - 1)), -0.05)
        SOLVERS[-1](found.problem).solve()
        forces.append(found.contact.resultant(0).force[-1])
    both, one, none = forces
    # Coarser spaces are stiffer
    assert both < one < none or both > one > none


@pytest.mark.parametrize("geometry", ((1, 2), (2, 1), (2, 2)))
def test_straight_facets_on_curved_ones_are_told(geometry):
    """Whichever side is straight; the interference is less than its sagitta."""
    cells = ("quadrilateral", "quadrilateral")
    bodies = hosts.meshes(cells, (5, 4), geometry_degrees=geometry, mapping=bent)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = hosts.apart(bodies, offset=-1e-5)
        found.problem.create_matrix()
    told = [w for w in caught if "straight facets of slave tag" in str(w.message)]
    assert len(told) == (0 if geometry == (2, 2) else 1)
