"""Ties: exact states, large rotations, gaps, cross points, rates, other kinds of mesh."""

from __future__ import annotations

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import pytest
import revolution
import ufl
from dolfinx import fem
from interacting import LOWER, UPPER, table, three
from problems import CELLS, COMM, DIMENSION, Problem, fix, residual, tolerate, worst
from states import rough_field
from tying import (
    AROUND,
    NU,
    E,
    bent,
    build,
    four_blocks,
    linear,
    outer,
    rotation,
    strain_of,
    stress_of,
)
from uncovered import boundary_of, load_of_the_rest

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    ContactError,
    ContactWarning,
    Coulomb,
    NonlinearProblem,
    Penalty,
    Search,
    SNESSolver,
    Tie,
    compat,
    rigid,
    solvers,
)
from raymortar.host.reference_facets import shape_functions

TOLERANCE = 1e-10


# J1: any uniform stress passes through flat interfaces


def errors(problem, normal=None):
    """Of the gradient of the displacement, and of the multiplier over the stress."""
    H = strain_of(problem.dim)
    found = [worst(problem.gradient() - H) / np.linalg.norm(H)]
    if normal is not None:
        lam, S = problem.slave_multiplier(), stress_of(H)
        found.append(worst(lam - S @ normal) / np.linalg.norm(S))
    return max(found)


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


# Cross points

# Of `AROUND`, undeformed: axis and sign of the slaves' normals
NORMALS = ((0, 1.0), (-1, 1.0), (-1, 1.0), (0, -1.0))


def pulled_around(cell, divisions):
    """Four blocks, each tied to two others, under a uniform stress; the problem."""
    scene = four_blocks(cell, divisions)
    inner = {name for pair in AROUND for name in pair}
    held = ["bottom_0", "bottom_1", "left_0"]
    problem = build(
        scene,
        pairs=AROUND,
        ties=4,
        bcs=lambda V, scene: linear(V, scene, *held),
        loaded=[n for n in outer(scene, *inner) if n not in held],
        load=stress_of(strain_of(DIMENSION[cell])),
    )
    problem.solve(rtol=1e-13)
    return problem


@pytest.mark.mpi
@pytest.mark.parametrize("matching", [False, True])
@pytest.mark.parametrize("cell", CELLS)
def test_four_blocks_around_a_cross_point(cell, matching):
    """The ties ask more of the common node than it can give: three conditions imply the
    fourth. Undamped, the multipliers of matching blocks would be anything."""
    dim = DIMENSION[cell]
    divisions = (2,) * 4 if matching else (3, 4, 5, 2) if dim == 2 else (2, 3, 1, 2)
    problem = pulled_around(cell, divisions)
    assert errors(problem) <= TOLERANCE
    S = stress_of(strain_of(dim))
    for tie, (axis, sign) in zip(problem.problem.contact.contacts, NORMALS):
        exact = sign * S[:, axis]
        assert worst(tie.points()["traction"] - exact) <= 1e-8 * np.linalg.norm(S)


@pytest.mark.parametrize("degree", [1, 2])
def test_the_matrix_is_regular_at_a_cross_point(degree, monkeypatch):
    """It has two zeros where cross points are not seen: one for each component."""

    def least():
        problem = build(
            four_blocks("quadrilateral", (2,) * 4),
            degree,
            pairs=AROUND,
            ties=4,
            bcs=lambda V, scene: linear(V, scene, "bottom_0"),
        )
        problem.solve(SNESSolver)
        A = gathered.dense(problem.solver.snes.getJacobian()[0])
        values = np.linalg.svd(A, compute_uv=False)
        return values[-3:] / values[0]

    assert least()[-1] > 1e-6
    monkeypatch.setattr(
        raymortar.tie,
        "crossing",
        lambda tie, _: [
            np.zeros(len(zone.facets.slave_surface.dofs), np.int8) for zone in tie.zones
        ],
    )
    found = least()
    assert found[0] > 1e-6 and found[1] < 1e-14


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_a_tie_that_ends_at_contact(cell):
    """Two columns of two blocks each: tied to each other, and in contact across."""
    dim = DIMENSION[cell]
    scene = four_blocks(cell, (2, 3, 3, 2))
    ties, contacts = AROUND[::3], AROUND[1:3]
    S = np.zeros((dim, dim))
    S[-1, -1] = -100.0
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    trace = np.trace(S) / (2.0 * mu + dim * lmbda)
    H = (S - lmbda * trace * np.eye(dim)) / (2.0 * mu)
    sides = {"bottom_0": dim - 1, "bottom_1": dim - 1, "left_0": 0, "left_2": 0}
    sides |= {f"front_{k}": 1 for k in range(4)} if dim == 3 else {}

    def bcs(V, scene):
        return [
            fix(V, scene, name, i, lambda x, i=i: H[i, i] * x[:, i])
            for name, i in sides.items()
        ]

    problem = build(
        scene,
        pairs=ties,
        bcs=bcs,
        loaded=["top_2", "top_3"],
        load=S,
        others=lambda u: [
            raymortar.Contact(u, scene.facet_tags, [(scene.tags[a], scene.tags[b])])
            for a, b in contacts
        ],
    )
    problem.solve(rtol=1e-13)
    assert worst(problem.gradient() - H) <= TOLERANCE
    tie, *rest = problem.problem.contact.contacts
    for zone in (0, 1):
        assert worst(tie.points(zone)["traction"]) <= 1e-7
    for contact in rest:
        points = contact.points()
        assert worst(points["pressure"] + 100.0) <= 1e-6


