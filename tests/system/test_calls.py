"""Bad arguments of problems, solvers, paths and results, and calls in a wrong order."""

from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, SOLVERS, fix, residual

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    ContactError,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    Search,
    SNESSolver,
    compat,
)
from raymortar.solvers.fixed_point import FixedPointSolver

pytestmark = [pytest.mark.quick, pytest.mark.mpi]
PAIR = [(3, 4)]


def refused(pattern):
    return pytest.raises(ContactError, match=pattern)


@pytest.fixture(scope="module")
def scene():
    return two_blocks(COMM, 2, "triangle", 2, 2)


def contact(scene, pairs=PAIR, **options):
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    return raymortar.Contact(u, scene.facet_tags, pairs, **options)


def problem(scene, F=None, J=None, **options):
    """Problem of a contact; F and J of its displacement."""
    c = contact(scene, **options)
    bcs = [fix(c.u.function_space, scene, ["bottom", "top"])]
    F = residual(scene, c.u)[0] if F is None else F(scene, c.u)
    return NonlinearProblem(F, c, bcs, None if J is None else J(scene, c.u))


@pytest.fixture(scope="module")
def ready(scene):
    """A problem whose contact has results."""
    made = problem(scene)
    made.contact.update()
    return made


@pytest.fixture(scope="module")
def solver(ready):
    return SNESSolver(ready)


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
            c.prepare(a)


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
    with refused("assemble_vector needs gamma: give one, or make a problem"):
        c.assemble_vector(c.create_vector())
    with refused("set_gamma needs a number or a Function, not None"):
        c.set_gamma(None)


def test_nothing_is_read_before_there_is_anything(scene, folder):
    c = contact(scene, method=Penalty(1.0), friction=Coulomb(0.3))
    for call in (
        c.points,
        c.gap,
        c.traction,
        c.slip,
        c.status,
        c.coverage,
        c.fields,
        c.resultant,
        c.friction_work,
        lambda: c.write_segments(folder / "none.vtu"),
        lambda: raymortar.plot(c),
    ):
        with refused("there are no results yet: call update, or solve, first"):
            call()
    assert c.statistics.points == 0


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
    with refused("x0 must be a ghosted array of u, of shape"):
        c.apply_lifting(ready.create_vector(), [], np.zeros(1), 1.0)


# Solvers and paths


@pytest.mark.parametrize("kind", SOLVERS)
def test_solvers_refuse_what_is_no_problem_or_option(ready, kind):
    with refused("problem must be a NonlinearProblem, not Contact"):
        kind(ready.contact)
    with refused("options must be PETSc options by name, not"):
        kind(ready, ["ksp_type"])
    with refused("options must be PETSc options by name, not"):
        kind(ready, {3: 4})
    with refused("PETSc does not take the options .*'nope'"):
        kind(ready, {"pc_type": "nope"})
    assert not any("raymortar" in name for name in PETSc.Options().getAll())


@pytest.mark.parametrize(
    "options, pattern",
    [
        ({"steps": 2.5}, "steps = 2.5 .* must be whole numbers"),
        ({"steps": "3"}, "steps = '3' .* must be whole numbers"),
        ({"steps": None}, "steps = None .* must be whole numbers"),
        ({"steps": True}, "steps = True .* must be whole numbers"),
        ({"max_halvings": 1.5}, "max_halvings = 1.5 must be whole numbers"),
        ({"largest": np.nan}, "largest = nan must be at least 1"),
        ({"largest": "2"}, "largest = '2' must be at least 1"),
        ({"easy": None}, "easy = None must be a number of iterations"),
        ({"extrapolate": "yes"}, "extrapolate must be True or False"),
        ({"path": 3.0}, "path must be two numbers"),
        ({"path": (0.0, np.nan)}, "path must be two numbers"),
        ({"path": ("a", "b")}, "path must be two numbers"),
        ({"history": 3}, "history must be a History, not 3"),
        ({"progress": 3}, "progress must be True, False, None or a file"),
    ],
)
def test_load_steps_refuse(solver, options, pattern):
    with refused(pattern):
        LoadSteps(solver, lambda t: None, **options)


def test_load_steps_need_a_solver_and_its_loads(scene, ready, solver):
    for thing in (None, ready, solver.snes):
        with refused("solver must be a NewtonSolver, SNESSolver or FixedPointSolver"):
            LoadSteps(thing, lambda t: None)
    with refused("apply must be a function of the load factor, not None"):
        LoadSteps(solver, None)
    with refused("history is of another problem than the solver"):
        LoadSteps(solver, lambda t: None, history=History(problem(scene)))


