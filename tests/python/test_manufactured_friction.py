"""Manufactured friction on a rigid curved master, exact for the slip of one step.

The gap is zero and the master rests, so the slip increment is the chord between two
states that are chosen in closed form, whatever the step. The traction on the slave
is chosen on the friction cone, and a dead load makes up for what the stress of the
exact field does not carry: lambda is exact for every augmentation coefficient.

The master is curved by its geometry of degree 2, which holds a parabola exactly, and
all its displacements are prescribed.
"""

import dataclasses
import itertools
from collections.abc import Callable

import numpy as np
import pytest
import ufl
from dolfinx import fem

import raymortar
from raymortar import compat
from raymortar.blocks import Block
from raymortar.meshing import Scene, assemble_blocks

from problems import COMM, fix, lame

MU, GUESS = 0.3, 0.015
TAGS = {"top": 1, "slave": 2, "side": 3, "master": 4}


# Exact states: displacement over X at a slide s, its strain scaled by c in the bulk.
# The trace on the contact face does not depend on c. For UFL and for NumPy alike.


def square_on_parabola(X, s, c=1.0):
    """Slides along y = -0.05 (x - 1/2)^2."""
    x, y = X[0], X[1]
    return [
        s[0] - 0.2 * c * y**3 * (x - 0.5),
        -0.05 * (x + s[0] - 0.5) ** 2 * (1.0 + y) - 0.01 * y,
    ]


def cube_on_paraboloid(X, s, c=1.0):
    """Slides along z = -0.5 - 0.2 (x^2 + y^2)."""
    x, y, z = X[0], X[1], X[2]
    bulge = 0.2 * c * z**2 * x * y
    sag = 1.0 + (x + s[0]) ** 2 + (y + s[1]) ** 2
    return [
        s[0] + bulge,
        s[1] + bulge,
        -0.2 * sag * (1.0 + 0.01 * z) - 0.01 * z - 0.3,
    ]


def square_scene(cell, n):
    """Unit square with n cells along the contact, on a strip of other nodes."""
    sides = dict.fromkeys(("left", "right"), TAGS["side"])
    sides |= {"top": TAGS["top"], "bottom": TAGS["slave"]}
    slave = Block((n, n), (0.0, 0.0), (1.0, 1.0), tags=sides)

    def bent(x):
        parabola = -0.05 * (x[:, 0] - 0.5) ** 2
        return np.column_stack([x[:, 0], x[:, 1] + parabola])

    tags = {"top": TAGS["master"]}
    strip = Block((n + 3, 1), (-0.5, -0.4), (1.5, 0.0), mapping=bent, tags=tags)
    return _scene(cell, strip, slave)


def cube_scene(cell, n):
    """Unit cube with n x n facets in contact, on a slab of other nodes."""
    sides = dict.fromkeys(("left", "right", "front", "back"), TAGS["side"])
    sides |= {"top": TAGS["top"], "bottom": TAGS["slave"]}
    slave = Block((n, n, n), (-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), tags=sides)

    def bent(x):
        paraboloid = -0.5 - 0.2 * (x[:, :2] ** 2).sum(axis=1)
        return np.column_stack([x[:, :2], x[:, 2] + paraboloid])

    tags = {"top": TAGS["master"]}
    lower, upper = (-1.0, -1.0, -0.4), (1.0, 1.0, 0.0)
    slab = Block((n + 1, n + 1, 1), lower, upper, mapping=bent, tags=tags)
    return _scene(cell, slab, slave)


def _scene(cell, master, slave):
    mesh, cells, facets = assemble_blocks(COMM, [master, slave], cell, 2)
    return Scene(mesh, cells, facets, TAGS)


@dataclasses.dataclass(frozen=True)
class Case:
    """An exact field, its material (Saint Venant-Kirchhoff) and its meshes."""

    dim: int
    field: Callable
    scene: Callable
    nu: float
    normal: tuple
    # Of a tangent that turns with the surface, for the traction in stick
    along: tuple

    def exact(self, X, s, c):
        """Displacement, its stress and deformation gradient, in UFL."""
        u = ufl.as_vector(self.field(X, s, c))
        F = ufl.Identity(self.dim) + ufl.grad(u)
        E = (F.T * F - ufl.Identity(self.dim)) / 2
        mu, lmbda = lame(1.0, self.nu)
        return u, F * (2 * mu * E + lmbda * ufl.tr(E) * ufl.Identity(self.dim)), F

    def contact(self, X, s0, s1, c, share):
        """Pressure (negative) and traction on the contact face, in UFL.

        In slip against the chord from s0 to s1; without one, a share of the cone.
        """
        u, P, F = self.exact(X, s1, c)
        N = ufl.as_vector(self.normal)
        n = ufl.inv(F).T * N
        n = n / ufl.sqrt(ufl.inner(n, n))
        p = ufl.inner(P * N, n)
        if s0 == s1:
            t = F * ufl.as_vector(self.along)
        else:
            t = u - ufl.as_vector(self.field(X, s0, c))
        t = t - ufl.inner(t, n) * n
        return p, p * n + share * MU * p * t / ufl.sqrt(ufl.inner(t, t)), n


