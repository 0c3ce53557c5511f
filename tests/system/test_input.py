"""Bad surfaces, meshes, displacements and conditions, through `Contact` and the problem:
an exception that says what is wrong.

The checks of single facets and spaces are tested in test_checks.
"""

import numpy as np
import pytest
from calls import PAIR, contact, refused, small_blocks
from dolfinx import fem
from dolfinx import mesh as dmesh
from problems import COMM, SOLVERS, build, fix, residual
from squeezing import squeezed

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Penalty
from raymortar.core import compat

pytestmark = [pytest.mark.quick, pytest.mark.mpi]


@pytest.fixture
def scene():
    return small_blocks()


# Tags and pairs


@pytest.mark.parametrize(
    "pairs, pattern",
    [
        (
            [(77, 4)],
            r"no facet has the slave tag 77; the tags that exist are \[1, 2, 3",
        ),
        ([(3, 77)], "no facet has the master tag 77"),
        ([], "pairs is empty"),
        ([(3, 3)], "tag 3 is slave and master of the same pair: split it into two"),
        ([(3, 4), (4, 3)], r"pair \(3, 4\) is given in both orders"),
        ([(4, 3), (3, 4)], r"pair \(4, 3\) is given in both orders"),
        ([3, 4], "pairs must be a list of"),
        ([(3, 4, 5)], "pairs must be a list of"),
        ([("a", "b")], "no facets are named .a.; known names: none"),
        (None, "pairs must be a list of"),
        # The upper block's left side shares a corner with its bottom
        ([(3, 9)], r"slave surface \(tag 3\) and .* \(tag 9\) share 1 vertex"),
    ],
)
def test_bad_pairs_are_refused(scene, pairs, pattern):
    with refused(pattern):
        contact(scene, pairs)


NAMES = {"lid": 3, "base": (1, 4), "side": 9, "lost": 77}


@pytest.mark.parametrize(
    "pairs, pattern",
    [
        ([("lost", "base")], r"no facet has the slave 'lost' \(tag 77\); the tags"),
        ([("lid", "lost")], r"no facet has the master 'lost' \(tag 77\)"),
        ([("lid", 3)], r"'lid' \(tag 3\) is slave and master of the same pair"),
        ([("lid", "base"), (4, 3)], r"pair \(lid, base\) is given in both orders"),
        ([("lid", "side")], r"slave surface 'lid' \(tag 3\) and .*'side' \(tag 9\)"),
    ],
)
def test_messages_have_the_names_that_are_known(scene, pairs, pattern):
    with refused(pattern):
        contact(scene, pairs, names=NAMES)


def test_warnings_have_them_too(scene):
    found = contact(scene, [("lid", "base")], names=NAMES, offset=-9.0)
    assert "of 9 on slave 'lid' (tag 3), more than" in found.offsets.excess
    with refused(r"offset is nan on slave 'lid' \(tag 3\)"):
        found.set_offset(lambda x: np.full(x.shape[1], np.nan))


def test_pair_given_twice_counts_once(scene):
    once, twice = (contact(scene, n * PAIR, method=Penalty(1.0)) for n in (1, 2))
    for c in (once, twice):
        c.update()
    assert len(twice.zones) == 1
    assert np.array_equal(once.points()["weight"], twice.points()["weight"])


def test_tags_of_cells_are_refused(scene):
    with refused("facet_tags are tags of entities of dimension 2"):
        contact(scene, tags=scene.cell_tags)


def test_empty_tags_are_refused(scene):
    none = np.empty(0, dtype=np.int32)
    with refused(r"no facet has the slave tag 3; the tags that exist are \[\]"):
        contact(scene, tags=compat.meshtags(scene.mesh, 1, none, none))


def test_things_that_are_no_tags_are_refused(scene):
    with refused("facet_tags must be MeshTags, not NoneType"):
        raymortar.Contact(fem.Function(compat.vector_space(scene.mesh, 1)), None, PAIR)
    with refused("facet_tags must be MeshTags, not ndarray"):
        contact(scene, tags=np.arange(3))


def test_interior_facets_are_refused(scene):
    # Interior facets of a conforming mesh, as of bodies that were glued by mistake
    inside = dmesh.locate_entities(scene.mesh, 1, lambda x: np.isclose(x[1], 0.5))
    tags = compat.meshtags(scene.mesh, 1, inside, np.full(len(inside), 3))
    with refused(r"slave tag 3 lie inside the body, .* at \(.*must not share nodes"):
        contact(scene, tags=tags)


# Spaces and meshes


@pytest.mark.parametrize(
    "family, degree, shape, pattern",
    [
        ("Lagrange", 3, (2,), "degree 3"),
        ("Lagrange", 1, (), r"values of shape \(\); contact needs vectors"),
        ("Lagrange", 1, (3,), r"values of shape \(3,\); contact needs vectors"),
        ("DG", 1, (2,), "discontinuous"),
        ("N1curl", 1, (), "Lagrange"),
    ],
)
def test_other_spaces_are_refused(scene, family, degree, shape, pattern):
    with refused(pattern):
        contact(scene, V=compat.space(scene.mesh, family, degree, shape))


def test_displacement_must_be_a_function(scene):
    V = compat.vector_space(scene.mesh, 1)
    with refused("u must be a Function"):
        raymortar.Contact(V, scene.facet_tags, PAIR)


