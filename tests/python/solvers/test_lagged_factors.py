"""GMRES with the factors of an earlier tangent: Newton's path of the direct solver."""

import re

import numpy as np
import pytest
from dolfinx import fem
from problems import CELLS, COMM, SOLVERS, build, fix, residual, stack, worst
from sliding import Sliding
from snapping import on_bed

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    SNESSolver,
    Tie,
    rigid,
    solvers,
)
from raymortar.core import compat
from raymortar.paths import DisplacementControl
from raymortar.solvers import automatic
from raymortar.solvers.automatic import linear_options
from raymortar.solvers.lagging_factors import LaggedFactorsSolver


def lean(x):
    """Of the top: down, more on one side."""
    return np.hstack([0.0 * x[:, :1], -0.02 + 0.01 * x[:, :1]])


def held(V, scene, down):
    """Conditions of the top. Without friction nothing else holds it sideways."""
    return [fix(V, scene, "top", i, value) for i, value in enumerate((0.0, down))]


METHODS = ["frictionless", "augmented", "penalty"]


def context(solver):
    return solver.krylov_solver.getPythonContext()


def slid(cell, degree, method, options, steps=7):
    """The slide of a block, its solver, and Newton iterations of each step."""
    one = Sliding(COMM, cell, degree, method)
    one.solver = SNESSolver(
        one.problem.problem, {"snes_rtol": 1e-12, "snes_max_it": 40, **options}
    )
    counts = []
    for t in np.linspace(0.0, 1.0, 17)[1 : steps + 1]:
        one.apply(t)
        counts.append(one.solver.solve()[0])
        one.contact.advance()
    return one, counts


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("cell, degree", [*((c, 1) for c in CELLS), ("triangle", 2)])
def test_a_slide_is_that_of_the_direct_solver(cell, degree, method):
    direct, wanted = slid(cell, degree, method, solvers.direct())
    one, counts = slid(cell, degree, method, solvers.lagged_factors())
    u, v = (x.contact.u.x.array for x in (one, direct))
    assert worst(u - v) <= 1e-9 * worst(v)
    assert np.abs(np.subtract(counts, wanted)).max() <= 1
    lagged = context(one.solver)
    assert lagged.systems == sum(counts)
    # New rows of slave facets have met the master on the way: the pattern has changed
    assert 1 <= lagged.factorisations <= 0.7 * lagged.systems


@pytest.mark.mpi
@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_another_stiffness_is_factorised_at_once(factor):
    """Of an old stiffness, factors make small residuals of wrong solutions."""
    scene = stack("quadrilateral", (3, 4))
    scale = fem.Constant(scene.mesh, 1.0)
    built = build(
        scene,
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), *held(V, s, -0.02)],
        method=AugmentedLagrangian(2000.0),
    )
    given = built.problem
    form, contact = scale * given.forms[0], given.contact
    problem = NonlinearProblem(form, contact, given.bcs)
    one = SNESSolver(problem, solvers.lagged_factors())
    one.solve()
    lagged, u = context(one), built.u.x.array.copy()
    before = lagged.systems - lagged.factorisations
    scale.value = factor
    contact.set_gamma(2000.0 * factor)
    built.u.x.array[:] = contact.multiplier.x.array[:] = 0.0
    counts = one.solve()[0]
    assert counts and worst(built.u.x.array - u) <= 1e-7 * worst(u)
    tried = lagged.systems - lagged.factorisations - before
    assert tried <= counts - 1 and lagged.factorisations >= 2


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_either_solver_takes_the_options(solver):
    found = []
    for options in (solvers.direct(), solvers.lagged_factors()):
        built = build(
            stack("quadrilateral", (3, 4)),
            material="neo-hookean",
            bcs=lambda V, s: [fix(V, s, "bottom"), *held(V, s, -0.02)],
            friction=Coulomb(0.3),
        )
        one = solver(built.problem, options)
        found.append((one.solve()[0], built.problem.start().array.copy()))
    assert abs(found[0][0] - found[1][0]) <= 1
    assert worst(found[1][1] - found[0][1]) <= 1e-9 * worst(found[0][1])
    assert context(one).systems == found[1][0] > context(one).factorisations


