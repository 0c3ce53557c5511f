"""Kept factors of linear bodies: the direct solver's answer without its factors."""

import resource

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import pytest
from dolfinx import fem
from hosts import linear_pressure
from interacting import Stack
from problems import CELLS, COMM, DIMENSION, SOLVERS, build, fix, stack, worst
from rigid_scenes import press, shapes

import raymortar
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    ContactError,
    Coulomb,
    Penalty,
    SNESSolver,
    rigid,
    solvers,
)
from raymortar.core.solvers.petsc_objects import PetscOptions
from raymortar.solvers import automatic
from raymortar.solvers.compliance import Compliance, supports
from raymortar.solvers.inner import is_symmetric
from raymortar.solvers.one_tangent import correct, linearise

METHODS = {"augmented": AugmentedLagrangian, "penalty": lambda: Penalty(2e4)}
FRICTIONS = {"frictionless": None, "friction": Coulomb(0.3)}
alone = pytest.mark.skipif(COMM.size > 1, reason="factors are kept on one rank")


def pressed(cell="hexahedron", degree=1, n=(2, 3), **options):
    """A block pressed on another with a lean, and pushed where there is friction."""
    dim, along = DIMENSION[cell], 0.004 if options.get("friction") else 0.0

    def held(V, scene):
        def lean(x):
            down = -0.02 + 0.01 * x[:, :1]
            return np.hstack(
                [np.full((len(x), 1), along), *[0 * down] * (dim - 2), down]
            )

        return [fix(V, scene, "bottom"), fix(V, scene, "top", value=lean)]

    return build(stack(cell, n), degree, bcs=held, **options)


def solved(problem, options, solver=SNESSolver):
    """Solver, Newton iterations and unknowns from the state of the start."""
    one = solver(problem, options)
    iterations, _ = one.solve()
    return one, iterations, problem.start().array.copy()


def context(solver):
    return solver.krylov_solver.getPythonContext()


def assert_same(problem, solver=SNESSolver, size=1e-12):
    """Both ways end at the same point; gives what has solved by kept factors."""
    start = problem.contact.state()
    _, wanted_iterations, wanted = solved(problem, solvers.direct(), solver)
    problem.contact.restore(start)
    kept, iterations, found = solved(problem, solvers.kept_factors(), solver)
    assert worst(found - wanted) <= size * worst(wanted)
    assert abs(iterations - wanted_iterations) <= 1
    assert context(kept).systems + context(kept).exceptions == iterations
    return context(kept)


@pytest.mark.mpi
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("cell, degree", [*((c, 1) for c in CELLS), ("triangle", 2)])
def test_answer_is_that_of_the_direct_solver(cell, degree, method, friction):
    problem = pressed(
        cell, degree, method=METHODS[method](), friction=FRICTIONS[friction]
    ).problem
    found = assert_same(problem)
    # On several ranks the direct solver has them all
    assert (found.systems == 0) == (COMM.size > 1)
    assert (found.exceptions == 0) == (COMM.size == 1)


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_either_solver_takes_the_options(solver):
    assert_same(pressed("quadrilateral").problem, solver)


@pytest.mark.mpi
def test_each_rank_may_have_a_problem_of_its_own():
    scene = two_blocks(MPI.COMM_SELF, 2, "triangle", (4, 4), (3, 3))
    problem = build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=-0.02)]
    ).problem
    solver, iterations, _ = solved(problem, solvers.kept_factors())
    assert context(solver).systems == iterations > 0


@alone
@pytest.mark.parametrize(
    "method, friction",
    # A frictionless penalty fails in one step of this size, by MUMPS too
    [("augmented", "frictionless"), ("augmented", "friction"), ("penalty", "friction")],
)
def test_bodies_that_contact_alone_holds(method, friction):
    """The middle one of three blocks; all of them rest on each other."""
    scene = stack("hexahedron", (2, 3, 2), widths=(1.2, 1.0, 1.1))
    blocks = Stack(scene, ["bottom_0"], ["top_2"])
    pairs = [("bottom_1", "top_0"), ("bottom_2", "top_1")]
    options = {"friction": FRICTIONS[friction]} if friction == "friction" else {}
    contacts = [
        blocks.contact(pair, method=METHODS[method](), **options) for pair in pairs
    ]
    problem = blocks.problem(contacts)
    blocks.move(1.0)
    if friction == "frictionless":
        # Nothing else keeps it from sliding
        V = problem.u.function_space
        problem.bcs += [fix(V, scene, "left_1", 0), fix(V, scene, "front_1", 1)]
    before = stiffness(problem)
    found = assert_same(problem, size=1e-10)
    assert found.systems > 0 and found.exceptions == 0
    # The springs that hold it are in the factors alone
    assert stiffness(problem) == pytest.approx(before, rel=1e-14)


def stiffness(problem):
    """Norm of the stiffness that is kept."""
    problem.F(problem.start(), problem.create_vector())
    return problem.volume.kept.tangent.norm()


