"""Ties: exact states, large rotations, gaps, solids of revolution, a cantilever."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
import revolution
import ufl
from dolfinx import fem
from problems import CELLS, COMM, DIMENSION, Problem, fix, residual, worst
from states import rough_field
from tying import (
    NU,
    E,
    bent,
    build,
    errors,
    linear,
    outer,
    rotation,
    strain_of,
    stress_of,
    with_gap,
)
from uncovered import boundary_of, load_of_the_rest

from meshes.scenes import two_blocks
from raymortar import NonlinearProblem, Penalty, Tie
from raymortar.core import compat

TOLERANCE = 1e-10


# J1: any uniform stress passes through flat interfaces


def pulled(scene, degree=1, held=("bottom",), free=(), **options):
    """A uniform stress with all components, solved for: Dirichlet conditions on some
    sides, loads on the others."""
    dim = scene.mesh.geometry.dim
    loaded = [name for name in outer(scene, "slave", "master") if name not in held]
    problem = build(
        scene,
        degree,
        bcs=lambda V, scene: linear(V, scene, *held),
        loaded=[*loaded, *free],
        load=stress_of(strain_of(dim)),
        **options,
    )
    assert problem.solve(rtol=1e-13) <= 3
    return problem


def down(dim):
    return -np.eye(dim)[-1]


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_uniform_stress_passes(cell, degree):
    scene = two_blocks(COMM, DIMENSION[cell], cell, perturb=0.2)
    problem = pulled(scene, degree)
    assert errors(problem, down(problem.dim)) <= TOLERANCE


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_uniform_stress_passes_an_inclined_interface(cell):
    dim = DIMENSION[cell]
    tilt = 0.4 if dim == 2 else (0.4, -0.3)
    scene = two_blocks(COMM, dim, cell, 3, 2, tilt=tilt, rotation=rotation(dim))
    m = rotation(dim) @ np.append(np.tan(tilt), -1.0)
    assert errors(pulled(scene), m / np.linalg.norm(m)) <= TOLERANCE


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_uniform_stress_passes_between_held_sides(cell, degree):
    """Slave nodes at the sides are held, and so is what lies opposite."""
    scene = two_blocks(COMM, DIMENSION[cell], cell, 3, 2)
    held = outer(scene, "slave", "master", "top")
    problem = pulled(scene, degree, held)
    assert errors(problem, down(problem.dim)) <= TOLERANCE


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_uniform_stress_passes_a_penalty_of_springs(cell):
    """Springs stretch by the traction over gamma: what is exact is the stress."""
    problem = pulled(two_blocks(COMM, DIMENSION[cell], cell), method=Penalty(1e4))
    H = strain_of(problem.dim)
    assert worst(problem.gradient() - H) <= TOLERANCE
    points = problem.contact.points()
    opening = points["gap"][:, None] * points["normal"] + points["slip"]
    exact = stress_of(H) @ down(problem.dim) / 1e4
    assert worst(opening[points["status"] == 2] - exact) <= TOLERANCE


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_uniform_stress_passes_where_the_slave_overhangs(cell, degree):
    """What the master leaves free, to within facets, carries the stress as a load."""
    dim = DIMENSION[cell]
    scene = two_blocks(
        COMM,
        dim,
        cell,
        2,
        (5,) * (dim - 1) + (2,),
        upper_size=(1.45,) * (dim - 1) + (1.0,),
        overhang=0.2,
    )
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    sides = outer(scene, "slave", "master", "bottom")
    F, moduli, load = residual(scene, u, "linear", E, NU, sides)
    load.value[:] = S = stress_of(strain_of(dim))
    tags = (scene.tags["slave"], scene.tags["master"])
    tie = Tie(u, scene.facet_tags, [tags], partial=True)
    ds = boundary_of(F)
    rest = load_of_the_rest(tie, ds)[dim - 1]
    (v,) = F.arguments()
    F -= rest * ufl.inner(ufl.as_vector((S @ down(dim)).tolist()), v) * ds
    problem = NonlinearProblem(F, tie, linear(V, scene, "bottom"))
    found = Problem(scene, u, tie, problem, "linear", moduli, load)
    found.solve(rtol=1e-13)
    H = strain_of(dim)
    assert worst(found.gradient() - H) <= TOLERANCE * np.linalg.norm(H)
    zone = tie.zones[0]
    share, covered = zone.cpp.segments()["covered"], zone.cpp.covered_nodes() != 0
    assert np.any((share > 0.05) & (share < 0.95))
    lam = tie.multiplier.x.array.reshape(-1, dim)[zone.multiplier_nodes]
    assert worst(lam[covered] - S @ down(dim)) <= 1e-9 * np.linalg.norm(S)
    assert not covered.all() and not lam[~covered].any()


# J3, J4: large rotations, with gaps


def turned(problem, Q):
    """Displacement of a rotation, at this rank's nodes."""
    X = problem.u.function_space.tabulate_dof_coordinates()[:, : len(Q)]
    return X @ (Q - np.eye(len(Q))).T