SQUARE = Case(2, square_on_parabola, square_scene, 0.3, (0.0, -1.0), (1.0, 0.0))
CUBE = Case(3, cube_on_paraboloid, cube_scene, 0.0, (0.0, 0.0, -1.0), (1.0, 0.5, 0.0))


# Transcription


def value(expression, point):
    """A UFL expression of the position at a point, as an array."""
    shape = expression.ufl_shape
    entries = [
        expression[index](tuple(point)) if index else expression(tuple(point))
        for index in np.ndindex(*shape)
    ]
    return np.array(entries).reshape(shape)


def position(case):
    cell = "triangle" if case.dim == 2 else "tetrahedron"
    return ufl.SpatialCoordinate(case.scene(cell, 1).mesh)


def test_square_is_that_of_the_table():
    X = position(SQUARE)
    _, P, _ = SQUARE.exact(X, (0.0,), 1.0)
    force = -ufl.div(P)
    close = {"atol": 1e-9, "rtol": 0.0}
    np.testing.assert_allclose(
        value(force, (0.25, 0.5)), [-0.0451713135, 0.1767672420], **close
    )
    np.testing.assert_allclose(
        value(force, (0.8, 0.3)), [0.0555345046, 0.0904657463], **close
    )
    p, _, _ = SQUARE.contact(X, (0.0,), (0.0,), 1.0, 0.5)
    for x, pressure in (
        (0.5, -0.0132602885),
        (0.0, -0.0285333205),
        (0.25, -0.0171386698),
    ):
        assert abs(value(p, (x, 0.0)) - pressure) < 1e-9
    p, traction, n = SQUARE.contact(X, (0.0,), (0.1,), 1.0, 1.0)
    close["atol"] = 1e-8
    np.testing.assert_allclose(value(n, (0.0, 0.0)), [0.03996804, -0.99920096], **close)
    assert abs(value(p, (0.0, 0.0)) + 0.0231087535) < 1e-9
    np.testing.assert_allclose(
        value(traction, (0.0, 0.0)), [-0.0078507, 0.02281321], **close
    )
    np.testing.assert_allclose(
        value(traction, (1.0, 0.0)), [-0.00839728, 0.03561846], **close
    )


def test_cube_is_that_of_the_table():
    X = position(CUBE)
    _, P, _ = CUBE.exact(X, (0.0, 0.0), 1.0)
    np.testing.assert_allclose(
        value(-ufl.div(P), (0.3, -0.2, 0.6)),
        [-0.11346915, 0.01217143, 0.39901810],
        atol=1e-8,
    )
    p, _, n = CUBE.contact(X, (0.0, 0.0), (0.0, 0.0), 1.0, 0.5)
    for point, pressure in (
        ((0.0, 0.0), -0.011784864),
        ((0.5, 0.5), -0.0122663824),
        ((0.3, -0.2), -0.0119122106),
    ):
        assert abs(value(p, (*point, 0.0)) - pressure) < 1e-9
    np.testing.assert_allclose(
        value(n, (0.3, -0.2, 0.0)), [-0.11877114, 0.07918076, -0.98975948], atol=1e-8
    )


# Rates


def solve(case, cell, degree, n, s0, s1, c=1.0, share=1.0, gamma=None):
    """Errors in L2 of displacement and multiplier, and the contact.

    The step is from the exact state at the slide s0 to the one at s1. Newton's method
    starts from the interpolated displacement: this is about what is found, not how.
    """
    scene = case.scene(cell, n)
    mesh, dim = scene.mesh, case.dim
    V = compat.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    X = ufl.SpatialCoordinate(mesh)
    exact, stress, _ = case.exact(X, s1, c)
    _, traction, _ = case.contact(X, s0, s1, c, share)
    metadata = {"quadrature_degree": 6}
    dx = ufl.Measure("dx", mesh, subdomain_data=scene.cell_tags, metadata=metadata)
    ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags, metadata=metadata)
    mu, lmbda = lame(1.0, case.nu)
    F = ufl.Identity(dim) + ufl.grad(u)
    E = (F.T * F - ufl.Identity(dim)) / 2
    P = F * (2 * mu * E + lmbda * ufl.tr(E) * ufl.Identity(dim))
    N = ufl.FacetNormal(mesh)
    L = ufl.inner(P, ufl.grad(v)) * dx
    L -= ufl.inner(-ufl.div(stress), v) * dx(2)
    L -= ufl.inner(stress * N, v) * ds(TAGS["side"])
    L -= ufl.inner(stress * N - traction, v) * ds(TAGS["slave"])

    def at(s, c):
        return lambda x: np.column_stack(case.field(x.T, s, c))

    rest = fem.Function(V)
    dofs = fem.locate_dofs_topological(V, dim, scene.cell_tags.find(1))
    bcs = [fem.dirichletbc(rest, dofs), fix(V, scene, "top", value=at(s1, c))]

    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(TAGS["slave"], TAGS["master"])],
        raymortar.AugmentedLagrangian(gamma),
        raymortar.Coulomb(MU),
    )
    u.interpolate(lambda x: at(s0, 1.0)(x[:dim].T).T)
    u.x.array.reshape(-1, dim)[dofs] = 0.0
    contact.advance()
    u.interpolate(lambda x: at(s1, c)(x[:dim].T).T)
    u.x.array.reshape(-1, dim)[dofs] = 0.0
    # A guess of the pressure: without any, friction has no cone at first, and
    # quadratic stick then needs a hundredth of the automatic gamma to converge
    lam = contact.multiplier.x.array.reshape(-1, dim)
    lam[contact.zones[0].multiplier_nodes, -1] = GUESS
    problem = raymortar.NonlinearProblem(L, contact, bcs)
    raymortar.NewtonSolver(problem).solve()

    def norm(form):
        return np.sqrt(COMM.allreduce(fem.assemble_scalar(compat.form(form))))

    e, d = u - exact, contact.multiplier - traction
    errors = norm(ufl.inner(e, e) * dx(2)), norm(ufl.inner(d, d) * ds(TAGS["slave"]))
    return np.array(errors), contact