@pytest.mark.mpi
def test_corners_of_one_multiplier_are_told_of():
    scene = four_blocks("quadrilateral")
    with pytest.warns(ContactWarning, match="turns by more than 60 degrees at 1 node"):
        build(scene, pairs=AROUND[:2])


# J3, J4: large rotations, with gaps


def turned(problem, Q):
    """Displacement of a rotation, at this rank's nodes."""
    X = problem.u.function_space.tabulate_dof_coordinates()[:, : len(Q)]
    return X @ (Q - np.eye(len(Q))).T


def with_gap(cell, degree=1, gap=0.1, **options):
    """Blocks with a gap between them, and one that is curved."""
    dim = DIMENSION[cell]
    scene = two_blocks(COMM, dim, cell, 3, 2, gap=gap)
    return build(scene, degree, "neo-hookean", **options)


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


# Several masters, tags and meshes


@pytest.mark.mpi
def test_several_masters_have_resultants_of_their_own():
    """A slab on two blocks, tied to both: forces by pair, and their balance."""
    slab = table(gap=0.0)
    scene = slab.scene
    problem = build(
        scene,
        pairs=[("bottom_2", "top_0"), ("bottom_2", "top_1")],
        bcs=lambda V, scene: [
            fix(V, scene, ["bottom_0", "bottom_1"]),
            fix(V, scene, "top_2", 1, 0.01),
            fix(V, scene, "top_2", 0, 0.02),
        ],
    )
    problem.solve(rtol=1e-12)
    contact = problem.contact
    parts = [
        contact.resultant(scene.tags["bottom_2"], scene.tags[m]).force
        for m in ("top_0", "top_1")
    ]
    whole = contact.resultant().force
    assert sum(parts) == pytest.approx(whole, rel=1e-12)
    for part in parts:
        assert part[0] < -0.01 * E * 0.1 and part[1] < 0.0


@pytest.mark.mpi
@pytest.mark.parametrize(
    "method", [None, Penalty(500.0)], ids=["multiplier", "penalty"]
)
def test_bodies_on_meshes_of_their_own(method):
    options = {"kind": Tie, "method": method}
    found = hosts.apart(hosts.meshes(), **options)
    one = hosts.together(**options)
    for case in (found, one):
        case.push(0.1, 0.2)
        SNESSolver(case.problem).solve()
    forces = [case.contact.resultant(0).force for case in (found, one)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)
    assert forces[0][1] < 0.0 and forces[0][0] < 0.0
    u = hosts.by_place(*(d.given for d in found.contact.host.displacements))
    assert worst(u - hosts.by_place(*one.functions)) <= 1e-10


@pytest.mark.mpi
@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("cells", [("triangle", "quadrilateral")])
def test_facets_of_other_kinds(cells, mixed):
    """Blocks on rollers stretch without any stress across: u is linear."""
    degree = 2 if mixed else (1, 2)
    found = hosts.apart(
        hosts.meshes(cells, widths=(1.0, 1.0)),
        mixed=mixed,
        degree=degree,
        rollers=True,
        kind=Tie,
    )
    found.push(0.0, 0.2)
    solver = SNESSolver(found.problem)
    solver.solve()
    tie = found.contact
    points = tie.points()
    assert worst(points["traction"][:, 0]) <= 1e-8
    uniform = points["traction"][:, 1]
    force = tie.resultant().force[1]
    assert force < 0.0 and worst(uniform - force) <= 1e-8 * abs(force)


@pytest.mark.mpi
def test_a_tie_and_contact_in_one_problem():
    """Three blocks: the upper ones are tied, and slide as one on the lowest."""
    tied = three()
    slave, master = (tied.scene.tags[name] for name in UPPER)
    glue = Tie(tied.u, tied.scene.facet_tags, [(slave, master)], partial=True)
    contact = tied.contact(LOWER, friction=Coulomb(0.2))
    path = tied.path([contact, glue], 4)
    path.run()
    assert path.halvings == 0
    # Both interfaces carry the same force, by the columns of the history
    below, above = (path.history.vectors(f"force_{k}")[-1] for k in (0, 1))
    assert above == pytest.approx(below, rel=1e-8)
    held = path.history.vectors("reaction_held")[-1]
    assert held == pytest.approx(below, rel=1e-8)
    assert below[1] > 0.0
    # A tie has no history: it comes back
    problem = path.solver.problem
    state = problem.contact.state()
    force = glue.resultant().force
    tied.u.x.array[:] = 0.0
    problem.contact.update()
    problem.contact.restore(state)
    assert glue.resultant().force == pytest.approx(force, rel=1e-12)
    names = [f.name for f in glue.fields()]
    assert {"gap", "normal_traction", "multiplier"} <= set(names)