@pytest.mark.mpi
@pytest.mark.parametrize("method", [None, Penalty(1e3)], ids=["multiplier", "penalty"])
@pytest.mark.parametrize("cell", CELLS)
def test_a_kept_gap_turns_without_stress(cell, method):
    problem = with_gap(cell, method=method)
    Q = rotation(problem.dim)
    assert problem.contact.tied == "keep" and "gaps kept" in repr(problem.contact)
    assert worst(problem.contact.points()["distance"] - 0.1) <= 1e-14
    problem.u.x.array[:] = turned(problem, Q).ravel()
    problem.contact.update()
    b = problem.contact.create_vector()
    problem.contact.set_gamma(1e3)
    problem.contact.assemble_vector(b)
    b.assemble()
    assert b.norm() <= 1e-12
    points = problem.contact.points()
    assert worst(points["gap"]) <= 1e-14
    assert worst(points["normal"] - Q @ down(problem.dim)) <= 1e-14


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_forces_turn_with_the_bodies(cell):
    """Held and moved in another frame the solution is the same."""
    solutions = []
    for Q in (np.eye(DIMENSION[cell]), rotation(DIMENSION[cell])):
        dim = len(Q)
        shift = np.array([0.3, 0.1, 0.2])[-dim:]

        def bcs(V, scene, Q=Q, shift=shift):
            turn = Q - np.eye(len(Q))
            return [
                fix(V, scene, "bottom", None, lambda x: x @ turn.T),
                fix(V, scene, "top", None, lambda x: x @ turn.T + Q @ shift),
            ]

        problem = with_gap(cell, gap=0.15, bcs=bcs)
        problem.u.x.array[:] = turned(problem, Q).ravel()
        problem.solve(rtol=1e-12)
        X = problem.u.function_space.tabulate_dof_coordinates()[:, :dim]
        x = X + problem.u.x.array.reshape(-1, dim)
        r = problem.contact.resultant()
        solutions.append((x @ Q, r.force @ Q, problem.slave_multiplier() @ Q))
        assert np.linalg.norm(r.force) > 1.0
    for one, other in zip(*solutions):
        assert worst(one - other) <= 1e-9 * worst(one)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_closing_closes_the_gap(cell):
    """By 0.3 of the facets' size, without a load: the upper block follows."""
    problem = with_gap(
        cell,
        adjust="close",
        bcs=lambda V, scene: [fix(V, scene, "bottom"), fix(V, scene, "top")],
    )
    assert worst(problem.contact.points()["gap"] - 0.1) <= 1e-14
    problem.solve(rtol=1e-12)
    points = problem.contact.points()
    opening = points["gap"][:, None] * points["normal"] + points["slip"]
    assert worst(COMM.allreduce(points["weight"] @ opening)) <= 1e-12
    force = problem.contact.resultant().force
    # Strain of 0.1 over a height of 2 and a stiffness of about E: tension
    assert force[-1] < -0.03 * E


@pytest.mark.mpi
def test_a_closed_gap_moves_a_free_body():
    """A body that only the tie holds is drawn onto its master without stress."""
    problem = with_gap(
        "quadrilateral", adjust="close", bcs=lambda V, scene: [fix(V, scene, "bottom")]
    )
    problem.solve(rtol=1e-12)
    assert worst(problem.gradient()) <= 1e-11
    assert worst(problem.slave_multiplier()) <= 1e-8
    V, u = problem.u.function_space, problem.u.x.array.reshape(-1, 2)
    upper = V.tabulate_dof_coordinates()[:, 1] > 1.05
    assert worst(u[upper] - [0.0, -0.1]) <= 1e-11