@pytest.mark.parametrize("outer", [0, 2.5, "3", None, True])
def test_fixed_point_refuses(solver, outer):
    with refused("max_outer = .* must be positive and a whole number"):
        FixedPointSolver(solver, outer)


def test_whole_numbers_of_numpy_are_steps(solver):
    path = LoadSteps(solver, lambda t: None, np.int64(2), path=np.array([0.0, 1.0]))
    assert [step.factor for step in path.run()] == [0.5, 1.0]


# History


@pytest.mark.parametrize(
    "options, pattern",
    [
        ({"file": 3}, "the name of a file must be a path, not 3"),
        ({"reactions": [1]}, "reactions must be Dirichlet conditions by name"),
        ({"reactions": {"top": 3}}, "reactions has 3 for 'top', which is no"),
        ({"energy": 3}, "energy must be a UFL functional"),
        ({"more": {"x": 3}}, "more must be functions by name of the column"),
        ({"more": {"x y": lambda: 1.0}}, "column 'x y' of a history is no name"),
        ({"more": {"time": lambda: 1.0}}, "column 'time' of a history is there twice"),
    ],
)
def test_history_refuses(ready, options, pattern):
    with refused(pattern):
        History(ready, **options)


def test_records_are_numbers(ready):
    with refused("problem must be a NonlinearProblem, not NoneType"):
        History(None)
    history = History(ready, more={"x": lambda: None})
    with refused("time of a record must be a number, not 'a'"):
        history.record("a")
    with refused("x of a record must be a number, not None"):
        history.record(0.0)
    with refused("a history has no column 'nope', but time, iterations"):
        history["nope"]
    with refused("record 0 has 2 values, this history 9 columns"):
        history.resume([[1.0, 2.0]])
    with refused("rows must be records, as of History.rows, not 3"):
        history.resume(3)
    with refused("until must be a load factor, not None"):
        history.resume([], None)


def test_more_is_asked_of_one_rank(ready):
    history = History(ready, more={"x": lambda: 2.0 if COMM.rank == 0 else None})
    history.record(0.0)
    assert history["x"] == [2.0]


def test_reactions_are_of_conditions(ready):
    with refused("supports must be Dirichlet conditions by name of the support"):
        ready.reactions([ready.bcs[0]])


# States


def test_states_of_other_contacts_are_refused(scene):
    springs = contact(scene, method=Penalty(1.0), friction=Coulomb(0.3))
    springs.update()
    springs.advance()
    finer = two_blocks(COMM, 2, "triangle", 3, 3)
    others = {
        "multiplier": (contact(scene), contact(scene, method=Penalty(1.0))),
        "multiplier of": (contact(scene), contact(scene, friction=Coulomb(0.3))),
        "displacement": (contact(scene), contact(finer)),
        "tractions of springs 0": (contact(scene, method=Penalty(1.0)), springs),
        "list of slave surfaces": (contact(scene), contact(scene, PAIR + [(1, 2)])),
    }
    for part, (one, other) in others.items():
        for to, state in ((one, other.state()), (other, one.state())):
            if to is springs:  # they have none at the start
                to.restore(state)
                continue
            with refused("the state is of another contact, mesh or method: " + part):
                to.restore(state)
    with refused("state must be a ContactState, not NoneType"):
        springs.restore(None)


# Pictures and files


def test_pictures_are_of_contacts_and_fields(ready, scene):
    ready.contact.update()
    with refused("plot needs a Contact, not NoneType"):
        raymortar.plot(None)
    with refused("field must be a Function or UFL expression, not 3"):
        raymortar.plot(ready.contact, field=3)
    foreign = fem.Function(compat.vector_space(two_blocks(COMM, 2).mesh, 1))
    with refused("field is a Function on another mesh than the displacement"):
        raymortar.plot(ready.contact, field=foreign)
    with refused("the name of a file must be a path, not 3"):
        raymortar.plot(ready.contact, 3)
    with refused("the name of a file must be a path, not None"):
        ready.contact.write_segments(None)


def test_functions_are_written(scene, folder):
    with refused("functions must be a list of Functions"):
        compat.write_xdmf(folder / "a.xdmf", scene.mesh, [3])
    with refused("functions must be a list of Functions"):
        compat.write_vtk(folder / "a.pvd", scene.mesh, [])
    with refused("source must be gmsh.model or the path of a .msh file, not None"):
        compat.read_gmsh(None, COMM)
