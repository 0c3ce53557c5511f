"""The automatic coefficient: of the softer body that can move."""

import pytest
from dolfinx import fem
from materials import lame
from problems import COMM, DIMENSION, build, fix
from squeezing import squeezed

import raymortar
from meshes.scenes import two_blocks

SOFT, NU = 2000.0, 0.3
CELLS = (4, 3)  # of the lower and of the upper block, per direction


def gamma_of(cell, ratio=1.0, bcs=None, method=None, **options):
    """Coefficient of linear elastic unit blocks, the upper one `ratio` times stiffer."""
    scene = two_blocks(COMM, DIMENSION[cell], cell, *CELLS)
    E = {"lower": SOFT, "upper": ratio * SOFT}
    problem = build(scene, E=E, nu=NU, bcs=bcs, method=method, **options)
    return problem.contact.gamma


def of_a_cube(E, n, dim):
    """Diagonal of linear squares or cubes of size 1 / n at their face, over its area.

    A corner's shape function N has int N_x^2 = (1/3)^(d - 1) h^(d - 2) in each
    direction, and each corner of a face stands for one cell there.
    """
    mu, lmbda = lame(E, NU)
    diagonal = (lmbda + 2 * mu + (dim - 1) * mu) / 3.0 ** (dim - 1)
    return 2.0 ** (dim - 1) * diagonal * n


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
@pytest.mark.parametrize("ratio", [1e-3, 0.5, 1.0, 2.0, 1e3])
@pytest.mark.parametrize("swap", [False, True])
def test_coefficient_is_that_of_the_softer_body(cell, ratio, swap):
    dim = DIMENSION[cell]
    bodies = zip((SOFT, ratio * SOFT), CELLS)
    expected = min(of_a_cube(E, n, dim) for E, n in bodies)
    assert gamma_of(cell, ratio, swap=swap) == pytest.approx(expected, rel=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("swap", [False, True])
def test_body_that_is_prescribed_throughout_is_rigid(cell, swap):
    """Whatever stiffness it was given."""

    def held(V, scene):
        cells = scene.cell_tags.find(scene.bodies["upper"])
        dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim, cells)
        return [fem.dirichletbc(fem.Function(V), dofs), fix(V, scene, "bottom")]

    expected = gamma_of(cell, 1e3)
    assert gamma_of(cell, 1e-3, held, swap=swap) == pytest.approx(expected)


@pytest.mark.mpi
def test_penalty_takes_ten_times_as_much(cell):
    gamma = gamma_of(cell, method=raymortar.Penalty())
    assert gamma == pytest.approx(10.0 * gamma_of(cell))


@pytest.mark.mpi(where=lambda ratio, **_: ratio == 1.0)
@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
def test_automatic_penalty_is_off_by_some_percent(cell_2d, ratio):
    """Of the force, whichever body is the stiff one."""
    forces = []
    for method in (raymortar.AugmentedLagrangian(), raymortar.Penalty()):
        scene = two_blocks(COMM, 2, cell_2d, 10, 8, upper_size=(0.6, 0.6))
        E = {"lower": SOFT, "upper": ratio * SOFT}
        problem = build(
            scene, method=method, E=E, bcs=lambda V, scene: squeezed(V, scene, 0.05)
        )
        problem.solve()
        forces.append(problem.contact.resultant().force[-1])
    assert 0.001 < 1.0 - forces[1] / forces[0] < 0.025


@pytest.mark.parametrize("given", [True, False])
def test_a_given_penalty_needs_no_strains(given):
    method = raymortar.Penalty(1e4 if given else None)
    problem = build(two_blocks(COMM, 2), method=method, E=SOFT).problem
    volume = problem.contact.parts[0].volume
    assert (volume.response is None) == given
