"""Bad forms, conditions and options, and calls in a wrong order."""

import warnings

from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from calls import contact, problem, ready_problem, refused, small_blocks
from dolfinx import fem
from problems import COMM, build, fix, residual

import raymortar
from raymortar import (
    AugmentedLagrangian,
    ContactWarning,
    Coulomb,
    NonlinearProblem,
    Penalty,
    Search,
    SNESSolver,
)
from raymortar.core import compat

pytestmark = [pytest.mark.quick, pytest.mark.mpi]


@pytest.fixture(scope="module")
def scene():
    return small_blocks()


@pytest.fixture(scope="module")
def ready(scene):
    return ready_problem(scene)


# Forms and conditions


def good(scene, u):
    return residual(scene, u)[0]


def of_degree_2(scene, u):
    return good(scene, fem.Function(compat.vector_space(scene.mesh, 2)))


def of_another(scene, u):
    w, v = fem.Function(u.function_space), ufl.TestFunction(u.function_space)
    return ufl.inner(ufl.grad(w), ufl.grad(v)) * ufl.dx


def in_a_like_space(scene, u):
    """DOLFINx would not apply the conditions to its rows."""
    v = ufl.TestFunction(compat.vector_space(scene.mesh, 1))
    return ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx


FORMS = {
    "rank 2": (lambda s, u: ufl.derivative(good(s, u), u), "F is a form of rank 2"),
    "rank 0": (lambda s, u: ufl.inner(u, u) * ufl.dx, "F is a form of rank 0"),
    "space": (of_degree_2, "F has a test or trial function in another space"),
    "like space": (in_a_like_space, "F has a test or trial function in another space"),
    "function": (of_another, "F does not depend on the displacement .* contact.u"),
    "list": (lambda s, u: [good(s, u)], "F must be one UFL form, .* not list"),
    "number": (lambda s, u: 0, "F must be one UFL form, .* not int"),
    "compiled": (lambda s, u: fem.form(good(s, u)), "F must be one UFL form"),
}


@pytest.mark.parametrize("case", FORMS)
def test_bad_residuals_are_refused(scene, case):
    F, pattern = FORMS[case]
    with refused(pattern):
        problem(scene, F)


def mass(V):
    return ufl.inner(ufl.TrialFunction(V), ufl.TestFunction(V)) * ufl.dx


JACOBIANS = {
    "rank 1": (good, "J is a form of rank 1"),
    "space": (
        lambda s, u: mass(compat.vector_space(s.mesh, 2)),
        "J has a test or trial function in another space",
    ),
    "list": (lambda s, u: [[1]], "J must be one UFL form, .* not list"),
}


@pytest.mark.parametrize("case", JACOBIANS)
def test_bad_jacobians_are_refused(scene, case):
    J, pattern = JACOBIANS[case]
    with refused(pattern):
        problem(scene, J=J)


def test_problem_takes_a_contact_and_conditions(scene):
    c = contact(scene)
    F = residual(scene, c.u)[0]
    bc = fix(c.u.function_space, scene, "bottom")
    with refused("contact must be a Contact, not Function"):
        NonlinearProblem(F, c.u)
    with refused("bcs must be a list of Dirichlet conditions, not"):
        NonlinearProblem(F, c, bc)
    with refused("boundary condition 1 is no Dirichlet condition, but 3"):
        NonlinearProblem(F, c, [bc, 3])
    assert NonlinearProblem(F, c, None).bcs == []


def test_contact_takes_compiled_bilinear_forms(scene):
    c = contact(scene)
    F = residual(scene, c.u)[0]
    for a in (None, F, fem.form(F)):
        with refused("a must be a compiled bilinear form"):
            c.create_matrix(a)


# Options


@pytest.mark.parametrize("value", ["yes", 1, None])
def test_subdivide_is_true_or_false(scene, value):
    with refused("search subdivide = .* must be True or False"):
        contact(scene, search=Search(subdivide=value))


@pytest.mark.parametrize("tag", [3.0, np.float64(3), np.nan, None, True, (3,)])
def test_tags_are_whole_numbers(scene, tag):
    with refused("pairs has the tag .*, which is no whole number"):
        contact(scene, [(tag, 4)])


def test_whole_numbers_of_numpy_are_taken(scene):
    c = contact(
        scene,
        np.array([[3, 4]], dtype=np.int64),
        method=AugmentedLagrangian(np.float32(2.0), degree=np.int64(1)),
        friction=Coulomb(np.float64(0.3)),
        quadrature_degree=np.int32(4),
        search=Search(reach=np.float32(3.0), subdivide=np.False_),
    )
    c.update()
    assert len(contact(scene, [(np.int32(3), np.int64(4))]).zones) == 1
    named = contact(scene, [("a", "b")], names={"a": np.int64(3), "b": [1, 4]})
    assert named.zones[0].facets.master_tags == (4,)
    assert c.resultant(np.int64(0)).force.shape == (2,)


@pytest.mark.parametrize("group", [3.5, "x", (1, 2, 3), None])
def test_names_are_of_tags(scene, group):
    with refused("names has .* for 'a': it must be a tag"):
        contact(scene, [("a", 4)], names={"a": group})
    with refused("names must map names to facet tags"):
        contact(scene, [("a", 4)], names=["a"])


