"""Multigrid's blocks serve several tangents, until they cost more than new ones."""

import warnings

import pytest
from pressed_blocks import FRICTIONS, METHODS, blocks, solved, unknowns
from problems import SOLVERS, fix, worst

from raymortar import ContactWarning, Coulomb, SNESSolver, solvers
from raymortar.core.convergence.convergence import Convergence
from raymortar.solvers import elimination

pytestmark = pytest.mark.mpi


def slipping(solver_options, solver=SNESSolver):
    """Points stick, then slip: the tangent of the start serves fewer and fewer."""
    problem = blocks(degree=1, n=2, friction=Coulomb(0.05))
    return solved(problem, solver_options, solver)


@pytest.fixture
def taken(monkeypatch):
    """The preconditioners that have taken blocks, once for each time."""
    found, take = [], elimination.BodiesPreconditioner._eliminate

    def noted(self, A):
        found.append(self)
        return take(self, A)

    monkeypatch.setattr(elimination.BodiesPreconditioner, "_eliminate", noted)
    return found


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_blocks_serve_several_tangents(solver, method, friction, taken):
    problem = blocks(method=METHODS[method](), friction=FRICTIONS[friction])
    start = problem.contact.state()
    solved(problem, solvers.direct(), solver)
    direct = unknowns(problem)
    problem.contact.restore(start)
    one, counts = solved(problem, solvers.iterative("bodies"), solver)
    assert len(taken) <= 2 < len(counts)
    assert worst(unknowns(problem) - direct) <= 1e-8 * worst(direct)
    # The next solve begins with them, where its rows have other factors
    problem.contact.restore(start)
    one.solve()
    assert len(taken) <= 3
    assert worst(unknowns(problem) - direct) <= 1e-8 * worst(direct)


def test_blocks_end_once_they_have_cost_more_than_new_ones(taken):
    options = [
        solvers.iterative("bodies", bodies_most=most) for most in (-1, 0, 10**6)
    ]
    found = []
    for one in options:
        del taken[:]
        _, counts = slipping(one)
        found.append((len(taken), sum(counts), len(counts)))
    (each, fewest, tangents), (some, between, _), (once, most, _) = found
    assert each == tangents > some > once == 1
    assert fewest < between < most


def test_the_last_iteration_gets_no_blocks_of_its_own(taken, monkeypatch):
    """Blocks that have cost as much as new ones serve it: these would serve it alone."""
    saved = []
    for most in range(4, 16, 2):
        options, sets = solvers.iterative("bodies", bodies_most=most), []
        for patch in ({}, {"is_last": False}):
            del taken[:]
            with monkeypatch.context() as unknown:
                for name, value in patch.items():
                    unknown.setattr(Convergence, name, value)
                slipping(options)
            sets.append(len(taken))
        saved.append(sets[1] - sets[0])
    assert 0 <= min(saved) <= max(saved) == 1


def test_blocks_end_with_another_gamma_and_other_prescribed_dofs(taken):
    problem = blocks(degree=1)
    start = problem.contact.state()
    solver, _ = solved(problem, solvers.iterative("bodies", bodies_most=10**6))
    assert len(taken) == 1
    problem.contact.restore(start)
    problem.contact.set_gamma(0.5 * problem.contact.gamma)
    solver.solve()
    assert len(taken) == 2
    problem.problem.bcs.pop()
    problem.problem.bcs.append(fix(problem.u.function_space, problem.scene, "top", 2))
    problem.contact.restore(start)
    solver.solve()
    assert len(taken) == 3


def test_blocks_that_no_longer_serve_are_no_stall(taken):
    """A limit that the first tangent's blocks keep with the first tangent alone."""
    _, counts = slipping(solvers.iterative("bodies", bodies_most=10**6))
    assert max(counts) > 2 * counts[0]
    del taken[:]
    options = solvers.with_fallback(ksp_max_it=2 * counts[0], bodies_most=10**6)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        one, _ = slipping(options)
    assert one.krylov_solver.getPythonContext().stalls == 0
    assert len(taken) > 1


def test_another_preconditioner_may_stall_too():
    """The user's own, which has no blocks that could be taken anew."""
    problem = blocks()
    options = solvers.with_fallback(ksp_max_it=2, pc_type="jacobi")
    with pytest.warns(ContactWarning, match="the direct one takes over"):
        one, _ = solved(problem, options)
    assert one.krylov_solver.getPythonContext().stalls > 0


@pytest.mark.parametrize("method", METHODS)
def test_a_stalled_solver_keeps_no_blocks(method):
    """The direct solver needs the memory."""
    with pytest.warns(ContactWarning, match="the direct one takes over"):
        one, _ = solved(
            blocks(method=METHODS[method]()), solvers.with_fallback(ksp_max_it=2)
        )
    context = one.krylov_solver.getPythonContext().krylov.getPC().getPythonContext()
    assert context.solver is None


@pytest.mark.parametrize("options", [solvers.iterative, solvers.with_fallback])
def test_the_lag_of_snes_counts(options, taken):
    """Its preconditioner serves three tangents, and the pattern is the same."""
    given = options(bodies_most=-1) | {"snes_lag_preconditioner": 3}
    solver, _ = slipping(given)
    tangents = solver.snes.getIterationNumber()
    assert tangents > 3
    assert len(taken) == -(-tangents // 3)
