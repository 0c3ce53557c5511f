"""Manufactured solutions: rates, both methods, both roles, on all cells.

Frictionless contact on a rigid curved master (validation problems B1 and B2) and of
two elastic bodies after a large slide (B4). Errors are relative. Friction has a file of
its own.
"""

import itertools

import gathered
import numpy as np
import pytest
import ufl
from manufactured import Manufactured, flux_error, rates, solve, value
from manufactured_fields import CUBE, SQUARE, TWO_CUBES, TWO_SQUARES, Motion
from manufactured_scenes import SLIDE, TAGS, on_rigid
from materials import MATERIALS

import raymortar
from raymortar.core import compat

REST = Motion()
ALL = {
    "square": SQUARE,
    "cube": CUBE,
    "two squares": TWO_SQUARES,
    "two cubes": TWO_CUBES,
}
MOTIONS = [
    REST,
    Motion((0.0, 0.0), (0.1, 0.05), 1.0, 1.0),
    Motion((0.1, 0.05), (0.1, 0.05), 1.5, 0.5),
]


def slide(fields):
    """The lower bodies are meshed for this one."""
    return Motion((0.0, 0.0), SLIDE[fields.dim] if fields.lower else (0.0, 0.0))


# Transcription


def position(dim):
    cell = "triangle" if dim == 2 else "tetrahedron"
    return ufl.SpatialCoordinate(on_rigid(cell, 1).mesh)


# Points, volume force there, and nominal stress
FORCES = [
    (SQUARE, (0.25, 0.5), [-0.0451713135, 0.1767672420]),
    (SQUARE, (0.8, 0.3), [0.0555345046, 0.0904657463]),
    (CUBE, (0.3, -0.2, 0.6), [-0.11346915, 0.01217143, 0.39901810]),
    (CUBE, (0.25, 0.25, 0.5), [-0.09016016, -0.09016016, 0.37486873]),
]
STRESSES = [
    (SQUARE, (0.25, 0.5), [[-0.03735724, 0.02644726], [0.02644726, -0.02898227]]),
    (
        CUBE,
        (0.3, -0.2, 0.6),
        [
            [-0.0058812, -0.00146383, -0.06478464],
            [-0.00054403, 0.02541006, 0.0340636],
            [-0.06508852, 0.03406635, -0.00119484],
        ],
    ),
]
PRESSURES = [
    (SQUARE, (0.5, 0.0), -0.0132602885),
    (SQUARE, (0.0, 0.0), -0.0285333205),
    (SQUARE, (0.25, 0.0), -0.0171386698),
    (CUBE, (0.0, 0.0, 0.0), -0.011784864),
    (CUBE, (0.5, 0.5, 0.0), -0.0122663824),
    (CUBE, (0.3, -0.2, 0.0), -0.0119122106),
]


