"""Paths led by a displacement or by their own length, the load factor an unknown."""

import sys
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, SOLVERS, worst
from snapping import on_bed, pressure, top_sinks

from raymortar import ConvergenceError, Coulomb, History, LoadSteps, Penalty
from raymortar.paths import ArcLength, DisplacementControl, soft_start
from raymortar.paths.strategy import FULL, VISCOUS

sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))

from models import snap_through  # noqa: E402

BY = -6.0


def led(problem, steps=12, history=None, by=BY, **options):
    """Steps of the top's displacement."""
    dim = len(problem.u)
    control = DisplacementControl(problem.top, dim - 1, by=by)
    return LoadSteps(
        problem.solver,
        problem.apply,
        steps,
        path=(0.0, 10.0),
        history=history,
        control=control,
        **options,
    )


def bed_depth(problem):
    """How deep the bottom is in the bed."""
    return worst(mean(problem.u, problem.scene, "bottom"))


def mean(u, scene, name):
    """Mean of the last component on a flat part of the boundary. Collective."""
    ds = ufl.Measure("ds", scene.mesh, subdomain_data=scene.facet_tags)
    form = u[len(u) - 1] * ds(scene.tags[name])
    return COMM.allreduce(fem.assemble_scalar(fem.form(form)))


def is_on_the_path(problem, factors, sinks):
    """Whether load and displacement are those of the closed form."""
    for t, down in zip(factors, sinks):
        w = np.linspace(0.0, 7.0, 70001)
        k = np.argmin(np.abs(top_sinks(w) - down))
        # Two Newton steps from there
        x = w[k]
        for _ in range(4):
            slope = (top_sinks(x + 1e-6) - top_sinks(x - 1e-6)) / 2e-6
            x -= (top_sinks(x) - down) / slope
        assert abs(t - pressure(x)) <= 1e-8


# A closed form


