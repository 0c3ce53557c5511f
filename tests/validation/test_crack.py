"""Faces of a closed crack share its tip, and multipliers carry its pressure up to there."""

from __future__ import annotations

from types import SimpleNamespace

import gathered
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from problems import COMM

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    Tie,
    tools,
    versions,
)
from raymortar.core import compat

FACES, NEAR = (1, 2), 1e-9
# A plate of 12 crack lengths, crack from -1 to 1 at 30 degrees to its load
SIDE, E, NU, MU, ANGLE = 12.0, 1000.0, 0.25, 0.2, np.pi / 6
LAWS = {
    "points": AugmentedLagrangian(condition="points"),
    "nodes": AugmentedLagrangian(condition="nodes"),
    "dual": AugmentedLagrangian(condition="nodes", multiplier="dual"),
}


def axes(facets, layers):
    """Places of the mesh lines along each axis."""
    away = 1.0 + (SIDE - 1.0) * (1.4 ** np.arange(13) - 1) / (1.4**12 - 1)
    up = SIDE * (1.4 ** np.arange(15) - 1) / (1.4**14 - 1)
    x = np.concatenate([-away[:0:-1], np.linspace(-1, 1, facets + 1), away[1:]])
    y = np.concatenate([-up[:0:-1], up])
    return (x, y, np.linspace(0.0, 0.2, layers + 1)) if layers else (x, y)


def cracked(facets, layers=0):
    """A plate whose nodes within the crack are doubled, those of its tips not, and tags
    of its faces; in space with layers along its front."""
    lines = axes(facets, layers)
    d, counts = len(lines), [len(one) for one in lines]
    X = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, d)
    numbers = np.arange(len(X)).reshape(counts)
    corners = [
        numbers[tuple(slice(s, n - 1 + s) for s, n in zip(shift[::-1], counts))]
        for shift in np.ndindex(*(2,) * d)
    ]
    cells = np.stack([one.ravel() for one in corners], axis=1)
    inside = (abs(X[:, 1]) < NEAR) & (abs(X[:, 0]) < 1.0 - NEAR)
    doubled, twin = np.flatnonzero(inside), np.arange(len(X))
    twin[doubled] = len(X) + np.arange(len(doubled))
    above = X[cells].mean(axis=1)[:, 1] > 0.0
    cells[above] = twin[cells[above]]
    here = cells if COMM.rank == 0 else cells[:0]
    kind = "hexahedron" if layers else "quadrilateral"
    mesh = versions.create_mesh(COMM, here, np.vstack([X, X[doubled]]), kind)
    faces = dmesh.locate_entities_boundary(
        mesh, d - 1, lambda x: (abs(x[1]) < NEAR) & (abs(x[0]) < 1.0 + NEAR)
    )
    mesh.topology.create_connectivity(d - 1, d)
    of = [mesh.topology.connectivity(d - 1, d).links(f)[0] for f in faces]
    middles = dmesh.compute_midpoints(mesh, d, np.array(of, dtype=np.int32))
    values = np.where(middles[:, 1] > 0.0, *FACES).astype(np.int32)
    return mesh, compat.meshtags(mesh, d - 1, faces, values)


def held_at(V, place, axis):
    """A component held at one place, in space along a line."""
    W = compat.collapsed(V.sub(axis))[0]
    dofs = fem.locate_dofs_geometrical(
        (V.sub(axis), W),
        lambda x: np.isclose(x[0], place[0]) & np.isclose(x[1], place[1]),
    )
    return fem.dirichletbc(fem.Function(W), dofs, V.sub(axis))