@pytest.mark.mpi
@pytest.mark.parametrize("method", [None, Penalty(2e3)], ids=["multiplier", "penalty"])
def test_iterative_solvers_give_the_direct_ones_answer(method):
    scene = two_blocks(COMM, 3, "hexahedron", 4, 3)
    problem = build(
        scene,
        method=method,
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(
                V, scene, "top", value=lambda x: np.tile((0.01, 0.0, 0.02), (len(x), 1))
            ),
        ],
    )
    found = []
    for options in (None, solvers.iterative("gamg")):
        problem.u.x.array[:] = 0.0
        solver = SNESSolver(problem.problem, options)
        tolerate(solver, rtol=1e-12)
        solver.solve()
        found.append(problem.u.x.array.copy())
    assert worst(found[1] - found[0]) <= 1e-8 * worst(found[0])


@pytest.mark.mpi
def test_nothing_is_done_twice():
    """One pairing, one halo, no lookups but the first, whatever the iterations."""
    problem = with_gap(
        "quadrilateral",
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", value=lambda x: np.tile((1.0, 0.5), (len(x), 1))),
        ],
    )
    assert problem.solve(rtol=1e-10) > 2
    statistics = problem.contact.statistics
    ranks = sum(COMM.allgather(bool(len(problem.contact.zones[0].multiplier_table))))
    assert ranks <= statistics.pairings <= COMM.size
    assert statistics.halo_builds == COMM.size
    assert statistics.preallocations == 1
    assert statistics.lookups == statistics.pairs


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


# Bad input


def made(scene=None, degree=1, **options):
    """A tie of two blocks."""
    scene = two_blocks(COMM, 2, "triangle") if scene is None else scene
    u = fem.Function(compat.vector_space(scene.mesh, degree))
    pairs = options.pop("pairs", [(scene.tags["slave"], scene.tags["master"])])
    return Tie(u, scene.facet_tags, pairs, **options)


BAD = {
    "a Tie takes no friction": {"friction": Coulomb(0.3)},
    "a Tie takes no offset": {"offset": 0.1},
    "a Tie takes no measure": {"measure": "current"},
    "a Tie takes no tangent": {"tangent": "fixed"},
    "adjust must be 'keep' or 'close', not 'open'": {"adjust": "open"},
    "partial = 1 must be True or False": {"partial": 1},
    "the multiplier of a Tie is a vector": {
        "method": AugmentedLagrangian(multiplier="normal")
    },
    "method must be AugmentedLagrangian or Penalty": {"method": "glue"},
    "no facets|tag 99": {"pairs": [(99, 4)]},
    "is slave and master of the same pair": {"pairs": [(3, 3)]},
    "a Tie takes no rigid body as a master": {
        "pairs": [(3, rigid.Line((0.0, 0.9), (0.0, 1.0)))]
    },
}


@pytest.mark.mpi
@pytest.mark.parametrize("message", BAD)
def test_bad_options_are_told(message):
    with pytest.raises(ContactError, match=message):
        made(**BAD[message])


def test_an_unknown_argument_is_told():
    with pytest.raises(TypeError, match="no argument 'glue'"):
        made(glue=1)


@pytest.mark.mpi
def test_nodes_without_a_master_are_listed():
    """The slave is 2 wide on a master of 1: of 9 nodes 4 have none, at the rim half of
    what two stand for is covered."""
    scene = two_blocks(COMM, 2, "triangle", 3, (8, 3), upper_size=(2.0, 1.0))
    with pytest.raises(ContactError) as caught:
        made(scene)
    text = str(caught.value)
    assert "4 of 9 slave nodes of tag 3 have no master" in text
    assert "(-0.5, 1): 0, (-0.25, 1): 0, (1.25, 1): 0, (1.5, 1): 0. Move" in text
    made(scene, partial=True)


@pytest.mark.mpi
def test_surfaces_out_of_reach_are_told():
    scene = two_blocks(COMM, 2, "triangle", gap=0.3)
    search = Search(reach=0.2)
    for partial in (False, True):
        with pytest.raises(ContactError, match="6 of 6 slave nodes .* larger Search"):
            made(scene, search=search, partial=partial)
    tie = made(scene, search=Search(reach=0.4))
    for call in (lambda: tie.set_offset(0.1), lambda: tie.adjust(0.1)):
        with pytest.raises(ContactError, match="a Tie"):
            call()