@pytest.mark.quick
@pytest.mark.mpi(where=lambda cell, solver: cell == "triangle" and solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_displacement_leads_over_both_limit_points(cell, solver):
    problem = on_bed(cell, solver=solver)
    history = History(problem.problem)
    steps = led(problem, history=history)
    path = steps.run()
    assert len(path) == 12 and steps.halvings == 0
    np.testing.assert_allclose(history["controlled"], np.arange(1, 13) * BY / 12)
    np.testing.assert_allclose(history["time"], np.arange(1, 13) / 12)
    factors = history["load_factor"]
    assert [step.factor for step in path] == list(factors)
    # Load rises, falls and rises
    signs = np.sign(np.diff(factors))
    assert np.count_nonzero(np.diff(signs)) == 2
    is_on_the_path(problem, factors, -history["controlled"])


@pytest.mark.mpi(where=lambda solver, **_: solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_springs_of_a_penalty_take_part(cell_2d, solver):
    """The bed's pressure at its depth is the load, whatever contact lets pass."""
    problem = on_bed(cell_2d, solver=solver, method=Penalty())
    for step in led(problem):
        assert abs(pressure(bed_depth(problem)) - step.factor) <= 1e-8


@pytest.mark.mpi(where=lambda psi, solver, **_: solver is SOLVERS[0] and psi == 0.0)
@pytest.mark.parametrize("psi", [0.0, 0.3])
@pytest.mark.parametrize("solver", SOLVERS)
def test_an_arc_leads_to_the_end_of_the_path(psi, solver):
    problem = on_bed("triangle", solver=solver)
    history = History(problem.problem)
    steps = LoadSteps(
        problem.solver,
        problem.apply,
        40,
        path=(0.0, 15.0),
        largest=4,
        history=history,
        control=ArcLength(psi=psi),
    )
    sinks = []
    for _ in steps:
        sinks.append(-mean(problem.u, problem.scene, "top"))
    factors = history["load_factor"]
    assert factors[-1] == 15.0 and steps.halvings == 0
    signs = np.sign(np.diff(factors))
    assert np.count_nonzero(np.diff(signs)) == 2
    is_on_the_path(problem, factors, sinks)
    # What leads is the length of the path, as a displacement is of the other control
    assert list(history["controlled"]) == list(history["time"])
    # Path lengths grow by the radius, four times the first at most
    lengths = np.diff(history["time"], prepend=0.0)
    assert (lengths > 0.0).all() and lengths.max() <= 4.0 * lengths[0] * (1 + 1e-8)


@pytest.mark.mpi
def test_an_arc_has_its_length():
    problem = on_bed("quadrilateral")
    V = problem.u.function_space
    nodes, last, at = V.dofmap.index_map.size_global, problem.u.x.array.copy(), 0.0
    owned = 2 * V.dofmap.index_map.size_local
    control = ArcLength(radius=0.2, psi=0.1)
    for k, step in enumerate(
        LoadSteps(problem.solver, problem.apply, path=(0.0, 15.0), control=control)
    ):
        change = (problem.u.x.array - last)[:owned]
        moved = COMM.allreduce(change @ change) / nodes
        square = moved + (0.1 * (step.factor - at)) ** 2
        assert square**0.5 == pytest.approx(0.2, rel=1e-8)
        last, at = problem.u.x.array.copy(), step.factor
        if k == 4:
            break


@pytest.mark.mpi
def test_the_same_path_whatever_names_the_displacement():
    found = []
    for name in ("dofs", "function", "point", "vector", "functional"):
        problem = on_bed("triangle")
        ds = ufl.Measure("ds", subdomain_data=problem.scene.facet_tags)
        where, direction = {
            "dofs": (problem.top, 1),
            "function": (lambda x: np.isclose(x[1], 2.0), 1),
            "point": ((0.51, 2.1), 1),
            "vector": (problem.top, (0.0, 1.0)),
            "functional": (problem.u[1] * ds(problem.scene.tags["top"]), None),
        }[name]
        control = DisplacementControl(where, direction, by=BY)
        steps = LoadSteps(
            problem.solver, problem.apply, 6, path=(0.0, 10.0), control=control
        )
        found.append([step.factor for step in steps])
    for factors in found[1:]:
        np.testing.assert_allclose(factors, found[0], rtol=1e-9)


# Prescribed displacements


@pytest.mark.mpi
def test_the_load_factor_may_be_a_displacement():
    """Lifted conditions: the top's displacement t leads to that of the bed."""
    problem = on_bed("triangle", prescribed=True)
    bottom = lambda x: np.isclose(x[1], 0.0)  # noqa: E731
    control = DisplacementControl(bottom, 1, by=-5.0)
    steps = LoadSteps(
        problem.solver, problem.apply, 5, path=(0.0, 5.0), control=control
    )
    for k, step in enumerate(steps, 1):
        assert step.factor == pytest.approx(top_sinks(float(k)), rel=1e-9)


# Contact that opens and closes


@pytest.mark.mpi(where=lambda solver, **_: solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_free_body_is_led_over_a_gap(solver):
    """What leads is held, so that nothing else need hold it."""
    problem = on_bed("quadrilateral", solver=solver, gap=0.3)
    history = History(problem.problem)
    steps = led(problem, history=history, by=BY - 0.3)
    steps.run()
    sinks, factors = -history["controlled"], history["load_factor"]
    flies = sinks < 0.3
    assert np.abs(factors[flies]).max(initial=0.0) <= 1e-9
    is_on_the_path(problem, factors[~flies], sinks[~flies] - 0.3)


ARCHES = {
    "multiplier": {},
    "friction": {"friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(), "friction": Coulomb(0.3)},
}


@pytest.mark.mpi(where=lambda kind, **_: kind == "multiplier")
@pytest.mark.parametrize("kind", ARCHES)
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_punch_presses_an_arch_through(kind, solver):
    """The force falls and rises; it is the reaction where the same node's displacement
    is prescribed."""
    options, by = {**ARCHES[kind], "solver": solver}, -snap_through.PUSH
    held = snap_through.Arch(COMM, prescribed=True, **options)
    reactions = History(held.problem, reactions={"node": held.support})
    LoadSteps(held.solver, held.apply, 24, history=reactions).run()
    pressed = snap_through.Arch(COMM, **options)
    forces = History(pressed.problem)
    control = DisplacementControl(pressed.node, 1, by=by)
    steps = LoadSteps(
        pressed.solver, pressed.apply, 24, history=forces, control=control
    )
    steps.run()
    assert steps.halvings == 0
    force = snap_through.FORCE * forces["load_factor"]
    assert np.abs(force + reactions["reaction_node_y"]).max() <= 1e-8
    assert worst(pressed.u.x.array - held.u.x.array) <= 1e-8
    top = np.argmax(force[:10])
    low = top + np.argmin(force[top:])
    assert force[low] < 0.4 * force[top] < force[-1]


@pytest.mark.mpi
def test_steps_of_the_force_jump():
    """Nothing holds the punch before it touches; viscous forces do."""
    plain = snap_through.Arch(COMM)
    with pytest.raises(ConvergenceError):
        LoadSteps(plain.solver, plain.apply, 20, max_halvings=2, strategy="halve").run()
    viscous = snap_through.Arch(COMM)
    history = History(viscous.problem)
    path = LoadSteps(viscous.solver, viscous.apply, 10, stabilize=True, history=history)
    path.run()
    assert path.halvings == 0 and history["viscous_share"].max() <= 1e-6
    default = snap_through.Arch(COMM)
    used = [s.strategy for s in LoadSteps(default.solver, default.apply, 10)]
    assert VISCOUS in used and FULL in used
    assert worst(default.u.x.array - viscous.u.x.array) <= 1e-6
    led_there = snap_through.Arch(COMM)
    control = ArcLength(0.05, psi=1.0)
    held = DisplacementControl(led_there.node, 1, by=-0.2)
    # Over the gap by the punch, then along the path
    at = LoadSteps(led_there.solver, led_there.apply, 2, control=held).run()[-1].factor
    LoadSteps(
        led_there.solver, led_there.apply, path=(at, 1.0), control=control, largest=4
    ).run()
    assert worst(led_there.u.x.array - viscous.u.x.array) <= 1e-6


# Failures and restarts


@pytest.mark.mpi
def test_a_step_that_fails_is_halved(monkeypatch):
    problem, failures = on_bed("triangle"), iter([True])
    steps = led(problem, 6, strategy="halve")
    solve = type(problem.problem).J

    def failing(self, x, A):
        if next(failures, False):
            raise ConvergenceError("it fails")
        return solve(self, x, A)

    monkeypatch.setattr(type(problem.problem), "J", failing)
    path = steps.run()
    assert steps.halvings == 1 and len(path) == 7
    assert bed_depth(problem) == pytest.approx(5.4, abs=0.2)


@pytest.mark.mpi
def test_after_a_failure_loads_and_state_are_the_accepted_ones():
    problem = on_bed("triangle")
    path = iter(led(problem, 6, max_halvings=0))
    step = next(path)
    u = problem.u.x.array.copy()
    problem.solver.tolerances = 1e-30, 1e-30
    with pytest.raises(ConvergenceError, match="the step after load factor"):
        next(path)
    assert np.array_equal(problem.u.x.array, u)
    assert problem.load.value == pytest.approx(step.factor, rel=1e-12)


@pytest.mark.mpi
def test_a_path_goes_on_where_it_was_left():
    whole = [step.factor for step in led(on_bed("triangle"), 6)]
    problem = on_bed("triangle")
    parts = [step.factor for step in led(problem, 3, by=BY / 2)]
    control = DisplacementControl(problem.top, 1, by=BY / 2)
    parts += [
        step.factor
        for step in LoadSteps(
            problem.solver, problem.apply, 3, path=(parts[-1], 10.0), control=control
        )
    ]
    np.testing.assert_allclose(parts, whole, rtol=1e-9)


@pytest.mark.mpi
def test_an_arc_may_set_out_falling():
    problem = on_bed("triangle")
    *_, last = led(problem, 4, by=-3.0)
    control = ArcLength(radius=0.1, falling=True)
    steps = LoadSteps(
        problem.solver, problem.apply, path=(last.factor, 15.0), control=control
    )
    assert next(iter(steps)).factor < last.factor


@pytest.mark.mpi
def test_a_path_without_an_end_says_so():
    problem = on_bed("triangle")
    control = ArcLength(radius=0.01, most=3)
    steps = LoadSteps(problem.solver, problem.apply, path=(0.0, 15.0), control=control)
    with pytest.raises(ConvergenceError, match="has not met its end at 15"):
        steps.run()


@pytest.mark.quick
def test_a_soft_start_leads_to_the_same_path(monkeypatch):
    """Its rough solves have the tolerances of the solver, which are back after them."""
    expected = [step.factor for step in led(on_bed("triangle"), 4)]
    solve, rough = soft_start.SoftStart.solve, []
    monkeypatch.setattr(soft_start, "MANY", 1)
    monkeypatch.setattr(soft_start, "BENDS", np.inf)
    monkeypatch.setattr(
        soft_start.SoftStart, "solve", lambda *given: rough.append(solve(*given)) or 0
    )
    problem = on_bed("triangle")
    before = problem.solver.tolerances
    found = [step.factor for step in led(problem, 4)]
    assert rough  # in the third step
    assert found == pytest.approx(expected, rel=1e-8)
    assert problem.solver.tolerances == before
