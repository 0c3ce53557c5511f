"""Surfaces that meet themselves: balances, symmetry, tangents, and the same facets as
two contacts of half the weight (M1, M2, W1, W2)."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import gathered
import numpy as np
import pytest
import states
from balances import nodal_forces, nodal_positions, out_of_balance
from dolfinx import fem
from folding import WALL, joined, only_legs, pinched, u_strip
from problems import COMM, SOLVERS, fix, residual
from states import Case, name_of
from tangents import contact_pairs, is_second_order, quiet_slopes, remainders_of, slopes

from meshes.scenes import two_blocks
from raymortar import Contact, Coulomb, NonlinearProblem, Penalty, rigid
from raymortar.core import compat

pytestmark = pytest.mark.mpi
GAMMA = 50.0
CELLS = ("quadrilateral", "triangle", "hexahedron", "tetrahedron")


def pinched_u(
    cell, degree=1, geometry_degree=1, depth=0.03, noise=0.0, deep=2, **options
):
    """A U whose legs have met, without a solve."""
    scene = u_strip(cell, geometry_degree=geometry_degree, deep=deep)
    u = fem.Function(compat.vector_space(scene.mesh, degree))
    tags = [(scene.tags["skin"], scene.tags["skin"])]
    contact = Contact(u, scene.facet_tags, tags, Penalty(GAMMA), **options)
    X = states.dof_positions(u.function_space)
    moved = pinched(X, depth)
    if noise:
        rough = states.rough_field(np.random.default_rng(1), u.function_space)
        moved += noise * rough
    u.x.array[:] = moved.ravel()
    contact.update()
    return contact


@pytest.mark.quick
@pytest.mark.parametrize("degrees", [(1, 1), (2, 2)])
@pytest.mark.parametrize("cell", CELLS)
def test_forces_and_moments_of_a_fold_add_up_to_zero(cell, degrees):
    """Also where facets of both legs are out of line (W1)."""
    contact = pinched_u(cell, *degrees, noise=0.004)
    force, moment = out_of_balance(contact)
    assert force < 1e-13
    assert moment < 1e-12
    assert np.all(contact.resultant(77, 77).force == 0.0)


def test_friction_of_a_fold_is_in_balance():
    """Half of it on each side, with springs of its own, over several steps."""
    contact = pinched_u("quadrilateral", friction=Coulomb(0.3))
    contact.advance()
    X = states.dof_positions(contact.u.function_space)
    for step in range(3):
        moved = contact.u.x.array.reshape(X.shape)
        moved[:, 1] += 0.004 * np.sign(X[:, 0]) * (X[:, 1] > 0.0) * X[:, 1]
        contact.update()
        force, moment = out_of_balance(contact)
        assert force < 1e-13
        assert moment < 1e-12
        points = gathered.points(contact)
        slips = np.linalg.norm(points["slip"], axis=1)[points["status"] >= 2]
        assert slips.max() > 1e-3
        assert COMM.allreduce(contact.friction_work()) > 0.0
        contact.advance()


@pytest.mark.quick
def test_both_legs_have_the_same_pressure():
    """A mirrored mesh gives mirrored tractions (W1)."""
    contact = pinched_u("quadrilateral")
    f, x = nodal_forces(contact), nodal_positions(contact)
    place = states.by_place(x, x * [-1.0, 1.0])
    assert np.abs(f[place] - f * [-1.0, 1.0]).max() < 1e-10 * np.abs(f).max()
    pressure = contact.pressure()
    assert COMM.allreduce(float(pressure.x.array.max(initial=0.0)), op=MPI.MAX) > 1.0


def solved(scene, contacts, u):
    """Nodal displacements of two blocks that are pressed onto each other."""
    V = u.function_space
    F = residual(scene, u, "neo-hookean", 10.0)[0]
    down = fem.Constant(scene.mesh, PETSc.ScalarType(-0.05))
    side = scene.mesh.geometry.dim - 1
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", side, down)]
    bcs.append(fix(V, scene, "top", 0))
    SOLVERS[-1](NonlinearProblem(F, contacts, bcs)).solve()
    return gathered.owned(V, u.x.array.reshape(-1, side + 1))


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_one_tag_is_two_contacts_of_half_the_weight(cell):
    """(M2, W2)."""
    scene = two_blocks(COMM, 2, cell, 3, 4)
    tags, found = scene.tags, []
    one_tag = joined(scene)
    for of, pairs, gamma in (
        (scene, [("slave", "master")], 0.5 * GAMMA),
        (one_tag, [("skin", "skin")], GAMMA),
    ):
        u = fem.Function(compat.vector_space(scene.mesh, 1))
        numbers = [tuple(of.tags[name] for name in pair) for pair in pairs]
        contacts = [Contact(u, of.facet_tags, numbers, Penalty(gamma))]
        if of is scene:
            turned = [pair[::-1] for pair in numbers]
            contacts.append(Contact(u, of.facet_tags, turned, Penalty(gamma)))
        found.append(solved(of, contacts, u))
    named, alone = found
    assert np.abs(named).max() > 0.04
    assert np.abs(alone - named).max() < 1e-10
    assert tags["slave"] != tags["master"]


# Width of a slit between legs that lie on each other: rotations are as small, and rays
# are those of a rigid line to second order in them
SLIT = 1e-6


def squeezed(share, contact_of):
    """Displacement of the left leg of a U whose ends are moved inward by little."""
    strip = {"along": round(32 * share), "share": share}
    middle = 0.5 * (WALL + SLIT)
    scene = only_legs(u_strip("quadrilateral", middle=middle, **strip))
    V = compat.vector_space(scene.mesh, 2)
    u = fem.Function(V)
    F = residual(scene, u, "neo-hookean", 10.0)[0]
    way = [fem.Constant(scene.mesh, PETSc.ScalarType(value)) for value in (0.0, 0.0)]
    bcs = [fix(V, scene, "left", 0, way[0])]
    if share == 1.0:
        bcs += [fix(V, scene, "right", 0, way[1])]
        bcs += [fix(V, scene, name, 1) for name in ("left", "right")]
    else:
        bcs += [fix(V, scene, "right", 0), fix(V, scene, "left", 1)]
    contact = contact_of(u, scene)
    way[0].value, way[1].value = 4.0 * SLIT, -4.0 * SLIT
    SOLVERS[-1](NonlinearProblem(F, contact, bcs)).solve()
    X = gathered.owned(V, states.dof_positions(V))
    values = gathered.owned(V, u.x.array.reshape(-1, 2))
    left = X[:, 0] < 1e-9
    order = np.lexsort(np.round(X[left], 9).T)
    return values[left][order], contact


def test_a_fold_is_half_of_it_on_a_rigid_line():
    """On mirrored meshes with matching nodes, to 1e-9 (M1)."""

    def itself(u, scene):
        pairs = [(scene.tags["skin"], scene.tags["skin"])]
        return Contact(u, scene.facet_tags, pairs, Penalty(GAMMA))

    def on_line(u, scene):
        pairs = [(scene.tags["skin"], rigid.Line((0.0, 0.0), (-1.0, 0.0)))]
        return Contact(u, scene.facet_tags, pairs, Penalty(2.0 * GAMMA))

    (whole, contact), (half, _) = squeezed(1.0, itself), squeezed(0.5, on_line)
    assert gathered.points(contact)["pressure"].max() > 0.5 * SLIT * GAMMA
    assert np.abs(half).max() > SLIT
    assert whole.shape == half.shape
    assert np.abs(whole - half).max() < 1e-9 * np.abs(half).max()


# Tangents


def tangent_cases():
    for cell in states.CELLS:
        for degrees, measure in (((1, 1), "current"), ((2, 2), "reference")):
            case = Case(cell, *degrees, "penalty", measure)
            quick = [pytest.mark.quick] if measure == "current" else []
            yield pytest.param(case, id=name_of(case), marks=quick)


@pytest.mark.parametrize("case", list(tangent_cases()))
def test_tangent_of_one_tag_is_exact(case):
    """Two bodies whose facets are one surface; Taylor slope 2 with moving segments."""
    scene = joined(case.scene("many"))
    make = contact_pairs(scene, case, quadrature_degree=2 if case.dim == 3 else None)

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    full, _ = quiet_slopes(make, prepare)
    assert is_second_order(full), full


@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_tangent_of_a_fold_is_exact(cell, friction):
    """One body: rows of slave and master meet in the same columns of the volume."""
    contact = pinched_u(cell, depth=0.06, noise=0.004, deep=1, friction=friction)
    V = contact.u.function_space
    # Corners and rims of one leg are between those of the other
    moved = contact.u.x.array.reshape(-1, V.mesh.geometry.dim)
    right = states.dof_positions(V)[:, 0] > 0.0
    moved[:, 1:] += 0.07 * right[:, None]
    contact.update()
    contact.advance()
    moved[:, -1] += 0.04 * right
    moved += 0.003 * states.rough_field(np.random.default_rng(2), V)
    contact.update()
    points = gathered.points(contact)
    hit = points["master"] >= 0
    assert np.array_equal(points["master"][hit], points["seed"][hit])
    K = states.tangent(contact, states.mass_form(V))
    for seed in range(20):
        found = remainders_of(contact, K, seed)
        if found is not None:
            assert is_second_order(slopes(*found)), slopes(*found)
            return
    raise AssertionError("no direction without a kink nearby")


# Ranks, and solids of revolution


def forces_at(comm, cell, **options):
    """Contact forces at all nodes of a fold, in the order of their places."""
    scene = u_strip(cell, deep=2, comm=comm)
    V = compat.vector_space(scene.mesh, 1)
    u, dim = fem.Function(V), scene.mesh.geometry.dim
    skin = scene.tags["skin"]
    contact = Contact(u, scene.facet_tags, [(skin, skin)], Penalty(GAMMA), **options)
    X = states.dof_positions(V)
    u.x.array[:] = (pinched(X, 0.05) + 0.01 * np.sin(9.0 * X[:, ::-1])).ravel()
    contact.update()
    b = contact.create_vector()
    contact.assemble_vector(b, [])
    b.assemble()
    n = V.dofmap.index_map.size_local
    own = b.getArray(readonly=True)[: n * dim].reshape(-1, dim)
    rows = np.concatenate(comm.allgather(np.hstack([X[:n], own])))
    return rows[np.lexsort(np.round(rows[:, :dim], 9).T)]


@pytest.mark.many_ranks
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_ranks_find_the_same_folds(cell):
    """Halves of a fold are on other ranks, as are facets that share a vertex."""
    one, all_ranks = (forces_at(comm, cell) for comm in (MPI.COMM_SELF, COMM))
    assert one.shape == all_ranks.shape
    assert np.abs(one).max() > 0.1
    assert np.abs(one - all_ranks).max() < 1e-10 * np.abs(one).max()


def test_a_fold_of_revolution_is_in_balance_along_the_axis():
    """A groove in a shaft: rings meet, whose radii differ. A full turn has no moment."""
    scene = u_strip("quadrilateral")
    scene.mesh.geometry.x[:, 0] += 3.0
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    skin = scene.tags["skin"]
    options = {"friction": Coulomb(0.2), "axisymmetric": True}
    contact = Contact(u, scene.facet_tags, [(skin, skin)], Penalty(GAMMA), **options)
    X = states.dof_positions(u.function_space) - [3.0, 0.0]
    moved = pinched(X, 0.03)
    moved[:, 1] += 0.01 * (X[:, 0] > 0.0)
    u.x.array[:] = moved.ravel()
    contact.update()
    f = nodal_forces(contact)
    assert np.abs(f).sum() > 0.1
    assert abs(f[:, 1].sum()) < 1e-12 * np.abs(f).sum()
    plane = pinched_u("quadrilateral", depth=0.03)
    # Both legs have the same force, 2 pi r times that of the plane
    normal = np.abs(f[:, 0]).sum() / np.abs(nodal_forces(plane)[:, 0]).sum()
    assert normal == pytest.approx(6.0 * np.pi, rel=0.05)
