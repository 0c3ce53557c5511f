"""The automatic coefficient measures shear: (5.2) without the bulk modulus."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from partitions import scattered
from problems import COMM, DIMENSION, build, cellwise, quadrature_degree

from meshes.scenes import two_blocks
from raymortar.core import compat
from raymortar.core.gamma.probing import (
    LARGEST_RATIO,
    deviators,
    stiffness_without_bulk,
    strain_response,
)

MU = 2.0


def rotation(dim):
    if dim == 2:
        return 0.7
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    W = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(0.7) * W + (1.0 - np.cos(0.7)) * W @ W


def blocks(cell, **options):
    dim = DIMENSION[cell]
    options = {"perturb": 0.2, "rotation": rotation(dim), **options}
    return two_blocks(COMM, dim, cell, 3, 2, **options)


def response(scene, degree, ratio, material="linear", start=None, extra=None, mu=MU):
    """Columns of `strain_response` with moduli mu and ratio mu (or by body)."""
    V = compat.vector_space(scene.mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    if start is not None:
        u.interpolate(start)
    ratio = ratio if isinstance(ratio, dict) else dict.fromkeys(scene.bodies, ratio)
    mu = mu if isinstance(mu, dict) else dict.fromkeys(scene.bodies, mu)
    m, lmbda = cellwise(scene, mu), cellwise(scene, {b: ratio[b] * mu[b] for b in mu})
    q = quadrature_degree(scene.mesh, degree)
    dx = ufl.Measure("dx", domain=scene.mesh, metadata={"quadrature_degree": q})
    F = ufl.inner(MATERIALS[material][0](ufl.grad(u), m, lmbda), ufl.grad(v)) * dx
    if extra is not None:
        F += extra(u, v)
    K = fem.petsc.assemble_matrix(
        compat.form(ufl.derivative(F, u, ufl.TrialFunction(V)))
    )
    K.assemble()
    found = strain_response(K, u)
    K.destroy()
    return V, found


def share(V, found, which=slice(None)):
    sums = COMM.allreduce(found[which].sum(axis=0))
    return stiffness_without_bulk(*sums, V.mesh.geometry.dim).min()


def expected(ratio, dim):
    return (min(ratio, LARGEST_RATIO) + dim + 1.0) / (ratio + dim + 1.0)


def test_deviators_are_an_orthonormal_basis():
    for d in (2, 3):
        E = np.array(deviators(d))
        assert len(E) == d * (d + 1) // 2 - 1
        assert np.allclose(np.einsum("aij,bij->ab", E, E), np.eye(len(E)))
        assert np.allclose(np.trace(E, axis1=1, axis2=2), 0.0)
        kappa = (d + 1) / 2 - 1 / d
        assert np.allclose(sum(e @ e for e in E), kappa * np.eye(d))


@pytest.mark.quick
@pytest.mark.mpi(where=lambda ratio, **_: ratio == 50.0)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("ratio", [0.0, 1.5, 50.0, 5e3])
def test_share_is_that_of_the_moduli(cell, degree, ratio):
    """Of one body, on rotated and distorted meshes, at any node but those inside."""
    V, found = response(blocks(cell), degree, ratio)
    assert share(V, found) == pytest.approx(expected(ratio, DIMENSION[cell]), rel=1e-6)


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.2, 0.3])
def test_share_is_exactly_one_up_to_a_poisson_ratio_of_three_tenths(cell, nu):
    mu, lmbda = lame(1e3, nu)
    for degree in (1, 2):
        V, found = response(blocks(cell), degree, lmbda / mu, mu=mu)
        assert share(V, found) == 1.0


@pytest.mark.mpi
@pytest.mark.parametrize("partition", [None, scattered])
def test_each_node_has_the_response_of_the_cells_around_it(cell, partition):
    """A soft incompressible body beside a hard one, on ranks without order."""
    scene = blocks(cell, partition=partition)
    ratio, mu = {"lower": 1e3, "upper": 0.5}, {"lower": 1.0, "upper": 1e6}
    V, found = response(scene, 1, ratio, mu=mu)
    tags = scene.cell_tags
    for body in mu:
        cells = tags.find(scene.bodies[body])
        dofs = np.unique(compat.dofmap_array(V)[cells])
        dofs = dofs[dofs < len(found)]
        wanted = expected(ratio[body], DIMENSION[cell])
        assert share(V, found, dofs) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("length", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("modulus", [1e-6, 1e12])
def test_share_has_no_unit(cell_3d, length, modulus):
    scene = blocks(cell_3d)
    scene.mesh.geometry.x[:] *= length
    V, found = response(scene, 1, 50.0, mu=modulus)
    assert share(V, found) == pytest.approx(expected(50.0, 3), rel=1e-6)


def test_place_does_not_matter(cell_2d):
    """A body far from the origin, and one that rests on springs."""
    scene = blocks(cell_2d)
    scene.mesh.geometry.x[:, 0] += 1e4
    V, found = response(scene, 1, 50.0)
    assert share(V, found) == pytest.approx(expected(50.0, 2), rel=1e-4)


@pytest.mark.parametrize("stiffness", [1e-3, 1.0, 1e3, 1e6])
def test_masses_and_springs_change_little_and_never_fail(cell, stiffness):
    """Weak ones nothing; strong ones are all there is, and do not grow with bulk."""

    def mass(u, v):
        return stiffness * ufl.inner(u, v) * ufl.dx(metadata={"quadrature_degree": 4})

    V, found = response(blocks(cell), 1, 50.0, extra=mass)
    one = share(V, found)
    few = expected(50.0, DIMENSION[cell])
    assert 0.5 * few < one <= 1.0
    if stiffness < 0.1:
        assert one == pytest.approx(few, rel=0.01)
    if stiffness > 1e5:
        assert one == 1.0


@pytest.mark.mpi(
    where=lambda stretch, material, **_: stretch > 1.0 and "neo" in material
)
@pytest.mark.parametrize("material", ["neo-hookean", "linear"])
@pytest.mark.parametrize("stretch", [0.7, 1.4])
def test_prestress_changes_the_share_little(cell, stretch, material):
    """What keeps the volume is other strains of the reference, in neo-Hookean bodies."""

    def start(x):
        values = np.zeros((DIMENSION[cell], x.shape[1]))
        values[0] = (stretch - 1.0) * x[0]
        values[1] = (1.0 / stretch - 1.0) * x[1]
        return values

    V, found = response(blocks(cell), 1, 50.0, material, start)
    few = expected(50.0, DIMENSION[cell])
    assert 0.5 * few < share(V, found) < 2.0 * few


@pytest.mark.parametrize(
    "sums", [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (np.nan, 1.0), (1e300, 1e-300)]
)
def test_what_is_no_elastic_response_counts_in_full(sums):
    assert stiffness_without_bulk(*np.array(sums), 3) == 1.0


def gamma_of(cell, nu, degree=1, **options):
    """With a shear modulus of 1."""
    scene = two_blocks(COMM, DIMENSION[cell], cell, 4, 3)
    return build(scene, degree, E=2.0 * (1.0 + nu), nu=nu, **options).contact.gamma


@pytest.mark.quick
@pytest.mark.mpi(where=lambda nu, **_: nu == 0.4999)
@pytest.mark.parametrize("nu", [0.49, 0.4999, 0.4999999])
def test_coefficient_stays_bounded_towards_incompressibility(cell, nu):
    """As that of Poisson's ratio 0.3, which has the ratio of 1.5."""
    for degree in (1, 2):
        bounded = gamma_of(cell, 0.3, degree)
        assert gamma_of(cell, nu, degree) == pytest.approx(bounded, rel=1e-4)


def test_plane_stress_is_hardly_different(cell_2d):
    """Lame's constant is then 2 mu at most."""
    V, found = response(blocks(cell_2d), 1, 2.0)
    assert share(V, found) == pytest.approx(4.5 / 5.0, rel=1e-9)