@pytest.mark.mpi
@pytest.mark.parametrize("adjust", ["keep", "close"])
@pytest.mark.parametrize("method", [None, Penalty(50.0)], ids=["multiplier", "penalty"])
@pytest.mark.parametrize("cell", ["triangle", "tetrahedron"])
def test_tangent_is_the_derivative(cell, method, adjust):
    """Differences of the residual fall by a factor of four with the step, squared."""
    problem = with_gap(cell, 2, method=method, adjust=adjust)
    contact = problem.contact
    contact.set_gamma(50.0)
    rng = np.random.default_rng(3)
    problem.u.x.array[:] = 0.05 * rough_field(rng, problem.u.function_space).ravel()
    if contact.multiplier is not None:
        W = contact.multiplier.function_space
        contact.multiplier.x.array[:] = rough_field(rng, W).ravel()
    A = contact.create_matrix(problem.problem.a)
    A.zeroEntries()
    x, d = contact.create_vector(), contact.create_vector()
    contact.to_vector(x)
    whole = rng.standard_normal(d.getSize())
    d.array[:] = whole[slice(*d.getOwnershipRange())]

    def residual(h):
        y = x.copy()
        y.axpy(h, d)
        contact.from_vector(y)
        contact.update()
        b = contact.create_vector()
        contact.assemble_vector(b)
        b.assemble()
        return b

    residual(0.0)
    contact.assemble_matrix(A)
    A.assemble()
    exact = A * d
    found = []
    for h in (1e-3, 5e-4):
        change = residual(h) - residual(-h)
        change.scale(0.5 / h)
        change.axpy(-1.0, exact)
        found.append(change.norm() / exact.norm())
    if found[0] > 1e-9:  # else it is linear
        assert np.log2(found[0] / found[1]) == pytest.approx(2.0, abs=0.05)
    elif adjust == "keep":
        pytest.fail(f"a kept gap is not linear: {found}")


# Solids of revolution


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("radius", [0.0, 3.0])
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_uniform_tension_passes_a_cone(cell, radius, degree):
    """Cylinders, or rings, with a conical interface that is pulled and sheared."""
    sigma, sizes = 25.0, {"lower_size": (2.0, 1.0), "upper_size": (2.0, 1.0)}
    scene = two_blocks(COMM, 2, cell, (4, 2), (3, 3), tilt=0.2, **sizes)
    scene = revolution.moved(scene, radius)
    height = scene.mesh.comm.allreduce(scene.mesh.geometry.x[:, 1].max(), op=MPI.MAX)

    def supports(V, scene):
        ends = [fix(V, scene, "bottom", 1), fix(V, scene, "top", 1, sigma / E * height)]
        return ends + ([revolution.on_axis(V, scene)] if radius == 0.0 else [])

    found = revolution.build(scene, degree, E=E, nu=NU, bcs=supports, kind=Tie)
    revolution.solve(found)
    X = found.u.function_space.tabulate_dof_coordinates()[:, :2]
    exact = sigma / E * X * [-NU, 1.0]
    assert worst(found.u.x.array.reshape(-1, 2) - exact) <= TOLERANCE
    # On the slave, whose normal points down
    area = np.pi * ((radius + 2.0) ** 2 - radius**2)
    force = found.contact.resultant().force
    assert force == pytest.approx([0.0, -sigma * area], rel=1e-9, abs=1e-9)


# J3: a cantilever


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("gap", [0.0, 0.06])
def test_a_cantilever_bent_to_a_quarter_circle(degree, gap):
    """What goes through the tie is in balance with both ends, in force and moment."""
    found = bent(degree, gap)
    force, moment = found.through
    for held in (found.wall, found.end):
        sign = np.sign(held[1] * moment)
        assert worst(held[0] - sign * force) <= 1e-10 * abs(moment)
        assert abs(held[1] - sign * moment) <= 1e-10 * abs(moment)
    if degree == 2 and gap == 0.0:
        # Of a slender beam: the ends are held across, and the strain is 0.08
        assert abs(moment) == pytest.approx(found.bending, rel=0.05)


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_a_tied_cantilever_is_as_stiff_as_a_glued_one(degree):
    """The moment errs as that of the coarser mesh glued, or less. Nodes that match are
    tied one to one, which glues; the other half has smaller cells here. A finer slave
    has multipliers that the master's edges cannot follow: it may take a quarter more.
    """
    coarse, fine = (8, 2), (11, 3)
    exact = bent(2, 0.0, divisions=((24, 8), (24, 8))).wall[1]
    glued, coarse_slave, fine_slave = (
        abs(bent(degree, 0.0, divisions=halves).wall[1] - exact)
        for halves in ((coarse, coarse), (fine, coarse), (coarse, fine))
    )
    assert coarse_slave <= glued
    assert fine_slave <= 1.25 * glued
