"""Public helpers for spaces, conditions, fields by body and integrals."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM

from meshes import scenes
from raymortar import ContactError, tools
from raymortar.core import compat

pytestmark = pytest.mark.mpi


@pytest.fixture(scope="module")
def scene():
    return scenes.two_blocks(COMM, 2, "triangle")


def values_on(field, facets):
    """Values (n, components) of a field at the nodes of facets of this rank."""
    V = field.function_space
    dofs = fem.locate_dofs_topological(V, 1, facets)
    return field.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs]


def applied(V, *bcs):
    """A field of ones on which the conditions have been set."""
    field = fem.Function(V)
    field.x.array[:] = 1.0
    compat.set_bc(field.x.array, bcs)
    field.x.scatter_forward()
    return field


@pytest.mark.quick
def test_whole_displacements_and_components_are_prescribed(scene):
    V = tools.vector_space(scene.mesh, 1)
    bottom, top = scene.find("bottom"), scene.find("top")
    down = fem.Constant(scene.mesh, 0.0)
    bcs = [
        tools.prescribe(V, bottom, (0.5, 0.25)),
        tools.prescribe(V, top, down, component=1),
    ]
    down.value = -3.0
    field = applied(V, *bcs)
    assert np.all(values_on(field, bottom) == [0.5, 0.25])
    assert np.all(values_on(field, top) == [1.0, -3.0])
    rest = applied(V, tools.prescribe(V, bottom))
    assert np.all(values_on(rest, bottom) == 0.0)
    assert np.all(values_on(rest, top) == 1.0)


@pytest.mark.quick
def test_parts_of_a_mixed_space_are_prescribed_by_component(scene):
    W = tools.mixed_space(scene.mesh, ("Lagrange", 2, (2,)), ("Lagrange", 1, ()))
    w, bottom = fem.Function(W), scene.find("bottom")
    compat.set_bc(w.x.array, [tools.prescribe(W.sub(0), bottom, 0.25, component=1)])
    assert set(w.x.array) == {0.0, 0.25}
    assert np.all(w.sub(0).sub(1).collapse().x.array >= 0.0)
    for value in (0.0, (0.5, 0.25), fem.Constant(scene.mesh, (0.5, 0.25))):
        with pytest.raises(ContactError, match="component=0, then with the others"):
            tools.prescribe(W.sub(0), bottom, value)


@pytest.mark.parametrize(
    "value, component, said",
    [
        (0.0, 2, r"component must be one of \[0, 1\] or None, not 2"),
        (0.0, "x", "component must be one of"),
        ((0.0, 1.0, 2.0), None, "value must be a number or 2 numbers"),
        ((0.0, 1.0), 0, "value must be a number, not"),
        ("low", None, "value must be a number or 2 numbers, not 'low'"),
    ],
)
def test_conditions_that_cannot_be_are_refused(scene, value, component, said):
    V = tools.vector_space(scene.mesh, 1)
    with pytest.raises(ContactError, match=said):
        tools.prescribe(V, scene.find("bottom"), value, component)


def test_a_function_is_for_another_call(scene):
    V = tools.vector_space(scene.mesh, 1)
    with pytest.raises(ContactError, match="dolfinx.fem.dirichletbc takes a Function"):
        tools.prescribe(V, scene.find("bottom"), fem.Function(V))


@pytest.mark.parametrize(
    "facets, said",
    [
        ("top", r"such as facet_tags.find\(3\) or bodies.find\('bottom'\), not 'top'"),
        (None, "must be numbers of facets of this rank, .* not None"),
        (np.array([1.0, 2.0]), r"must be numbers of facets .* not array\(\[1., 2.\]\)"),
        (3, "must be numbers of facets .* not 3"),
        ([[1], [2, 3]], "must be numbers of facets"),
        (
            np.array([10**6]),
            r"facets has 1000000, and the facets of this rank are 0 to",
        ),
        ([0, -1], "facets has -1, and"),
        ([], "facets has none on any rank, so nothing would be prescribed"),
    ],
)
def test_facets_that_cannot_be_are_refused(scene, facets, said):
    V = tools.vector_space(scene.mesh, 1)
    with pytest.raises(ContactError, match=said):
        tools.prescribe(V, facets)


def test_facets_wrong_on_one_rank_are_refused_on_all(scene):
    V = tools.vector_space(scene.mesh, 1)
    wrong = "top" if COMM.rank == COMM.size - 1 else scene.find("top")
    with pytest.raises(ContactError, match="must be numbers of facets"):
        tools.prescribe(V, wrong)


def test_a_rank_may_have_no_facets(scene):
    V, top = tools.vector_space(scene.mesh, 1), scene.find("top")
    facets = [] if COMM.size > 1 and len(top) == 0 else top
    assert np.all(values_on(applied(V, tools.prescribe(V, facets)), top) == 0.0)


@pytest.mark.quick
@pytest.mark.parametrize("by_name", [False, True])
def test_a_field_has_the_value_of_each_body(scene, by_name):
    tags, mesh = scene.cell_tags, scene.mesh
    values, names = {1: 2.0, 2: 30.0}, None
    if by_name:
        values, names = {"lower": 2.0, "upper": 30.0}, {"lower": 1, "upper": (2, 2)}
    field = tools.by_body(mesh, tags, values, names)
    dx = ufl.Measure("dx", mesh, subdomain_data=tags)
    # Both bodies have the area 1
    assert tools.integral(field * dx(1), mesh) == pytest.approx(2.0, rel=1e-12)
    assert tools.integral(field * dx(2), mesh) == pytest.approx(30.0, rel=1e-12)


@pytest.mark.parametrize(
    "values, names, said",
    [
        ({1: 2.0}, None, r"tags without a value are \[2\]"),
        ({1: 2.0}, {"top": (1, 2), "upper": (2, 2)}, r"are \['upper' \(tag 2\)\]"),
        ({"lower": 2.0}, None, "no cells are named 'lower'; known names: none"),
        ({"low": 2.0}, {"lower": 1}, "known names: 'lower'"),
    ],
)
def test_bodies_without_value_or_name_are_refused(scene, values, names, said):
    with pytest.raises(ContactError, match=said):
        tools.by_body(scene.mesh, scene.cell_tags, values, names)


def test_von_mises_stress_of_tension_and_of_shear(scene):
    """Tension s has the equivalent stress s, shear t that of sqrt(3) t, pressure none."""
    one = fem.Constant(scene.mesh, 1.0)
    states = {
        2.0: [[2, 0, 0], [0, 0, 0], [0, 0, 0]],
        np.sqrt(3.0) * 5.0: [[0, 5, 0], [5, 0, 0], [0, 0, 0]],
        0.0: [[-7, 0, 0], [0, -7, 0], [0, 0, -7]],
    }
    for expected, stress in states.items():
        sigma = ufl.as_tensor(stress) * one
        mean = tools.integral(tools.von_mises(sigma) * ufl.dx(scene.mesh), scene.mesh)
        assert mean == pytest.approx(2.0 * expected, abs=1e-12)
