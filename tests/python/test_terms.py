"""Terms of a problem: a term of one's own in residual, tangent and reactions."""

from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from arriving import stacked
from problems import COMM, build, fix

import raymortar
from meshes.scenes import two_blocks
from raymortar.core.terms import Addition, Term, apart

STIFFNESS = 3.0


class Springs(Term):
    """Springs k u^3 at each owned unknown of the forms."""

    is_linear = False

    def __init__(self, unknowns, layout):
        self._unknowns, self._layout = unknowns, layout

    def residual(self, bcs, lacking):
        u = self._unknowns.owned_values()
        lifted = 3.0 * u**2 * self._unknowns.owned_part(lacking.increment)
        return STIFFNESS * (u**3 + lifted)

    def forces(self, bcs):
        return STIFFNESS * self._unknowns.owned_values() ** 3

    def add_tangent(self, A, bcs):
        fixed = self._unknowns.owned_prescribed(bcs)
        slopes = 3.0 * STIFFNESS * self._unknowns.owned_values() ** 2
        for row in np.flatnonzero(~fixed):
            at = self._layout.begin + row
            A.setValue(at, at, slopes[row], PETSc.InsertMode.ADD_VALUES)


def with_springs():
    problem = stacked(3).problem
    return problem, Springs(problem.contact.unknowns, problem.contact.layout)


def of_term(problem, term, x, what):
    """What a term adds to the residual or to the tangent at x."""
    made = [problem.create_vector, problem.create_matrix][what == "J"]
    alone, both = made(), made()
    getattr(problem, what)(x, alone)
    with problem.extended_by(term):
        getattr(problem, what)(x, both)
    both.axpy(-1.0, alone)
    return both


@pytest.mark.quick
@pytest.mark.mpi
def test_a_term_enters_residual_and_tangent():
    problem, springs = with_springs()
    x = problem.start()
    d, rng = x.duplicate(), np.random.default_rng(problem.comm.rank)
    n, h = problem.contact.layout.n_u, 1e-4
    x.array[:n] += 0.01 * rng.normal(size=n)
    d.array[:] = 0.0
    d.array[:n] = np.where(problem.constrained, 0.0, rng.normal(size=n))
    A, change = of_term(problem, springs, x, "J"), problem.create_vector()
    A.mult(d, change)
    size = change.norm()
    for sign in (1.0, -1.0):
        beside = x.copy()
        beside.axpy(sign * h, d)
        found = of_term(problem, springs, beside, "F")
        change.axpy(-sign * 0.5 / h, found)
    # The third derivative is 6 k; what is left is the rounding of two residuals
    cubic = STIFFNESS * h**2 * np.sqrt(problem.comm.allreduce((d.array**6).sum()))
    assert size > 0.0 and change.norm() <= 1.01 * cubic + 1e-9 * size


@pytest.mark.quick
@pytest.mark.mpi
def test_a_term_acts_as_long_as_a_problem_has_it():
    problem, springs = with_springs()
    x = problem.start()
    x.array[: problem.contact.layout.n_u] += 0.01
    b, plain = problem.create_vector(), problem.create_vector()
    problem.F(x, plain)
    before, linear = problem.forces(), problem.is_linear
    with problem.extended_by(springs):
        assert not problem.is_linear and problem.kept is None
        problem.F(x, b)
        added = problem.forces() - before
    assert problem.is_linear == linear
    u = problem.contact.unknowns.owned_values()
    assert added == pytest.approx(STIFFNESS * u**3, abs=1e-14)
    b.axpy(-1.0, plain)
    assert b.norm() > 0.0
    problem.F(x, b)
    b.axpy(-1.0, plain)
    assert b.norm() == 0.0


def test_additions_are_parted_from_contacts():
    one, other = Addition(), Addition()
    one.part = other.part = None
    assert apart([1, one, 2, other]) == ([1, 2], [one, other])
    assert apart(one) == ([], [one])
    assert apart(5) == (5, [])


def test_an_addition_given_twice_is_refused():
    one = Addition()
    one.part = type("Part", (), {"name": "T"})
    with pytest.raises(
        raymortar.ContactError, match="Addition of T is in the list twice"
    ):
        apart([one, one])


class Linear(Springs):
    """Springs k u that override what the equations need, and nothing else."""

    is_linear = Term.is_linear

    def residual(self, bcs, lacking):
        increment = self._unknowns.owned_part(lacking.increment)
        return STIFFNESS * (self._unknowns.owned_values() + increment)


def test_a_tangent_is_kept_without_a_term_only_if_the_term_says_so():
    """A solver that keeps factors takes the kept tangent for that of all forms."""
    scene = two_blocks(COMM, 2, "triangle")
    problem = build(scene, bcs=lambda V, scene: [fix(V, scene, "bottom")]).problem
    springs = Linear(problem.contact.unknowns, problem.contact.layout)
    assert problem.kept is not None
    with problem.extended_by(springs):
        assert problem.kept is None


def test_inertia_of_linear_bodies_is_kept(monkeypatch):
    scene = two_blocks(COMM, 2, "triangle")
    problem = build(scene, bcs=lambda V, scene: [fix(V, scene, "bottom")]).problem
    V = problem.u.function_space
    form = ufl.inner(ufl.TrialFunction(V), ufl.TestFunction(V)) * ufl.dx
    inertia = raymortar.Inertia(form, problem.contact)
    kept, J = [], problem.J

    def seen(x, A):
        kept.append(problem.kept)
        return J(x, A)

    monkeypatch.setattr(problem, "J", seen)
    solver = raymortar.SNESSolver(problem)
    raymortar.TimeSteps(solver, inertia, end=0.1, dt=0.1).run()
    assert kept and all(one is not None for one in kept)
    assert not any(one is problem.volume.kept for one in kept)