@pytest.mark.parametrize(
    "options, pattern",
    [
        ({"measure": np.array(["reference", "x"])}, "measure must be one of"),
        ({"tangent": ["full"]}, "tangent must be one of"),
        ({"quadrature_degree": True}, "quadrature_degree = True"),
    ],
)
def test_options_of_other_types_are_refused(scene, options, pattern):
    with refused(pattern):
        contact(scene, **options)


@pytest.mark.parametrize(
    "make, pattern",
    [
        (lambda: AugmentedLagrangian(degree=1.0), "multiplier degree 1.0 is not"),
        (lambda: AugmentedLagrangian(degree=np.arange(2)), "multiplier degree"),
        (lambda: AugmentedLagrangian(multiplier=np.arange(2)), "multiplier must be"),
        (lambda: Penalty(True), "gamma must be a positive number"),
        (lambda: Penalty(tangential=["rate"]), "tangential must be"),
    ],
)
def test_methods_of_other_types_are_refused(scene, make, pattern):
    with refused(pattern):
        contact(scene, method=make())


# Order of calls


@pytest.mark.parametrize("method", [AugmentedLagrangian(1.0), Penalty(1.0), None])
def test_nothing_is_assembled_before_it_is_paired(scene, method):
    c = contact(scene, method=method)
    A, b = c.layout.create_matrix(), c.create_vector()
    for call in (
        lambda: c.assemble_matrix(A),
        lambda: c.assemble_vector(b),
        lambda: c.apply_lifting(b, [], c.u.x.array, 1.0),
    ):
        with refused("needs pairs: call update first"):
            call()
    with refused("make_room needs the volume's pattern: call create_matrix"):
        c.make_room(A)


def test_nothing_is_assembled_without_gamma(scene):
    c = contact(scene)
    c.update()
    text = "assemble_vector needs gamma: give one, or make a problem or create_matrix"
    with refused(text):
        c.assemble_vector(c.create_vector())
    with refused("set_gamma needs a number or a Function, not None"):
        c.set_gamma(None)


def test_a_vector_of_other_rows_is_not_taken(scene):
    c = contact(scene)
    other = PETSc.Vec().createMPI((c.layout.size + 1, None), comm=COMM)
    with refused("from_vector needs .* rows on this rank"):
        c.from_vector(other)
    with refused("to_vector needs .* rows on this rank"):
        c.to_vector(other)
    with refused("to_vector needs a PETSc Vec over .*, not ndarray"):
        c.to_vector(c.u.x.array)


def test_nothing_is_read_before_there_is_anything(scene, folder):
    c = contact(scene, method=Penalty(1.0), friction=Coulomb(0.3))
    for call in (
        c.points,
        c.gap,
        c.traction,
        c.slip,
        c.status,
        c.results.coverage,
        c.fields,
        c.resultant,
        c.friction_work,
        lambda: c.results.write_segments(folder / "none.vtu"),
        lambda: raymortar.plot(c),
    ):
        with refused("there are no results yet: call update, or solve, first"):
            call()
    assert c.statistics.points == 0
    F = (
        ufl.inner(ufl.grad(c.u), ufl.grad(ufl.TestFunction(c.u.function_space)))
        * ufl.dx
    )
    problem = raymortar.NonlinearProblem(F, c)
    with refused("there are no results yet: call update, or solve, first"):
        problem.reactions({})


@pytest.mark.parametrize(
    "name, arguments", [("resultant", ()), ("resultant", (3, 4)), ("resultants", ())]
)
def test_forces_of_nothing_solved_are_told_once(scene, name, arguments):
    case = build(scene, bcs=lambda V, s: [fix(V, s, ["bottom", "top"])])

    def told():
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ContactWarning)
            getattr(case.contact.results, name)(*arguments)
        return [w for w in caught if "nothing has been solved" in str(w.message)]

    solver = SNESSolver(case.problem)
    (warning,) = told()
    assert warning.filename == __file__
    assert told() == []
    solver.solve()
    assert told() == []


def test_forces_of_a_state_that_is_given_are_not_told(scene):
    case = build(scene, bcs=lambda V, s: [fix(V, s, ["bottom", "top"])])
    state = case.contact.state()
    SNESSolver(case.problem)
    case.contact.restore(state)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        case.contact.resultant()


@pytest.mark.parametrize("zone", ["name", 3, -2, 0.0, None, True])
def test_surfaces_are_numbered(ready, zone):
    ready.contact.update()
    for read in (ready.contact.resultant, ready.contact.points):
        with refused("there is no slave surface .*: they are numbered from 0 to 0"):
            read(zone)


def test_matrices_and_vectors_are_those_of_the_system(ready):
    c = ready.contact
    c.update()
    small = PETSc.Vec().createMPI((3, None), comm=COMM)
    with refused("assemble_vector needs .* rows on this rank, .* was given 3"):
        c.assemble_vector(small)
    with refused("assemble_matrix needs a PETSc Mat over .*, not NoneType"):
        c.assemble_matrix(None)
    with refused("make_room needs a PETSc Mat over .*, not Vec"):
        c.make_room(small)
    with refused("needs .* rows on this rank, .* was given .* x "):
        rows = c.layout.size, None
        wide = PETSc.Mat().createAIJ((rows, (c.layout.size + 1, None)), comm=COMM)
        c.assemble_matrix(wide)
    with refused("x0 must be a ghosted array of u, of shape"):
        c.apply_lifting(ready.create_vector(), [], np.zeros(1), 1.0)