def interactions(kind, u, scene):
    """A tie of two blocks, alone or on a rigid plane, or contact of both."""
    tags, facets = scene.tags, scene.facet_tags
    blocks = [(tags["top_0"], tags["bottom_1"])]
    normal = AugmentedLagrangian(multiplier="normal")
    if kind == "contact":
        return [Contact(u, facets, blocks, normal)]
    made = [Tie(u, facets, blocks)]
    if kind == "tie on a plane":
        plane = rigid.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        made.append(Contact(u, facets, [(tags["bottom_0"], plane)], normal))
    return made


@pytest.mark.mpi
@pytest.mark.parametrize(
    "kind, factors",
    [("tie", "cholesky"), ("tie on a plane", "cholesky"), ("contact", "lu")],
)
def test_symmetric_tangents_are_factorised_as_such(kind, factors):
    """Once points move with two bodies, the tangent is not symmetric."""
    scene, found = stack("hexahedron", (3, 4)), []
    each = solvers.lagged_factors(lagged_most=0)  # factorises each tangent
    for options in (solvers.direct(), each):
        V = compat.vector_space(scene.mesh, 1)
        u = fem.Function(V)
        F, _, _ = residual(scene, u, "neo-hookean")
        down = [0.0, 0.002, -0.02]
        bcs = [fix(V, scene, "top_1", i, value) for i, value in enumerate(down)]
        if kind != "tie on a plane":
            bcs.append(fix(V, scene, "bottom_0"))
        problem = NonlinearProblem(F, interactions(kind, u, scene), bcs)
        solver = SNESSolver(problem, {"snes_rtol": 1e-12, **options})
        solver.solve()
        found.append(u.x.array)
    assert context(solver).direct.getPC().getType() == factors
    assert worst(found[0] - found[1]) < 1e-9 * worst(found[0])


@pytest.mark.parametrize(
    "own, factors", [({}, "cholesky"), ({"direct_pc_type": "lu"}, "lu")]
)
def test_factors_of_a_given_type_stay(own, factors):
    scene = stack("quadrilateral", (3, 4))
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    F, _, _ = residual(scene, u, "linear")
    V = u.function_space
    bcs = [fix(V, scene, "bottom_0"), *held(V, scene, -0.02)]
    problem = NonlinearProblem(F, interactions("tie", u, scene), bcs)
    solver = SNESSolver(problem, solvers.lagged_factors(**own))
    solver.solve()
    assert context(solver).direct.getPC().getType() == factors


@pytest.mark.mpi
@pytest.mark.parametrize("most, least", [(0, 1.0), (1, 0.8)])
def test_factors_are_made_again_where_gmres_stalls(most, least):
    """One iteration is enough for next to no system."""
    options = solvers.lagged_factors(lagged_most=most)
    one, counts = slid("triangle", 1, "augmented", options)
    assert context(one.solver).factorisations >= least * sum(counts)


@pytest.mark.mpi
def test_monitors_see_the_iterations():
    one = Sliding(COMM, "triangle", 1, "augmented")
    solver = SNESSolver(one.problem.problem, solvers.lagged_factors())
    ksp, seen, taken = solver.krylov_solver, [], []
    ksp.setMonitor(lambda ksp, i, norm: seen.append(i))
    solver.snes.setMonitor(lambda snes, i, norm: taken.append(ksp.its if i else 0))
    for t in (0.05, 0.15):
        one.apply(t)
        solver.solve()
    # Those of each system count from 0; a direct solution is one, seen as 0
    ends = [i for i, j in zip(seen, [*seen[1:], 0]) if j == 0]
    wanted = [its for its in taken if its]
    assert len(ends) == len(wanted) == context(solver).systems
    assert sum(i == j for i, j in zip(ends, wanted)) >= len(ends) // 2
    assert set(np.subtract(wanted, ends)) <= {0, 1}


@pytest.mark.mpi
def test_a_second_system_of_a_factorised_tangent_needs_no_gmres():
    one, _ = slid("triangle", 1, "augmented", solvers.lagged_factors(), steps=1)
    solver = one.solver
    lagged, A = context(solver), solver.A
    b, x = A.createVecRight(), A.createVecRight()
    b.set(1.0)
    A.scale(1.0)  # another tangent, for all that PETSc knows
    lagged._most = 0
    solver.krylov_solver.solve(b, x)
    before = lagged._taken, lagged.factorisations
    b.scale(2.0)
    solver.krylov_solver.solve(b, x)
    assert (lagged._taken, lagged.factorisations) == before
    assert (A * x - b).norm() <= 1e-8 * b.norm()


