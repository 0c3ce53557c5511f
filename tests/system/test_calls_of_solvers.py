"""Bad arguments of solvers, paths, histories, states and files."""

from petsc4py import PETSc

import numpy as np
import pytest
from calls import PAIR, contact, problem, ready_problem, refused, small_blocks
from dolfinx import fem
from problems import COMM, SOLVERS

import raymortar
from meshes.scenes import two_blocks
from raymortar import Coulomb, History, LoadSteps, Penalty, SNESSolver
from raymortar.core import compat
from raymortar.io import read_gmsh, write_vtk, write_xdmf

pytestmark = [pytest.mark.quick, pytest.mark.mpi]


@pytest.fixture(scope="module")
def scene():
    return small_blocks()


@pytest.fixture(scope="module")
def ready(scene):
    return ready_problem(scene)


@pytest.fixture(scope="module")
def solver(ready):
    return SNESSolver(ready)


def test_the_solver_of_a_problem_that_is_gone_says_so(scene):
    solver = ready_problem(scene).snes_solver
    with refused("the problem of this snes_solver is gone: keep it in a variable"):
        raymortar.LoadSteps(solver, lambda t: None)


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


@pytest.mark.parametrize("kind", SOLVERS)
def test_solvers_refuse_settings_that_they_nearly_have(ready, kind):
    solver = kind(ready)
    for name in ("max_itt", "maxit", "tolerance"):
        with pytest.raises(AttributeError, match=f"has no {name}: .* max_it, "):
            setattr(solver, name, 3)
    solver.max_it, solver.tolerances = 7, (1e-8, 1e-9)
    assert (solver.max_it, solver.tolerances) == (7, (1e-8, 1e-9))
    solver.steps = []  # a program's own
    assert solver.steps == []


def test_settings_of_the_other_solver_are_refused(solver):
    for name in ("rtol", "atol", "relaxation_parameter"):
        with pytest.raises(AttributeError, match=f"SNESSolver has no {name}: "):
            setattr(solver, name, 1.0)


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
        ({"path": (0.0, 0)}, r"path = \(0.0, 0\) must have two ends"),
        ({"history": 3}, "history must be a History, not 3"),
        ({"progress": 3}, "progress must be True, False, None or a file"),
    ],
)
def test_load_steps_refuse(solver, options, pattern):
    with refused(pattern):
        LoadSteps(solver, lambda t: None, **options)


def test_load_steps_need_a_solver_and_its_loads(scene, ready, solver):
    for thing in (None, ready, solver.snes):
        with refused("solver must be a NewtonSolver or an SNESSolver"):
            LoadSteps(thing, lambda t: None)
    with refused("apply must be a function of the load factor, not None"):
        LoadSteps(solver, None)
    for apply in (lambda t, dt, x: None, lambda: None, lambda t, *, x: None):
        with refused("apply must be a function of the load factor, or of that and"):
            LoadSteps(solver, apply)
    with refused("history is of another problem than the solver"):
        LoadSteps(solver, lambda t: None, history=History(problem(scene)))


@pytest.mark.parametrize("apply", (lambda t, x=3: None, lambda *given: None, print))
def test_load_steps_pass_the_load_factor_alone(solver, apply):
    assert len(LoadSteps(solver, apply, 1).run()) == 1


def test_whole_numbers_of_numpy_are_steps(solver):
    path = LoadSteps(solver, lambda t: None, np.int64(2), path=np.array([0.0, 1.0]))
    assert [step.factor for step in path.run()] == [0.5, 1.0]


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


def test_states_of_other_contacts_are_refused(scene):
    springs = contact(scene, method=Penalty(1.0), friction=Coulomb(0.3))
    springs.update()
    springs.advance()
    finer = two_blocks(COMM, 2, "triangle", 3, 3)
    others = {
        "multiplier": (contact(scene), contact(scene, method=Penalty(1.0))),
        "multiplier 0 of": (contact(scene), contact(scene, friction=Coulomb(0.3))),
        "unknown 0": (contact(scene), contact(finer)),
        "slip 0": (contact(scene, method=Penalty(1.0)), springs),
        "slave surfaces 0 of": (contact(scene), contact(scene, PAIR + [(1, 2)])),
    }
    for part, (one, other) in others.items():
        for to, state in ((one, other.state()), (other, one.state())):
            if to is springs:  # they have none at the start
                to.restore(state)
                continue
            with refused("the state is of another contact, mesh or method: " + part):
                to.restore(state)
    with refused("state must be a State, as .*, not NoneType"):
        springs.restore(None)


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
        ready.contact.results.write_segments(None)


def test_functions_are_written(scene, folder):
    with refused("functions must be a list of Functions"):
        write_xdmf(folder / "a.xdmf", scene.mesh, [3])
    with refused("functions must be a list of Functions"):
        write_vtk(folder / "a.pvd", scene.mesh, [])
    with refused("source must be gmsh.model or the path of a .msh file, not None"):
        read_gmsh(None, COMM)