def test_prisms_are_refused():
    mesh = dmesh.create_unit_cube(COMM, 1, 1, 1, dmesh.CellType.prism)
    V = compat.vector_space(mesh, 1)
    none = np.empty(0, dtype=np.int32)
    with refused("prism"):
        raymortar.Contact(fem.Function(V), compat.meshtags(mesh, 2, none, none), PAIR)


def test_facet_without_area_is_refused():
    # All nodes of the slave's last facet move onto its first
    mesh, cells, tags = assemble_blocks(
        COMM,
        [
            Block((2, 2), (0, 0), (1, 1), tags={"top": 4}),
            Block((2, 2), (0, 1), (1, 2), tags={"bottom": 3}),
        ],
        "quadrilateral",
    )
    x = mesh.geometry.x
    upper = x[:, 1] > 1.25
    first = np.isclose(x[:, 1], 1.0) & ~np.isclose(x[:, 0], 0.0)
    used = compat.geometry_dofmap(mesh)[cells.indices[cells.values == 2]]
    body = np.isin(np.arange(len(x)), used)
    x[body & first & ~upper, 0] = 0.5
    V = compat.vector_space(mesh, 1)
    with refused(r"facet\(s\) with tag 3 have no area, the first on cell \d+ at \("):
        raymortar.Contact(fem.Function(V), tags, PAIR)


@pytest.mark.parametrize("tag, place", [(3, (0.5, 1.5)), (4, (0.5, 0.5))])
def test_folded_cell_at_a_contact_facet_is_refused(tag, place):
    """Its facet on the surface is as it was; only a node inside has moved."""
    scene = two_blocks(COMM, 2, "quadrilateral", 2, 2)
    x = scene.mesh.geometry.x
    inside = np.all(np.isclose(x[:, :2], place), axis=1)
    x[inside, :2] = 0.1, 1.1 if tag == 3 else 0.9
    with refused(
        rf"facet\(s\) with tag {tag} are on cells with a fold.* cell \d+ at \("
    ):
        contact(scene)


def test_coordinates_that_are_not_finite_are_refused(scene):
    scene.mesh.geometry.x[:, 0] = np.nan
    with refused("coordinates not finite"):
        contact(scene)


# State


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_displacement_that_is_not_finite_is_refused(scene, value):
    c = contact(scene, method=Penalty(1.0))
    c.u.x.array[5:7] = value
    with refused("the displacement has 2 entries that are not finite"):
        c.update()
    c.u.x.array[:] = 0.0
    c.update()
    assert c.statistics.hits > 0


@pytest.mark.parametrize("solver", SOLVERS)
def test_solve_refuses_a_start_that_is_not_finite(scene, solver):
    problem = build(scene, bcs=squeezed)
    problem.solver = solver(problem.problem)
    problem.u.x.array[3] = np.nan
    with refused("the displacement has 1 entries that are not finite"):
        problem.solve()


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("solver", SOLVERS)
def test_conditions_that_are_not_finite_are_named(scene, solver, value):
    top = fem.Constant(scene.mesh, 0.0)
    problem = build(
        scene,
        # Held along x: where it is out of contact, rounding would decide where it goes
        bcs=lambda V, s: [
            fix(V, s, "bottom"),
            fix(V, s, "top", 1, top),
            fix(V, s, "top", 0),
        ],
    )
    problem.solver = solver(problem.problem)
    top.value = value
    with refused(rf"bcs\[1\] prescribes {value} at \d unknown"):
        problem.solve()
    top.value = -1e-3
    problem.solve()


def test_condition_on_another_space_is_refused(scene):
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    c = raymortar.Contact(u, scene.facet_tags, PAIR)
    foreign = fix(compat.vector_space(scene.mesh, 1), scene, "bottom")
    own = fix(u.function_space, scene, "top")
    with refused("boundary condition 1 is not on the space of the displacement"):
        raymortar.NonlinearProblem(residual(scene, u)[0], c, [own, foreign])


def test_bodies_out_of_reach_are_allowed():
    scene = two_blocks(COMM, 2, "triangle", 2, 2, gap=50.0)
    c = contact(scene, method=Penalty(1.0))
    c.update()
    assert c.statistics.hits == 0
    said = f"none of {c.statistics.points} slave points meets a master within reach"
    assert str(c.statistics) == said


def test_contact_between_prescribed_surfaces_is_refused(scene):
    """No traction can be found there, and no empty row is left to the direct solver."""

    def held(V, scene):
        return [fix(V, scene, ["slave", "master", "bottom"])]

    problem = build(scene, method=AugmentedLagrangian(), bcs=held).problem
    u = problem.contact.u
    A, x = problem.create_matrix(), problem.start()
    cells = scene.cell_tags.find(scene.bodies["upper"])
    upper = np.unique(compat.dofmap_array(u.function_space)[cells])

    def lift(height):
        u.x.array.reshape(-1, 2)[upper, 1] = height
        problem.contact.layout.to_vector(x, problem.contact.assembly.gamma_scale)
        problem.J(x, A)

    lift(0.1)  # open: the multiplier's own equation holds it at zero
    with refused(r"3 node\(s\) of the contact traction, .* prescribed on both sides"):
        lift(-0.1)