@alone
@pytest.mark.parametrize("free", [("z",), ("x", "y", "z", "rx", "ry")])
def test_a_free_rigid_body(free):
    ball = rigid.Body(
        shapes(3)["sphere"], free=free, force=(0.0, 0.0, -0.3), stiffness=0.1
    )
    friction = Coulomb(0.3) if len(free) > 1 else None
    problem = press("hexahedron", ball, material="linear", friction=friction).problem
    found = assert_same(problem, size=1e-10)
    assert found.exceptions == 0


@alone
def test_a_pressure_beside_the_displacement():
    assert assert_same(linear_pressure()).exceptions == 0


@alone
def test_factors_are_made_once_for_a_path():
    scene = stack("quadrilateral", (3, 4))
    down = fem.Constant(scene.mesh, np.zeros(2))
    problem = build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=down)]
    ).problem
    solver = SNESSolver(problem, solvers.kept_factors())

    def apply(factor):
        down.value[:] = 0.01 * factor, -0.05 * factor

    raymortar.LoadSteps(solver, apply, 4).run()
    assert context(solver).factorisations == 1
    assert context(solver).exceptions == 0


@alone
def test_a_stiffness_that_changes_is_factorised_anew_where_it_lasts():
    built = pressed("quadrilateral")
    solver = SNESSolver(built.problem, solvers.kept_factors())
    found, change = context(solver), built.moduli[0].x.array
    x, b = built.problem.start(), built.problem.create_vector()
    built.problem.F(x, b)
    dx = b.duplicate()

    def solve(times):
        for _ in range(times):
            change[0] *= 1.0 + 1e-9 * (times == 1)
            linearise(solver, x, {})
            with solver.options:
                correct(solver, b, dx)
        return found.factorisations, found.exceptions

    assert solve(4) == (1, 0)
    # What has lasted may change, and then has to last
    assert solve(1) == (2, 0)
    assert solve(1) == solve(0) == (2, 1)
    assert solve(4) == (3, 4)


@pytest.mark.mpi
def test_a_nonlinear_body_gets_the_direct_solver():
    problem = build(
        stack("quadrilateral", (2, 3)),
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=-0.02)],
    ).problem
    found = assert_same(problem)
    assert found.systems == found.factorisations == 0


@alone
def test_where_kept_factors_do_not_pay_the_direct_solver_takes_over():
    """All of a small problem's surface is touched."""
    solver, iterations, _ = solved(pressed().problem, solvers.kept_factors(0.7))
    assert context(solver).exceptions == iterations


