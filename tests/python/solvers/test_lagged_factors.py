"""GMRES with the factors of an earlier tangent: Newton's path of the direct solver."""

import re

import numpy as np
import pytest
from dolfinx import fem
from problems import CELLS, COMM, SOLVERS, build, fix, stack, worst
from sliding import Sliding
from snapping import on_bed

from raymortar import (
    AugmentedLagrangian,
    ContactError,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    SNESSolver,
    solvers,
)
from raymortar.core.solvers.linear import linear_options
from raymortar.paths import DisplacementControl
from raymortar.solvers import automatic


def lean(x):
    """Of the top: down, more on one side."""
    return np.hstack([0.0 * x[:, :1], -0.02 + 0.01 * x[:, :1]])


def held(V, scene, down):
    """Conditions of the top. Without friction nothing else holds it sideways."""
    return [fix(V, scene, "top", i, value) for i, value in enumerate((0.0, down))]


METHODS = ["frictionless", "augmented", "penalty"]


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


@pytest.mark.mpi
def test_one_factorisation_serves_three_tangents():
    one = Sliding(COMM, "triangle", 1, "augmented")
    options = {"snes_rtol": 1e-12, **solvers.lagged_factors()}
    solver, taken = SNESSolver(one.problem.problem, options), []
    ksp = solver.krylov_solver
    solver.snes.setMonitor(lambda snes, i, norm: taken.append((i, ksp.its)))
    for t in (0.05, 0.15):
        one.apply(t)
        solver.solve()
    systems = [(i - 1, its) for i, its in taken if i]
    # Exact factors take one iteration, or two with rounding
    assert {its for i, its in systems if i % 3 == 0} <= {1, 2}
    assert min(its for i, its in systems if i % 3) > 2
    assert len(systems) > 5


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
    one = SNESSolver(problem, solvers.lagged_factors(lag=100))
    one.solve()
    u = built.u.x.array.copy()
    scale.value = factor
    contact.set_gamma(2000.0 * factor)
    built.u.x.array[:] = contact.multiplier.x.array[:] = 0.0
    assert one.solve()[0] and worst(built.u.x.array - u) <= 1e-7 * worst(u)


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


@pytest.mark.mpi
def test_a_led_path_is_that_of_the_direct_solver():
    """Its systems are solved with one tangent, and combined."""
    ends = []
    for options in (solvers.direct(), solvers.lagged_factors()):
        scene = on_bed("triangle")
        solver = SNESSolver(scene.problem, options)
        control = DisplacementControl(scene.top, 1, by=-6.0)
        steps = LoadSteps(solver, scene.apply, 12, path=(0.0, 10.0), control=control)
        path = steps.run()
        ends.append(([step.factor for step in path], scene.u.x.array.copy()))
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
        # Before it comes what is out of balance, of an iterate by a singular matrix
        said.append(re.sub(r"[-+.\d]+(e[-+]\d+)?", "", str(error.value).split(";")[-1]))
        # What is held again is solved again
        built.problem.bcs = held
        built.contact.restore(state)
        assert solver.solve()[1]
    assert said[0] == said[1] and "held by nothing along x" in said[0]


@pytest.mark.mpi
def test_it_is_the_choice_of_snes_for_problems_of_some_size(monkeypatch):
    problem = build(
        stack("triangle", (2, 3)),
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom")],
    ).problem

    def chosen(given=None, snes=True):
        return linear_options(problem, given, "none_", snes=snes)

    assert chosen() == solvers.direct()
    size = problem.contact.layout.size_global
    monkeypatch.setattr(automatic, "LAGGED", {2: (size, size)})
    package = "umfpack" if COMM.size == 1 else "mumps"
    wanted = solvers.lagged_factors(package)
    assert chosen() == wanted
    # DOLFINx's solver keeps no factors
    assert chosen(snes=False) == solvers.direct()
    # What completes the choice does not replace it
    assert chosen({"snes_lag_preconditioner": 7}) == wanted
    assert chosen({"pc_type": "lu"}) == solvers.direct()


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda: solvers.lagged_factors(7), "package must be the name of a solver"),
        (lambda: solvers.lagged_factors(lag=3.5), "lag = 3.5 must be"),
        (lambda: solvers.lagged_factors(lag=0), "lag = 0 must be"),
    ],
)
def test_wrong_options_are_refused(wrong, message):
    with pytest.raises(ContactError, match=message):
        wrong()


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