@pytest.mark.parametrize("fields, point, force", FORCES)
def test_volume_force_is_that_of_the_table(fields, point, force):
    _, P, _ = fields.upper.exact(position(fields.dim), REST.s1)
    np.testing.assert_allclose(value(-ufl.div(P), point), force, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("fields, point, stress", STRESSES)
def test_stress_is_that_of_the_table(fields, point, stress):
    _, P, _ = fields.upper.exact(position(fields.dim), REST.s1)
    np.testing.assert_allclose(value(P, point), stress, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("fields, point, pressure", PRESSURES)
def test_pressure_is_that_of_the_table(fields, point, pressure):
    p, _, _ = fields.contact(position(fields.dim), REST)
    assert abs(value(p, point) - pressure) < 1e-9


def test_normal_and_force_of_the_cube_are_those_of_the_table():
    _, _, n = CUBE.contact(position(3), REST)
    np.testing.assert_allclose(
        value(n, (0.3, -0.2, 0.0)), [-0.11877114, 0.07918076, -0.98975948], atol=1e-8
    )
    x, w = np.polynomial.legendre.leggauss(8)
    X = np.array([(a / 2, b / 2, 0.0) for a in x for b in x])
    _, traction, _, _ = CUBE.contact_at(X, REST)
    force = np.outer(w, w).ravel() / 4.0 @ traction
    np.testing.assert_allclose(force, [0.0, 0.0, 0.0117915300], atol=1e-10)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("fields", [SQUARE, TWO_SQUARES], ids=["square", "fading"])
def test_values_are_those_of_the_forms(fields, motion):
    """Errors are measured against the first, loads are made of the second."""
    X, point = position(2), np.array([0.3, 0.0])
    u, P, F = fields.upper.exact(X, motion.s1, motion.c)
    expected = [value(f, point) for f in (*fields.contact(X, motion), u, F, P)]
    state = (point, motion.s1, motion.c)
    H = fields.upper.gradient(*state)
    found = [f[0] for f in fields.contact_at(point[None], motion)[:3]]
    found += [fields.upper.values(*state), H + np.eye(2)]
    found.append(MATERIALS["svk"][1](H, *fields.upper.moduli))
    for a, b in zip(found, expected):
        np.testing.assert_allclose(a, b, atol=1e-14)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("fields", ALL.values(), ids=ALL)
def test_fields_are_admissible(fields, motion):
    """Compressive everywhere and nowhere turned inside out; both surfaces coincide."""
    grid = np.linspace(0.0, 1.0, 11) - (0.0 if fields.dim == 2 else 0.5)
    lateral = np.array(list(itertools.product(grid, repeat=fields.dim - 1)))
    for height in (0.0, 0.5, 1.0):
        X = np.column_stack([lateral, np.full(len(lateral), height)])
        F = np.eye(fields.dim) + fields.upper.gradient(X, motion.s1, motion.c)
        assert np.linalg.det(F).min() > 0.5
    X[:, -1] = 0.0
    p, _, _, _ = fields.contact_at(X, motion)
    inside = np.all(np.abs(lateral - lateral.mean()) < 0.45, axis=1)
    assert p[inside].max() < -0.0015 and p.max() <= 0.0
    if fields.lower is not None:
        foot = 2.0 * X - fields.above(X, motion)
        x_upper = X + fields.upper.values(X, motion.s1, motion.c)
        x_lower = foot + fields.lower.values(foot, motion.s1)
        np.testing.assert_allclose(x_lower, x_upper, atol=1e-15)
        J = np.linalg.det(np.eye(fields.dim) + fields.lower.gradient(foot, motion.s1))
        assert J.min() > 0.7


@pytest.mark.mpi
def test_load_is_that_of_volume_and_surface_forces():
    """Dead loads -div P and P N, less the contact traction, do the load's work."""
    m = Manufactured(SQUARE, "quadrilateral", 4, 2)
    V, mesh = m.u.function_space, m.scene.mesh
    dx, ds = m._measures()
    v, X, N = ufl.TestFunction(V), ufl.SpatialCoordinate(mesh), ufl.FacetNormal(mesh)
    _, P, _ = SQUARE.upper.exact(X, REST.s1)
    _, traction, _ = SQUARE.contact(X, REST)
    forces = ufl.inner(-ufl.div(P), v) * dx(m.scene.bodies["upper"])
    for name in ("side", "top", "slave"):
        forces += ufl.inner(P * N, v) * ds(TAGS[name])
    forces -= ufl.inner(traction, v) * ds(TAGS["slave"])
    # Quadrature only: it is exact for the polynomials, and about so for the traction
    sums = []
    for form in (m.load, forces):
        b = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        compat.assemble_residual(b.array, compat.form(form))
        compat.scatter_reverse_add(b)
        sums.append(gathered.owned(V, b.array.reshape(-1, m.dim)))
    found, expected = sums
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


# Rates


def mean_rates(fields, cell, degree, levels, record, motion=REST, **options):
    """Orders of convergence between the first and the last mesh."""
    errors = [
        solve(fields, cell, n, degree, motion, **options).errors() for n in levels
    ]
    found = {name: float(np.mean(rate)) for name, rate in rates(errors).items()}
    record("errors", errors)
    record("rates", found)
    return found


def check(found, u, H, multiplier, bodies=("upper",)):
    for body in bodies:
        assert found[f"u_{body}"] >= u, found
        assert found[f"H_{body}"] >= H, found
    assert found["multiplier"] >= multiplier, found


SHAKES = [0.0, 0.2]
# Least rates of the multiplier. On triangles of degree 2 and on irregular meshes the
# stress in the bulk converges no faster: `test_multiplier_errs_as_the_flux_does`
PLANE = {
    ("quadrilateral", 1): (1.9, 0.95, 1.45),
    ("triangle", 1): (1.9, 0.95, 1.45),
    ("quadrilateral", 2): (2.9, 1.9, 2.4),
    ("triangle", 2): (2.9, 1.9, 1.75),
}


@pytest.mark.mpi(where=lambda kind, shake: kind == ("quadrilateral", 2) and not shake)
@pytest.mark.parametrize("shake", SHAKES)
@pytest.mark.parametrize("kind", PLANE)
def test_square_on_parabola(kind, shake, record_property):
    cell, degree = kind
    u, H, multiplier = PLANE[kind]
    levels = (4, 8, 16, 32)
    found = mean_rates(SQUARE, cell, degree, levels, record_property, shake=shake)
    check(found, u, H, 1.2 if shake and degree == 1 else multiplier)


@pytest.mark.parametrize("kind", PLANE)
def test_square_whose_contact_ends_at_held_nodes(kind, record_property):
    """Linear multipliers err by the variation of the pressure in the last facets."""
    cell, degree = kind
    found = mean_rates(SQUARE, cell, degree, (8, 16, 32), record_property, held=True)
    check(found, *PLANE[kind])


BODIES = ("upper", "lower")
# Cells, degree, meshes, shake, and least rates
SPACE = [
    ("hexahedron", 1, (4, 8), 0.0, (1.9, 0.95, 1.5)),
    ("tetrahedron", 1, (4, 8), 0.0, (1.9, 0.95, 1.5)),
    ("hexahedron", 1, (4, 8), 0.2, (1.9, 0.95, 1.0)),
    ("tetrahedron", 2, (2, 4), 0.0, (2.9, 1.8, 1.9)),
    ("hexahedron", 2, (2, 4), 0.0, (2.9, 1.9, 1.9)),
]


@pytest.mark.mpi(
    where=lambda cell, degree, shake, **_: (cell, degree) == ("hexahedron", 1)
    and not shake
)
@pytest.mark.parametrize("cell, degree, levels, shake, least", SPACE)
def test_cube_on_paraboloid(cell, degree, levels, shake, least, record_property):
    found = mean_rates(CUBE, cell, degree, levels, record_property, shake=shake)
    check(found, *least)


@pytest.mark.mpi(where=lambda kind, swap: kind == ("triangle", 2) and swap)
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("kind", PLANE)
def test_two_squares(kind, swap, record_property):
    cell, degree = kind
    u, H, multiplier = PLANE[kind]
    motion = slide(TWO_SQUARES)
    found = mean_rates(
        TWO_SQUARES, cell, degree, (8, 16, 32), record_property, motion, swap=swap
    )
    # Linear triangles get to second order slowly: 1.82, 1.86 on the next two meshes
    check(found, 1.65 if kind == ("triangle", 1) else u, H, multiplier, BODIES)


def test_two_cubes(record_property):
    """Coarser meshes of the lower body do not double evenly."""
    motion = slide(TWO_CUBES)
    found = mean_rates(TWO_CUBES, "hexahedron", 1, (4, 8), record_property, motion)
    check(found, 1.9, 0.95, 1.5, BODIES)


@pytest.mark.quick
@pytest.mark.mpi
def test_master_bent_by_its_displacement_is_that_of_its_geometry():
    """Degree 2 on a flat mesh: the same deformed surface, so the same answer."""
    curved, flat = (
        solve(SQUARE, "quadrilateral", 8, 2, curved=curved).errors()
        for curved in (True, False)
    )
    for name, error in curved.items():
        assert flat[name] == pytest.approx(error, rel=1e-6)


@pytest.mark.parametrize("shake", SHAKES)
@pytest.mark.parametrize("kind", PLANE)
def test_multiplier_errs_as_the_flux_does(kind, shake, record_property):
    """Contact adds no error to that of the bulk's stress, by which rates below those
    of the multiplier's own functions are explained."""
    cell, degree = kind
    problem = solve(SQUARE, cell, 16 // degree, degree, shake=shake)
    found, bulk = problem.errors()["multiplier"], flux_error(problem)
    record_property("errors", [found, bulk])
    assert found < 1.1 * bulk


NEWTON = [
    (SQUARE, "quadrilateral", 8, 2),
    (SQUARE, "triangle", 8, 1),
    (CUBE, "tetrahedron", 2, 2),
    (TWO_SQUARES, "quadrilateral", 8, 2),
]


@pytest.mark.mpi(where=lambda fields, **_: fields is TWO_SQUARES)
@pytest.mark.parametrize("fields, cell, n, degree", NEWTON)
def test_newton_is_quadratic(fields, cell, n, degree, record_property):
    """From another strain in the bulk; closed points stay what they are."""
    motion = slide(fields)
    m = solve(fields, cell, n, degree, motion)
    multiplier = m.contact.multiplier.x.array.copy()
    m.interpolate(motion.s1, 1.6)
    m.contact.multiplier.x.array[:] = multiplier
    assert m.solve() <= 8
    r = np.array(m.problem.history)
    record_property("residuals", r.tolist())
    # r_{k+1} = C r_k^2 with the same C, down to where rounding begins
    steps = [b / a**2 for a, b in zip(r[1:], r[2:]) if b > 1e-13]
    assert len(steps) >= 2
    assert steps[-1] < 3.0 * steps[-2]


# Penalty


@pytest.mark.mpi
def test_penalty_tends_to_the_augmented_lagrangian():
    """At first order in 1 / gamma, and so does its error until the mesh's is left."""
    reference = solve(SQUARE, "quadrilateral", 8, 2)
    apart, errors = [], []
    for gamma in (2e2, 2e3, 2e4):
        method = raymortar.Penalty(gamma)
        m = solve(SQUARE, "quadrilateral", 8, 2, method=method)
        V, change = m.u.function_space, m.u.x.array - reference.u.x.array
        apart.append(np.linalg.norm(gathered.owned(V, change.reshape(-1, m.dim))))
        errors.append(m.errors()["u_upper"])
    np.testing.assert_allclose(np.array(apart[:-1]) / apart[1:], 10.0, rtol=0.1)
    mesh = reference.errors()["u_upper"]
    # Both errors add up, in squares at best
    assert errors[0] / (errors[1] - mesh) > 9.0 > errors[0] / errors[1] > 7.0
    assert errors[2] < 1.2 * mesh


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_penalty_has_the_rates_of_the_displacement(cell, record_property):
    """A coefficient that grows with the mesh's fineness squared keeps second order."""
    errors = []
    for n in (4, 8, 16):
        method = raymortar.Penalty(50.0 * n**2)
        errors.append(solve(SQUARE, cell, n, 1, method=method).errors())
    found = rates(errors)
    record_property("rates", found)
    assert np.mean(found["u_upper"]) > 1.9 and np.mean(found["H_upper"]) > 0.95


@pytest.mark.mpi(where=lambda multiplier: multiplier == "vector")
@pytest.mark.parametrize("multiplier", ["normal", "vector"])
def test_current_measure_has_the_cauchy_pressure(multiplier, record_property):
    method = raymortar.AugmentedLagrangian(multiplier=multiplier)
    found = mean_rates(
        SQUARE,
        "quadrilateral",
        2,
        (8, 16),
        record_property,
        method=method,
        measure="current",
    )
    check(found, 2.9, 1.9, 2.4)