@alone
def test_springs_of_a_stepped_path_on_the_diagonal_are_seen():
    """Entries that contact has not added: the direct solver solves such a system."""
    problem = pressed("quadrilateral").problem
    solver = SNESSolver(problem, solvers.kept_factors())
    x, b = problem.start(), problem.create_vector()
    problem.F(x, b)
    free = np.flatnonzero(~problem.constrained)
    inner = int(free[len(free) // 2])
    linearise(solver, x, {inner: 1e4})
    with solver.options:
        dx = b.duplicate()
        correct(solver, b, dx)
    rest = b.duplicate()
    solver.A.mult(dx, rest)
    rest.pointwiseDivide(rest, solver.scale)
    rest.axpy(-1.0, b)
    assert rest.norm() <= 1e-12 * b.norm()


@alone
@pytest.mark.skipif(len(SOLVERS) == 1, reason="compares both solvers")
def test_weighed_rows_have_the_columns_of_others():
    """SNES weighs the rows of bodies of unlike stiffness: by rounding that would seem
    to touch all of their surfaces."""

    def held(V, scene):
        """Closed on one side."""
        top = fix(V, scene, "top", 1, value=lambda x: 0.3 * x[:, 0] - 0.01)
        return [fix(V, scene, "bottom"), fix(V, scene, "top", 0), top]

    scene = stack("quadrilateral", (6, 7))
    problem = build(scene, bcs=held, E={"0": 7e5, "1": 30.0}).problem
    _, _, values = solved(problem, solvers.direct())
    found = []
    for solver in SOLVERS:
        one = solver(problem, solvers.kept_factors())
        x, b = problem.start(), problem.create_vector()
        x.array[:] = values
        problem.F(x, b)
        linearise(one, x, {})
        with one.options:
            correct(one, b, b.duplicate())
        found.append(context(one)._compliance.known)
    assert found[0] == found[1]


# The choice


@pytest.mark.mpi
@pytest.mark.parametrize("material", ["linear", "neo-hookean"])
@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
def test_linear_bodies_in_3d_get_them(cell, material, monkeypatch):
    monkeypatch.setattr(automatic, "LEAST_KEPT", 10)
    problem = pressed(cell, material=material).problem
    solver = SNESSolver(problem)
    gets_them = COMM.size == 1 and cell == "hexahedron" and material == "linear"
    assert solver.krylov_solver.getType() == ("python" if gets_them else "preonly")
    told = SNESSolver(problem, {"pc_type": "lu"})
    assert told.krylov_solver.getType() == "preonly"
    monkeypatch.setattr(automatic, "LEAST_KEPT", 10_000)
    assert SNESSolver(problem).krylov_solver.getType() == "preonly"


# Parts


@alone
@pytest.mark.parametrize("cell", CELLS)
def test_springs_hold_bodies_that_are_loose(cell):
    dim = DIMENSION[cell]
    scene = stack(cell, (2, 3))
    problem = build(scene, bcs=lambda V, s: [fix(V, s, "bottom", dim - 1)]).problem
    zone = problem.contact.zones[0].facets
    nodes = np.union1d(zone.slave_surface.dofs, zone.master_surface.dofs)
    dofs = supports(problem.contact, nodes, problem.constrained)
    A = problem.create_matrix()
    problem.volume.add_tangent(A, problem.bcs)
    A.assemble()
    n = problem.contact.layout.n
    K = A.getValues(range(n), range(n))
    assert (np.abs(np.linalg.eigvalsh(K)) < 1e-9 * K.max()).sum() > dim
    K[dofs, dofs] *= 2.0
    assert np.linalg.eigvalsh(K).min() > 1e-6 * K.max()
    # None where conditions hold all
    fixed = np.ones(n, dtype=bool)
    assert len(supports(problem.contact, nodes, fixed)) == 0


@alone
@pytest.mark.parametrize("symmetric", [True, False])
def test_columns_are_those_of_the_inverse(symmetric):
    rng, n = np.random.default_rng(1), 30
    values = rng.random((n, n)) + 10.0 * np.eye(n)
    values = values + values.T if symmetric else values
    K = PETSc.Mat().createAIJ((n, n), nnz=n, comm=PETSc.COMM_SELF)
    K.setValues(range(n), range(n), values)
    K.assemble()
    rows = np.arange(3, n, 2)
    options = PetscOptions(
        "columns_", {"ksp_type": "preonly", "pc_factor_mat_solver_type": "mumps"}
    )
    with options:
        one = Compliance(K, rows, np.array([2]), "columns_")
    at, stiffness = one.springs
    assert stiffness == values[7, 7]
    values[7, 7] *= 2.0
    inverse = np.linalg.inv(values)
    for places in (np.array([0, 4]), np.array([1, 4, 7])):
        assert one.between(places) == pytest.approx(
            inverse[np.ix_(rows[places], rows[places])], rel=1e-12
        )
    assert one.missing(np.arange(len(rows))) == len(rows) - 4
    forces = np.zeros(n)
    forces[rows[4]] = 3.0
    wanted = inverse[rows[[0, 1]], rows[4]] * 3.0
    assert one.displacements(forces, np.array([0, 1])) == pytest.approx(wanted)
    forces[0] = 1.0
    wanted = (inverse @ forces)[rows[[0, 1]]]
    assert one.displacements(forces, np.array([0, 1])) == pytest.approx(wanted)


@alone
def test_bodies_in_other_units_do_not_hide_what_is_not_symmetric():
    """An unsymmetric block beside a stiff one."""
    K = PETSc.Mat().createDense((4, 4), comm=PETSc.COMM_SELF)
    K.setUp()
    values = np.diag([1e13, 1e13, 1.0, 1.0])
    values[2, 3] = 0.5
    K.setValues(range(4), range(4), values)
    K.assemble()
    assert not is_symmetric(K)
    K.setValue(3, 2, 0.5)
    K.assemble()
    assert is_symmetric(K)


@alone
@pytest.mark.quick
@pytest.mark.parametrize("solver", SOLVERS)
def test_factors_are_those_of_mumps(solver):
    """The error that is raised within PETSc's call comes out of it as it is."""
    problem = pressed("quadrilateral").problem
    options = solvers.kept_factors()
    options["kept_pc_factor_mat_solver_type"] = "petsc"
    one = solver(problem, options)
    for call in (one.solve, lambda: corrected(one)):
        with pytest.raises(
            ContactError, match="kept factors come from mumps, not from p"
        ):
            call()


def corrected(solver):
    """A correction by the tangent of the start."""
    x, b = solver.problem.start(), solver.problem.create_vector()
    solver.problem.F(x, b)
    linearise(solver, x, {})
    with solver.options:
        correct(solver, b, b.duplicate())


@alone
def test_memory_does_not_grow_with_factorisations():
    problem = pressed(n=(4, 5)).problem
    solver = SNESSolver(problem, solvers.kept_factors())
    kept = context(solver)

    def again():
        kept._forget()
        problem.contact.u.x.array[:] *= 0.999
        solver.solve()
        with open("/proc/self/statm", encoding="ascii") as pages:
            return int(pages.read().split()[1]) * resource.getpagesize()

    before = [again() for _ in range(5)][-1]
    after = [again() for _ in range(15)][-1]
    assert kept.factorisations == 20
    # A leak of the factors would be more than 10 MB
    assert after - before < 5e6