@pytest.mark.mpi
def test_a_led_path_is_that_of_the_direct_solver():
    """Its systems are solved with one tangent and combined."""
    ends = []
    for options in (solvers.direct(), solvers.lagged_factors()):
        scene = on_bed("triangle")
        solver = SNESSolver(scene.problem, options)
        control = DisplacementControl(scene.top, 1, by=-6.0)
        steps = LoadSteps(solver, scene.apply, 12, path=(0.0, 10.0), control=control)
        path = steps.run()
        ends.append(([step.factor for step in path], scene.u.x.array.copy()))
    # Three systems with each tangent, which the direct solver factorises once
    lagged = context(solver)
    assert lagged.factorisations <= lagged.systems // 3 + 2
    assert ends[1][0] == pytest.approx(ends[0][0], rel=1e-8)
    assert worst(ends[1][1] - ends[0][1]) <= 1e-8 * worst(ends[0][1])


@pytest.mark.mpi
def test_a_failure_says_what_the_direct_solver_says():
    """The upper block is let go where nothing rubs, and pushed aside: no earlier factors
    may hide that."""
    said = []
    for options in (solvers.direct(), solvers.lagged_factors()):
        built = build(
            stack("quadrilateral", (3, 4)),
            bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=lean)],
            loaded=("top",),
        )
        solver = SNESSolver(built.problem, options)
        solver.solve()
        held, state = built.problem.bcs, built.contact.state()
        built.problem.bcs = held[:1]
        built.load.value[:] = [[0.0, 10.0], [0.0, -1.0]]
        with pytest.raises(ConvergenceError) as error:
            solver.solve()
        # All but the numbers, which are of a singular matrix
        said.append(re.sub(r"[-+.\d]+(e[-+]\d+)?", "", str(error.value).split(":")[-1]))
        # What is held again is solved again
        built.problem.bcs = held
        built.contact.restore(state)
        assert solver.solve()[1]
    assert said[0] == said[1] and "held by nothing along x" in said[0]


@pytest.mark.mpi
def test_it_is_the_choice_for_problems_of_some_size(monkeypatch):
    problem = build(
        stack("triangle", (2, 3)),
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom")],
    ).problem
    assert linear_options(problem, None, "none_") == solvers.direct()
    size = problem.contact.layout.size_global
    monkeypatch.setattr(automatic, "LAGGED", {2: (size, size)})
    package = "umfpack" if COMM.size == 1 else "mumps"
    wanted = solvers.lagged_factors(package)
    assert linear_options(problem, None, "none_") == wanted
    # What completes the choice does not replace it
    assert linear_options(problem, {"lagged_most": 7}, "none_") == wanted
    given = {"pc_type": "lu"}
    assert linear_options(problem, given, "none_") == solvers.direct()


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda: solvers.lagged_factors(7), "package must be the name of a solver"),
        (lambda: solvers.lagged_factors(lagged_most=3.5), "lagged_most = 3.5 must be"),
        (lambda: solvers.lagged_factors(lagged_most=-1), "lagged_most = -1 must be"),
    ],
)
def test_wrong_options_are_refused(wrong, message):
    with pytest.raises(ContactError, match=message):
        wrong()


@pytest.mark.mpi
def test_a_solver_learns_where_gmres_fails():
    """It is tried less and less often, and again once it has done well."""
    lagged = LaggedFactorsSolver()
    lagged._has_factors, lagged._most = True, 10**6
    tried = []
    for number in range(60):
        if lagged.may_try():
            tried.append(number)
            lagged.learn(converged=False)
    assert tried[:2] == [0, 1]
    assert np.diff(tried).tolist() == [1, 2, 3, 5, 9, 17, 17]
    lagged.learn(converged=True)
    assert lagged.may_try() and lagged.may_try()


@pytest.mark.mpi
@pytest.mark.parametrize("options", [solvers.direct(), solvers.lagged_factors()])
@pytest.mark.parametrize("turns", (1, 2))
def test_solvers_that_share_a_matrix_see_its_new_pattern(options, turns):
    """As the line search of load steps does: one extends the pattern, both go on."""
    one = Sliding(COMM, "triangle", 1, "augmented")
    first = SNESSolver(one.problem.problem, {"snes_max_it": 40, **options})
    other = SNESSolver(
        one.problem.problem, {"snes_max_it": 40, **options}, matrix=first.A
    )
    for k, t in enumerate(np.linspace(0.0, 1.0, 17)[1:]):
        one.apply(t)
        assert (first, other)[k // turns % 2].solve()[1]
        one.contact.advance()
    assert one.contact.statistics.preallocations > 3