def plate(law, degree=2, facets=40, layers=0, mu=MU):
    mesh, tags = cracked(facets, layers)
    d = mesh.geometry.dim
    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    strain = ufl.sym(ufl.grad(u))
    G, bulk = E / 2 / (1 + NU), E * NU / (1 + NU) / (1 - 2 * NU)
    stress = 2 * G * strain + bulk * ufl.tr(strain) * ufl.Identity(d)
    load = fem.Constant(mesh, np.zeros((d, d)))
    far = dmesh.locate_entities_boundary(
        mesh, d - 1, lambda x: np.isclose(np.max(abs(x[:2]), axis=0), SIDE)
    )
    outer = compat.meshtags(mesh, d - 1, far, np.full(len(far), 9, np.int32))
    ds = ufl.Measure("ds", mesh, subdomain_data=outer)
    n = ufl.FacetNormal(mesh)
    F = ufl.inner(stress, ufl.grad(v)) * ufl.dx - ufl.inner(load * n, v) * ds(9)
    left, right = (-SIDE, -SIDE), (SIDE, -SIDE)
    bcs = [held_at(V, left, 0), held_at(V, left, 1), held_at(V, right, 1)]
    if layers:  # plane strain
        sides = dmesh.locate_entities_boundary(
            mesh, 2, lambda x: (x[2] < NEAR) | (x[2] > 0.2 - NEAR)
        )
        bcs.append(tools.prescribe(V, sides, 0.0, 2))
    contact = Contact(u, tags, [FACES], law, friction=Coulomb(mu) if mu else None)
    problem = NonlinearProblem(F, contact, bcs)
    way = np.zeros(d)
    way[:2] = np.sin(ANGLE), np.cos(ANGLE)

    def press(t):
        load.value[:] = -t * np.outer(way, way)

    return SimpleNamespace(
        u=u, contact=contact, problem=problem, press=press, mesh=mesh, tags=tags
    )


def by_facet(one, facets):
    """Mean pressure on each of the facets' spans along the crack. Collective."""
    points = gathered.points(one.contact)
    weight, x = points["weight"], points["X"][:, 0]
    span = np.clip(((x + 1.0) / 2.0 * facets).astype(int), 0, facets - 1)
    area = np.bincount(span, weight, facets)
    return np.bincount(span, weight * points["pressure"], facets) / area


def slide(one):
    """Slide of the faces in the middle of the crack. Collective."""
    V, d = one.u.function_space, one.mesh.geometry.dim
    X, n = V.tabulate_dof_coordinates(), V.dofmap.index_map.size_local
    sums = np.zeros((2, 2))
    for k, tag in enumerate(FACES):
        dofs = fem.locate_dofs_topological(V, d - 1, one.tags.find(tag))
        dofs = dofs[(dofs < n) & (abs(X[dofs, 0]) < NEAR)]
        sums[k] = one.u.x.array.reshape(-1, d)[dofs, 0].sum(), len(dofs)
    up, down = (total / count for total, count in COMM.allreduce(sums))
    return abs(up - down)


@pytest.mark.mpi
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("degree, facets, layers", [(2, 24, 0), (1, 16, 1)])
def test_a_closed_crack_carries_its_pressure_to_the_tip(law, degree, facets, layers):
    """In the plane, and along a front in space. An infinite plate has the same pressure
    everywhere, and an elliptic slide."""
    one = plate(LAWS[law], degree, facets, layers)
    steps = LoadSteps(one.problem.snes_solver, one.press, 4)
    assert max(step.iterations for step in steps) <= 5
    normal = np.cos(ANGLE) ** 2
    p = by_facet(one, facets) / normal
    assert abs(p - 1.0).max() <= 0.05
    assert abs(p[1:-1] - 1.0).max() <= 0.01
    exact = 4 * (1 - NU**2) / E * (np.sin(ANGLE) * np.cos(ANGLE) - MU * normal)
    assert abs(slide(one) / exact - 1.0) <= (0.01 if degree == 2 else 0.03)


@pytest.mark.mpi
@pytest.mark.parametrize("layers", [0, 1])
def test_a_crack_is_not_tied_at_its_tip(layers):
    mesh, tags = cracked(8, layers)
    u = fem.Function(tools.vector_space(mesh, 1))
    with pytest.raises(ContactError, match="share . vertex"):
        Tie(u, tags, [FACES])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("layers", [0, 1])
def test_closed_faces_meet_up_to_the_tip_under_a_penalty(layers, seed):
    """Nodes of a mesh file lie on each other but for rounding, in any direction."""
    mesh, tags = cracked(8, layers)
    noise = np.random.default_rng(seed).normal(size=mesh.geometry.x.shape)
    d = mesh.geometry.dim
    mesh.geometry.x[:, :d] += 1e-15 * noise[:, :d]
    u = fem.Function(tools.vector_space(mesh, 1))
    contact = Contact(u, tags, [FACES], Penalty(1.0))
    contact.update()
    points = gathered.points(contact)
    area = points["weight"][points["pair"] >= 0].sum()
    assert area == pytest.approx(2.0 * (0.2 if layers else 1.0), rel=1e-9)
