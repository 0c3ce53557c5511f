"""Ties: rates of convergence across a curved interface."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, fix
from tying import NU, E, outer

from meshes.scenes import two_blocks
from raymortar import NonlinearProblem, SNESSolver, Tie
from raymortar.core import compat
from raymortar.core.discretization.facets import shape_functions

# J2: rates


def waves(x, sin=np.sin, cos=np.cos):
    """A smooth displacement, of NumPy arrays or UFL expressions."""
    return [
        0.01 * sin(2.0 * x[0]) * cos(1.5 * x[1]),
        0.01 * cos(1.2 * x[0] + 0.3) * sin(1.7 * x[1]),
    ]


def wave_errors(n, degree):
    """Across a curved interface: errors of displacement and multiplier, in L2."""
    scene = two_blocks(
        COMM,
        2,
        "quadrilateral",
        2 * n,
        3 * n,
        degree,
        interface=lambda x: 1.0 + 0.15 * np.sin(2.5 * x[:, 0]),
    )
    mesh = scene.mesh
    V = compat.vector_space(mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    x = ufl.SpatialCoordinate(mesh)
    exact = ufl.as_vector(waves(x, ufl.sin, ufl.cos))
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))

    def stress(w):
        e = ufl.sym(ufl.grad(w))
        return 2.0 * mu * e + lmbda * ufl.tr(e) * ufl.Identity(2)

    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree + 3})
    F = ufl.inner(stress(u), ufl.sym(ufl.grad(v))) * dx
    F += ufl.inner(ufl.div(stress(exact)), v) * dx
    tie = Tie(u, scene.facet_tags, [(scene.tags["slave"], scene.tags["master"])])
    names = outer(scene, "slave", "master")
    bcs = [fix(V, scene, names, None, lambda x: np.stack(waves(x.T), axis=1))]
    solver = SNESSolver(NonlinearProblem(F, tie, bcs))
    solver.solve()
    error = compat.form(ufl.inner(u - exact, u - exact) * dx)
    off = COMM.allreduce(fem.assemble_scalar(error))
    # At the points of the slave, away from its ends where the multiplier is damped
    points = tie.points()
    X = _undeformed(tie.zones[0].facets.slave_surface, points)
    inner = (X[:, 0] > 0.2) & (X[:, 0] < 0.8)
    t = [_stress_at(x, mu, lmbda) @ _normal_at(x) for x in X]
    away = (points["traction"] - np.reshape(t, (-1, 2)))[inner]
    squares = COMM.allreduce(float((points["weight"][inner, None] * away**2).sum()))
    return np.sqrt(off), np.sqrt(squares)


def _undeformed(surface, points):
    """Where points were, (n, 2)."""
    N, _ = shape_functions(surface.shape, surface.node_degree, points["xi"])
    return np.einsum("qa,qad->qd", N, surface.X[surface.facet_nodes[points["slave"]]])


def _normal_at(x):
    """Of the slave, on the true interface."""
    m = np.array([0.15 * 2.5 * np.cos(2.5 * x[0]), -1.0])
    return m / np.linalg.norm(m)


def _stress_at(x, mu, lmbda, h=1e-6):
    columns = [
        (np.array(waves(x + h * e)) - np.array(waves(x - h * e))) / (2.0 * h)
        for e in np.eye(2)
    ]
    e = 0.5 * (np.array(columns) + np.array(columns).T)
    return 2.0 * mu * e + lmbda * np.trace(e) * np.eye(2)


@pytest.mark.mpi
@pytest.mark.parametrize("degree, rate, of_traction", [(1, 2.0, 1.5), (2, 3.0, 1.9)])
def test_rates_across_a_curved_interface(degree, rate, of_traction):
    coarse, fine = (wave_errors(n, degree) for n in (3, 6))
    found = np.log2(np.divide(coarse, fine))
    print(f"degree {degree}: {found}, {fine}")
    assert found[0] >= rate - 0.2 and found[1] >= of_traction
