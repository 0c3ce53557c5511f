"""Energy balance of steps: ways that are not asked for may not jump."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from load_paths import top_moves
from problems import SOLVERS
from rigid_scenes import press
from snapping import BED, E, on_bed, pressure, top_sinks
from worn import Pressed

from raymortar import (
    ContactWarning,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    Penalty,
    SNESSolver,
    rigid,
)
from raymortar.fluxes import Archard, Wear
from raymortar.paths.energy_balance import MISSING, RIPPLE, Balance, balance_of_step
from raymortar.paths.load_path import PrescribedPath, StepSizes
from raymortar.paths.strategies import Strategies
from raymortar.paths.strategy import FULL, VISCOUS
from raymortar.paths.ways import FadingForces, SmallGamma
from raymortar.results.sums import slip_work


def depths(load):
    """Of the bed under a load: before the limit, on the falling branch, behind it."""
    return np.sort(np.roots(BED - [0.0, 0.0, 0.0, load]).real)


def stored(w):
    """Energy of both blocks and the bed."""
    blocks = 0.5 * pressure(w) ** 2 * sum(1.0 / e for e in E.values())
    return blocks + np.polyval(np.polyint(BED), w)


def put(found, w):
    """The equilibrium in which the bed is w deep."""
    V, p = found.u.function_space, pressure(w)

    def displacement(x):
        y = x[V.mesh.geometry.dim - 1]
        below, above = np.minimum(y, 1.0) / E["lower"], np.maximum(y - 1.0, 0.0)
        values = np.zeros((V.mesh.geometry.dim, x.shape[1]))
        values[-1] = -w - p * (below + above / E["upper"])
        return values

    found.u.interpolate(displacement)
    found.problem.contact.multiplier.x.array[:] = -p
    found.problem.contact.update()


def gained(begin, end):
    """Work of the top's load in excess of stored energy, for the loads of both ends."""
    way = top_sinks(end) - top_sinks(begin)
    return np.array([pressure(w) * way for w in (begin, end)]) - (
        stored(end) - stored(begin)
    )


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
@pytest.mark.parametrize("prescribed", [False, True])
@pytest.mark.parametrize(
    "begin, end", [(0.4, 0.5), (1.0, 4.7), (4.7, 1.0), tuple(depths(4.5)[:2])]
)
def test_the_balance_is_that_of_the_closed_form(cell, prescribed, begin, end):
    """Work of a load, and of a top that is moved."""
    found = on_bed(cell, prescribed=prescribed)

    def apply(t, size):
        found.apply(top_sinks(t) if prescribed else pressure(t))

    path = PrescribedPath(found.solver, apply, (begin, end), StepSizes(1, 0, 1, 5))
    path.begin()
    put(found, begin)
    state = found.problem.contact.state()
    put(found, end)
    u = found.u.x.array.copy()
    balance = balance_of_step(found.problem, path, state)
    exact = gained(begin, end)
    assert balance.most == pytest.approx(exact.max(), abs=1e-12)
    assert balance.least == pytest.approx(exact.min(), abs=1e-12)
    assert balance.lacks_energy == (exact.max() < -MISSING * balance.size)
    assert np.array_equal(u, found.u.x.array)


@pytest.mark.mpi
def test_the_balance_leaves_what_slaves_have_faced():
    """A step that carries bodies far is judged by the masters that it has met there."""
    found, (begin, end) = on_bed("triangle"), (0.4, 0.5)
    sizes = StepSizes(1, 0, 1, 5)
    path = PrescribedPath(
        found.solver, lambda t, _: found.apply(pressure(t)), (begin, end), sizes
    )
    path.begin()
    put(found, begin)
    found.problem.contact.advance()
    state = found.problem.contact.state()
    put(found, end)
    zones = found.problem.contact.zones
    faced = [replace(zone.opposite, gap=zone.opposite.gap - 1.0) for zone in zones]
    for zone, one in zip(zones, faced):
        zone.opposite = one
    balance_of_step(found.problem, path, state)
    for zone, one in zip(zones, faced):
        assert np.array_equal(zone.opposite.gap, one.gap)
    assert found.problem.comm.allreduce(sum(len(one.gap) for one in faced)) > 0


def jumping(monkeypatch, first, last, depth):
    """A path of loads whose last step is solved by nothing but a jump to a depth."""
    found = on_bed("triangle")
    given = Strategies._as_given

    def fails(self, *state):
        if self._path.next == last:
            found.problem.convergence.norms[:] = [1.0, np.nan]
            raise ConvergenceError("it cycles")
        return given(self, *state)

    def solve(way, first):
        put(found, depth)
        return 1

    monkeypatch.setattr(Strategies, "_as_given", fails)
    monkeypatch.setattr(SmallGamma, "is_of_use", lambda _: False)
    monkeypatch.setattr(FadingForces, "is_of_use", lambda _: True)
    monkeypatch.setattr(FadingForces, "solve", solve)
    put(found, depths(first)[0])
    found.problem.contact.advance()
    return LoadSteps(found.solver, found.apply, 1, 1, path=(first, last))