MOTIONS = {
    # From the slide s0 to s1, scale of the strain in the bulk, share of the cone
    "slip": ((0.0, 0.0), (0.1, 0.05), 1.0, 1.0),
    "stick": ((0.1, 0.05), (0.1, 0.05), 1.5, 0.5),
}
# Least rates of displacement and multiplier in L2. The theory of the multiplier is
# 1.5; meshes of quadrilaterals do better with degree 2, as code_aster's do
PLANE = [
    ("triangle", 1, 1.9, 1.45),
    ("quadrilateral", 1, 1.9, 1.45),
    ("triangle", 2, 2.9, 1.5),
    ("quadrilateral", 2, 2.9, 2.4),
]
# The cube's field is one of hexahedra of degree 2, which would show no rate
SPACE = [
    ("hexahedron", 1, "slip", (2, 4, 8), 1.9, 1.5),
    ("tetrahedron", 1, "slip", (2, 4, 8), 1.9, 1.5),
    ("tetrahedron", 2, "slip", (2, 4), 2.5, 1.5),
    ("tetrahedron", 2, "stick", (2, 4), 2.5, 1.5),
]


def check_rates(case, cell, degree, motion, levels, u_rate, lam_rate, record):
    expected = {"stick": 2, "slip": 3}[motion]
    errors = []
    for n in levels:
        error, contact = solve(case, cell, degree, n, *MOTIONS[motion])
        errors.append(error)
    # Errors may let single points of coarse meshes slip, or open
    assert np.mean(contact.points()["status"] == expected) > 0.9
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    record("errors", np.array(errors).tolist())
    record("rates", rates.tolist())
    assert rates[-1, 0] >= u_rate
    assert rates[-1, 1] >= lam_rate


@pytest.mark.parametrize("case", [SQUARE, CUBE], ids=["square", "cube"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_field_is_admissible(case, motion):
    X = position(case)
    s0, s1, c, share = MOTIONS[motion]
    p, _, _ = case.contact(X, s0, s1, c, share)
    _, _, F = case.exact(X, s1, c)
    lower = 0.0 if case.dim == 2 else -0.5
    ends = (lower, lower + 0.5, lower + 1.0)
    for point in itertools.product(ends, repeat=case.dim - 1):
        assert value(p, (*point, 0.0)) < 0.0
        assert value(ufl.det(F), (*point, 1.0)) > 0.0
        assert value(ufl.det(F), (*point, 0.0)) > 0.0


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("cell, degree, u_rate, lam_rate", PLANE)
def test_rates_in_the_plane(cell, degree, u_rate, lam_rate, motion, record_property):
    check_rates(
        SQUARE, cell, degree, motion, (4, 8, 16), u_rate, lam_rate, record_property
    )


@pytest.mark.parametrize("cell, degree, motion, levels, u_rate, lam_rate", SPACE)
def test_rates_in_space(
    cell, degree, motion, levels, u_rate, lam_rate, record_property
):
    check_rates(CUBE, cell, degree, motion, levels, u_rate, lam_rate, record_property)


def test_solution_hardly_depends_on_gamma():
    motion = MOTIONS["slip"]
    reference, contact = solve(SQUARE, "quadrilateral", 2, 8, *motion)
    for factor in (0.1, 10.0):
        gamma = factor * contact.gamma
        error, _ = solve(SQUARE, "quadrilateral", 2, 8, *motion, gamma=gamma)
        np.testing.assert_allclose(error, reference, rtol=0.05)


def test_degree_2_holds_the_cube():
    """Only the linear multiplier errs on hexahedra of degree 2."""
    error, _ = solve(CUBE, "hexahedron", 2, 2, *MOTIONS["slip"])
    assert error[0] < 1e-6 and error[1] < 1e-5