@pytest.mark.mpi
def test_a_jump_that_needs_energy_is_refused(monkeypatch):
    """Up to the falling branch: no load supplies the energy."""
    path, steps = [], jumping(monkeypatch, 4.4, 4.5, depths(4.5)[1])
    with pytest.raises(ConvergenceError, match="it cycles"):
        for step in steps:
            path.append((step.factor, step.strategy, step.released))
    assert path == [(4.45, FULL, None)]


def test_a_step_in_which_nothing_happens_lacks_nothing():
    """Its energies are rounding of what the bodies hold."""
    nothing = Balance(most=-3e-18, least=-3e-18, size=3e-18, ripple=0.0, held=1.0)
    assert not nothing.lacks_energy
    assert replace(nothing, held=1e-12).lacks_energy


@pytest.mark.mpi
def test_a_snap_is_told_once(monkeypatch):
    """The load at the step's start bounds its work from below."""
    begin, end = depths(4.8)[0], depths(4.9)[2]
    steps = jumping(monkeypatch, 4.8, 4.9, end)
    with pytest.warns(ContactWarning, match="a snap was passed") as caught:
        path = steps.run()
    told = [one for one in caught if "snap" in str(one.message)]
    assert len(told) == 1 and path[-1].strategy == VISCOUS
    assert path[-1].released == pytest.approx(sorted(gained(begin, end)), rel=1e-9)


@pytest.mark.parametrize("first", [4.98, 4.8, 4.4, 2.0, 0.1])
def test_bounds_enclose_what_a_snap_sets_free(first, monkeypatch):
    """The bed's largest load is within the step, wherever that begins."""
    last, crest = 5.1, np.roots(np.polyder(BED)).min()
    largest = pressure(crest)
    roots = np.roots(BED - [0.0, 0.0, 0.0, last])
    end, begin = roots[np.abs(roots.imag) < 1e-9].real[0], depths(first)[0]
    exact = gained(crest, depths(largest)[-1]).mean()
    steps = jumping(monkeypatch, first, last, end)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        least, most = steps.run()[-1].released
    assert 0.0 <= least <= exact <= most
    # They part by as much as the loads of the step may supply
    way = top_sinks(end) - top_sinks(begin)
    assert most - least <= (last - first) * way * (1.0 + 1e-9)
    # Far below the largest load nothing tells a snap from bodies that give way
    is_sure = first > 4.5
    assert (least > 0.0) == is_sure
    assert any("a snap was passed" in str(one.message) for one in caught) == is_sure


@pytest.mark.mpi
@pytest.mark.parametrize("x, turn, refused", [(-0.1, -1.5, True), (0.1, -0.2, False)])
def test_a_disc_does_not_move_against_its_loads(x, turn, refused):
    """It turns against its moment, or rolls. The block stores the same: what the disc
    does is work of its force and moment, less what friction takes where it slips."""
    disc = rigid.Body(rigid.Circle((0.5, 1.5), 0.5), free=("x", "y", "r"))
    found = press("quadrilateral", disc, friction=Coulomb(0.3))
    loads = np.array([0.05, -0.5]), 0.02
    disc.force, disc.moment = loads
    SOLVERS[0](found.problem).solve()
    found.contact.advance()
    path = PrescribedPath(None, lambda t, size: None, (0.0, 1.0), StepSizes(1, 0, 1, 5))
    state, way = found.contact.state(), np.array([x, 0.0, turn])
    disc.freedom.values = disc.freedom.values + way
    found.contact.update()
    balance = balance_of_step(found.problem, path, state)
    work = loads[0] @ way[:2] + loads[1] * way[2]
    friction = max(slip_work(found.contact.surfaces.zones), 0.0)
    assert balance.most == pytest.approx(work - friction, rel=1e-6)
    assert balance.lacks_energy == refused


STARTS = ("interference", "moved before", "overlap")


@pytest.mark.mpi(where=lambda start, **_: start == "interference")
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_what_presses_without_a_load_supplies_its_energy(start, mu, monkeypatch):
    """An interference that grows, a tool that was moved before the path, and one that
    lies in the slave from the first: all ways may solve these."""
    depth = 0.05
    tool = rigid.Body(rigid.Circle((0.5, 1.9 - depth * (start == "overlap")), 0.9))
    found = press("quadrilateral", tool, n=8, friction=Coulomb(mu) if mu else None)
    if start == "moved before":
        found.contact.update()
        tool.move((0.0, -depth))

    def apply(t):
        if start == "interference":
            found.contact.set_offset(-depth * t)

    watched, steps = Watched(monkeypatch), 2 if start == "interference" else 1
    LoadSteps(SNESSolver(found.problem), apply, steps, progress=False).run()
    assert len(watched.steps) == steps
    for balance in watched.steps:
        assert not balance.lacks_energy and not balance.has_snapped
    first = watched.steps[0]
    # Of forces that grow in proportion half of the larger work is stored
    stored = first.size / 3.0
    assert stored < 2.0 * first.most < 3.0 * stored


class Watched:
    """Balances of the steps of a path, all solved as they are."""

    def __init__(self, monkeypatch):
        self.steps, given = [], Strategies._as_given

        def watched(strategies, now, last, ratio):
            iterations = given(strategies, now, last, ratio)
            problem = strategies.solver.problem
            self.steps.append(balance_of_step(problem, strategies._path, now))
            return iterations

        monkeypatch.setattr(Strategies, "_as_given", watched)


@pytest.mark.mpi(where=lambda n, **_: n == 12)
@pytest.mark.parametrize("n, steps", [(12, 4), (24, 4), (24, 8)])
def test_a_wheel_that_rolls_lacks_no_energy_but_for_its_ripple(n, steps, monkeypatch):
    """Over straight facets: forces ripple, less with finer ones."""
    wheel = rigid.Body(
        rigid.Circle((0.35, 1.2), 0.2), free=("x", "y"), force=(0.0, -0.25)
    )
    found = press("quadrilateral", wheel, n=n, friction=Coulomb(0.6))
    solver = SNESSolver(found.problem)
    LoadSteps(solver, lambda t: None, 1).run()
    seen = Watched(monkeypatch)

    def roll(t):
        wheel.move(rotation=-0.5 * t)

    LoadSteps(solver, roll, steps, extrapolate=True).run()
    assert len(seen.steps) >= steps - 1
    assert not any(one.lacks_energy or one.has_snapped for one in seen.steps)
    lacking = [max(-one.most, 0.0) / one.ripple for one in seen.steps]
    assert max(lacking) <= 0.5 * RIPPLE


@pytest.mark.mpi
def test_what_a_penalty_gives_back_is_not_missing(monkeypatch):
    """A tool that is pulled back: what the penetration has stored works on it."""
    line = rigid.Body(rigid.Line((0.5, 1.0), (0.0, -1.0)))
    found = press("quadrilateral", line, n=3, material="linear", method=Penalty(40.0))
    solver = SNESSolver(found.problem)

    def push(t):
        line.move((0.0, -0.05 * t))

    LoadSteps(solver, push, 1).run()
    seen = Watched(monkeypatch)
    LoadSteps(solver, push, 2, path=(1.0, 0.5)).run()
    stored = found.contact.stored_energy()
    for one in seen.steps:
        assert one.least <= 0.0 <= one.most or abs(one.most) <= 1e-6 * one.size
        assert not one.lacks_energy and one.ripple == 0.0
    # A quarter is left of half the way; what was given back is not little
    assert 3.0 * stored > 0.1 * seen.steps[-1].size


@pytest.mark.mpi
def test_gamma_comes_back_with_a_step_that_is_refused(monkeypatch):
    problem, steps = top_moves("triangle")
    gamma = problem.contact.gamma
    monkeypatch.setattr(
        Strategies, "_balanced", lambda *_: (_ for _ in ()).throw(ConvergenceError("x"))
    )
    monkeypatch.setattr(Strategies, "_is_curable", lambda *_: True)
    given, failed = Strategies._as_given, []

    def fails(self, *state):
        if not failed:
            failed.append(True)
            raise ConvergenceError("it cycles")
        return given(self, *state)

    monkeypatch.setattr(Strategies, "_as_given", fails)
    iterator = iter(steps)
    next(iterator)
    assert steps.halvings == 1 and problem.contact.gamma == gamma


def test_a_load_that_follows_a_worn_surface_passes_no_snap(monkeypatch):
    """Its work on the worn depth is spent there."""
    case = Pressed()
    wear, solver = Wear(case.contact, Archard(1e-3)), case.problem.snes_solver
    LoadSteps(solver, case.press, 1, on_accept=wear.accept).run()
    seen = Watched(monkeypatch)
    LoadSteps(solver, case.slide, 5, on_accept=wear.accept).run()
    assert wear.volume() == pytest.approx(1e-3 * case.LOAD * case.WAY)
    work = wear.volume() * case.LOAD / 5
    for balance in seen.steps[1:]:  # what the step before has worn
        assert balance.most == pytest.approx(work, rel=1e-3)
        assert not balance.lacks_energy and not balance.has_snapped
