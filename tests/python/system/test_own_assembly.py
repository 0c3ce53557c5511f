"""Contact added to matrices and vectors that a user assembles, as DOLFINx's own are."""

import inspect
import warnings

from petsc4py import PETSc

import dolfinx.fem.petsc as fem_petsc
import interacting
import numpy as np
import pytest
import ufl
from by_hand import (
    DUAL,
    METHODS,
    PENALTY,
    POINTS,
    SLIDING,
    Blocks,
    ByHand,
    assemble_form,
    direct,
)
from dolfinx import fem
from problems import COMM

import raymortar
from raymortar.core import compat
from raymortar.several.interactions import Interactions

ADD, REVERSE = PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE
INSERT = PETSc.InsertMode.INSERT
STEPS = [0.5, 1.0]


def forces_of_the_problem(*given):
    blocks, forces = Blocks(*given), []
    problem = raymortar.NonlinearProblem(blocks.residual, blocks.contact, blocks.bcs)
    for t in STEPS:
        blocks.load(t)
        problem.solve()
        forces.append(blocks.contact.resultant().force)
        blocks.contact.advance()
    return np.array(forces)


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("given", METHODS)
def test_forces_are_those_of_the_problem(given):
    hand, forces = ByHand(*given), []
    for t in STEPS:
        hand.load(t)
        hand.solve()
        forces.append(hand.contact.resultant().force)
        hand.contact.advance()
    expected = forces_of_the_problem(*given)
    assert np.abs(forces - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.mpi
@pytest.mark.quick
def test_the_six_lines_as_they_stand():
    """Displacements satisfy the conditions: nothing is lifted."""
    blocks = ByHand(PENALTY, SLIDING)
    blocks.load(1.0)
    blocks.solve()
    contact, L, a, bcs = blocks.contact, blocks.L, blocks.a, blocks.bcs
    x = blocks.x
    free = ~contact.unknowns.owned_prescribed(bcs)
    x.array[free] += 1e-3 * np.random.default_rng(COMM.rank).standard_normal(sum(free))
    contact.from_vector(x)

    contact.update()
    A, b = contact.create_matrix(a), contact.create_vector(L)
    fem_petsc.assemble_matrix(A, a, bcs)
    contact.assemble_matrix(A, bcs)
    A.assemble()
    fem_petsc.assemble_vector(b, L)
    contact.assemble_vector(b, bcs)
    b.ghostUpdate(ADD, REVERSE)
    fem_petsc.set_bc(b, bcs, x)

    like = raymortar.NonlinearProblem(blocks.residual, contact, bcs)
    y, expected, tangent = like.start(), like.create_vector(), like.create_matrix()
    like.F(y, expected)
    like.J(y, tangent)
    assert (b - expected).norm() < 1e-13 * expected.norm()
    assert (A - tangent).norm() < 1e-13 * tangent.norm()
    assert contact.resultant().force[1] > 0.01


def vector_of_dolfinx(blocks):
    """Its own vector of the form: 0.10 and later take the space."""
    wanted = next(iter(inspect.signature(fem_petsc.create_vector).parameters))
    return fem_petsc.create_vector(
        blocks.L if wanted == "L" else blocks.u.function_space
    )


@pytest.mark.mpi
def test_layout_and_ghosts_are_those_of_dolfinx():
    blocks = Blocks(PENALTY, None)
    blocks.contact.update()
    blocks.contact.create_matrix(blocks.a)
    ours = blocks.contact.create_vector(blocks.L)
    theirs = vector_of_dolfinx(blocks)
    assert ours.getBlockSize() == theirs.getBlockSize() == 2
    assert ours.getOwnershipRange() == theirs.getOwnershipRange()
    with ours.localForm() as one, theirs.localForm() as other:
        assert one.getSize() == other.getSize()
    maps = [one.getLGMap().getIndices() for one in (ours, theirs)]
    assert np.array_equal(*maps)


@pytest.mark.mpi
@pytest.mark.parametrize("state", ["added", "inserted", "assembled"])
@pytest.mark.parametrize("method", [PENALTY, POINTS])
def test_a_matrix_may_be_in_any_state_of_insertion(method, state):
    hand = ByHand(method, SLIDING)
    hand.load(1.0)
    hand.solve()
    A, bcs = hand.A, hand.bcs
    A.zeroEntries()
    assemble_form(A, hand.a, [] if state == "added" else bcs, hand.has_multiplier)
    if state == "assembled":
        A.assemble()
    hand.contact.assemble_matrix(A, bcs)
    A.assemble()
    reference = hand.contact.create_matrix(hand.a)
    volume = hand.contact.create_matrix(hand.a)
    hand.contact.assemble_matrix(reference, bcs)
    reference.assemble()
    assemble_form(volume, hand.a, [] if state == "added" else bcs, hand.has_multiplier)
    volume.assemble()
    assert (A - reference - volume).norm() < 1e-13 * reference.norm()


@pytest.mark.mpi
@pytest.mark.parametrize("state", ["inserted", "assembled"])
def test_a_vector_may_be_in_any_state_of_insertion(state):
    hand = ByHand(PENALTY, SLIDING)
    hand.load(1.0)
    hand.solve()
    b, plain = (hand.contact.create_vector(hand.L) for _ in range(2))
    hand.contact.assemble_vector(plain, hand.bcs)
    last = b.getSize() - 1
    if COMM.rank == 0:  # of another rank
        b.setValue(last, 3.0, INSERT)
    if state == "assembled":
        b.assemble()
    hand.contact.assemble_vector(b, hand.bcs)
    b.axpy(-1.0, plain)
    begin, end = b.getOwnershipRange()
    expected = np.where(np.arange(begin, end) == last, 3.0, 0.0)
    assert np.abs(b.array_r - expected).max(initial=0.0) < 1e-13


@pytest.mark.mpi
@pytest.mark.parametrize("given", METHODS[:3])
def test_the_tangent_is_that_of_differences(given):
    hand = ByHand(*given)
    hand.load(1.0)
    hand.solve()
    free = ~hand.contact.unknowns.owned_prescribed(hand.bcs)
    d, ahead, plus, minus = (hand.b.duplicate() for _ in range(4))
    moves = np.random.default_rng(COMM.rank).standard_normal(d.local_size)
    moves[: len(free)] *= free
    d.array[:] = moves
    hand.F(hand.x, hand.b)
    hand.J(hand.x, hand.A)
    hand.A.mult(d, ahead)
    h, x = 1e-6, hand.x
    hand.F(x + h * d, plus)
    hand.F(x - h * d, minus)
    assert ((plus - minus) / (2 * h) - ahead).norm() < 1e-8 * ahead.norm()


@pytest.mark.mpi
@pytest.mark.skipif(
    compat.newton_solver_class() is None, reason="this DOLFINx has no Newton solver"
)
@pytest.mark.parametrize("given", METHODS)
def test_newton_solver_of_dolfinx(given):
    hand, forces = ByHand(*given), []
    solver = compat.make_newton_solver(COMM)
    krylov = solver.krylov_solver
    krylov.setType("preonly")
    krylov.getPC().setType("lu")
    krylov.getPC().setFactorSolverType("mumps")

    def J(x, A):
        if hand.J(x, A):
            krylov.reset()
            krylov.setOperators(A)

    solver.setF(hand.F, hand.b)
    solver.setJ(J, hand.A)
    solver.set_form(lambda x: None)
    solver.convergence_criterion = "incremental"
    solver.rtol, solver.atol = 1e-9, 1e-12
    for t in STEPS:
        hand.load(t)
        assert solver.solve(hand.x)[1]
        forces.append(hand.contact.resultant().force)
        hand.contact.advance()
    expected = forces_of_the_problem(*given)
    assert np.abs(forces - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.mpi
@pytest.mark.parametrize("given", METHODS[:3])
@pytest.mark.parametrize("scale,length", [(1.0, 1.0), (70e9, 1e-3)])
def test_a_fixed_point_on_the_pairing_ends_where_newtons_method_does(
    given, scale, length
):
    force = scale * length
    whole = ByHand(*given, scale=scale, length=length)
    whole.load(1.0)
    whole.solve(1e-12 * force)
    held = ByHand(*given, scale=scale, length=length)
    held.load(1.0)
    changes, change = [], 1.0
    while change > 1e-12:
        held.contact.from_vector(held.x)
        held.contact.update()
        start, held.pair = held.x.copy(), False
        held.solve(1e-12 * force)
        change = (held.x - start).norm() / length
        changes.append(change)
        assert len(changes) < 30
    assert len(changes) > 3  # segments have moved
    assert (held.x - whole.x).norm() < 1e-10 * whole.x.norm()
    forces = [one.contact.resultant().force for one in (held, whole)]
    assert np.abs(forces[0] - forces[1]).max() < 1e-10 * np.abs(forces[1]).max()


@pytest.mark.mpi
def test_points_are_kept_until_the_next_pairing():
    hand = ByHand(PENALTY, SLIDING)
    hand.load(1.0)
    hand.solve()
    before = hand.contact.points()
    hand.u.interpolate(lambda x: np.vstack([0.1 + 0 * x[0], 0 * x[0]]), None)
    hand.contact.update(pair=False)
    held = hand.contact.points()
    assert np.array_equal(held["slave"], before["slave"])
    assert np.array_equal(held["xi"], before["xi"])
    assert np.array_equal(held["weight"], before["weight"])


def test_there_are_no_points_to_keep_at_first():
    blocks = Blocks(PENALTY, None)
    with pytest.raises(raymortar.ContactError, match="has no points to keep"):
        blocks.contact.update(pair=False)


@pytest.mark.mpi
def test_a_matrix_without_room_for_new_pairs_is_told():
    hand = ByHand(PENALTY, None)
    hand.u.interpolate(lambda x: np.vstack([np.where(x[1] > 1, 0.31, 0.0), 0 * x[0]]))
    hand.contact.update()
    with pytest.raises(raymortar.ContactError, match=r"call contact\.make_room\(A\)"):
        hand.contact.assemble_matrix(hand.A, hand.bcs)
    hand.J(hand.x, hand.A)


@pytest.mark.mpi
def test_the_matrix_of_dolfinx_has_no_room_for_contact():
    hand = ByHand(PENALTY, None)
    hand.contact.update()
    A = fem.petsc.assemble_matrix(hand.a, hand.bcs)
    with pytest.raises(raymortar.ContactError, match=r"by contact\.create_matrix\(a\)"):
        hand.contact.assemble_matrix(A, hand.bcs)


@pytest.mark.mpi
def test_condensed_problems_have_vectors_of_dolfinx():
    blocks = Blocks(DUAL, SLIDING)
    problem = raymortar.CondensedProblem(
        blocks.residual, blocks.u, blocks.contact, blocks.bcs
    )
    ours, theirs = problem.create_vector(blocks.L), vector_of_dolfinx(blocks)
    assert ours.getBlockSize() == theirs.getBlockSize()
    maps = [one.getLGMap().getIndices() for one in (ours, theirs)]
    assert np.array_equal(*maps)
    A, dx = problem.create_matrix(blocks.a), ours.duplicate()
    blocks.load(1.0)
    ksp = direct(A)
    x = problem.create_vector()
    for _ in range(12):
        problem.F(x, ours)
        if ours.norm() < 1e-12:
            break
        problem.J(x, A)
        ksp.setOperators(A)
        ksp.reset()
        ksp.setOperators(A)
        ksp.solve(ours, dx)
        x.axpy(-1.0, dx)
    coupled = ByHand(DUAL, SLIDING)
    coupled.load(1.0)
    coupled.solve()
    found, expected = (one.contact.resultant().force for one in (blocks, coupled))
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.mpi
def test_adhesion_is_assembled_by_a_problem_alone():
    """By that of the contact's own solver or of any other; a loop by hand would miss it."""
    law = raymortar.Cohesive(strength=5.0, toughness=0.2)
    blocks = Blocks(DUAL, None, adhesion=law)
    contact = blocks.contact
    contact.update()
    text = "your own assembly has no bonds of adhesion"
    calls = (
        lambda: contact.create_matrix(blocks.a),
        lambda: contact.assemble_vector(contact.create_vector(blocks.L)),
    )
    for call in calls:
        with pytest.raises(raymortar.ContactError, match=text):
            call()
    problem = raymortar.NonlinearProblem(blocks.residual, contact, blocks.bcs)
    A, x = problem.create_matrix(), problem.start()
    problem.F(x, x.duplicate())
    with pytest.raises(raymortar.ContactError, match=text):
        contact.assemble_matrix(A)
    given = blocks.residual, blocks.u, Blocks(DUAL, None, adhesion=law).contact
    with pytest.raises(raymortar.ContactError, match="has no bonds of adhesion of a"):
        raymortar.CondensedProblem(*given)


@pytest.mark.mpi
def test_an_exact_penalty_tells_that_nobody_has_repeated_its_solves():
    """Once: its forces are those of a plain penalty. Solvers of raymortar repeat."""
    hand = ByHand(raymortar.Penalty(exact=True), None)
    hand.load(0.1)
    hand.solve()
    with pytest.warns(raymortar.ContactWarning, match="an exact penalty has left gaps"):
        hand.contact.advance()
    blocks = Blocks(raymortar.Penalty(exact=True), None)
    problem = raymortar.NonlinearProblem(blocks.residual, blocks.contact, blocks.bcs)
    with warnings.catch_warnings():
        warnings.simplefilter("error", raymortar.ContactWarning)
        hand.contact.advance()
        blocks.load(0.1)
        problem.solve()
        blocks.contact.advance()


class SeveralByHand(ByHand):
    """Two stacks of two blocks, with a contact in each."""

    def __init__(self, methods, way):
        stack = interacting.two_pairs()
        self.u, self.bcs, self.load = stack.u, stack.bcs, stack.move
        V = self.u.function_space
        self.L = fem.form(stack.F)
        self.a = fem.form(ufl.derivative(stack.F, self.u, ufl.TrialFunction(V)))
        pairs = interacting.FIRST, interacting.SECOND
        self.several = [stack.contact(p, method=m) for p, m in zip(pairs, methods)]
        self.problem = None
        if way != "by themselves":
            given = stack.F, self.several, self.bcs
            self.problem = raymortar.NonlinearProblem(*given)
        self.contact = Interactions(self.several)
        if way == "of a problem":
            self.contact = self.problem.contact

    def forces(self):
        return np.array([one.resultant().force for one in self.several])


@pytest.mark.mpi
@pytest.mark.parametrize("way", ["of a problem", "by themselves"])
@pytest.mark.parametrize("methods", [(POINTS, PENALTY), (PENALTY, PENALTY)])
def test_several_contacts_share_a_matrix(methods, way):
    hand, known = SeveralByHand(methods, way), SeveralByHand(methods, "problem")
    for one in (hand, known):
        one.load(0.5)
    known.problem.solve()
    hand.begin()
    hand.solve()
    expected = known.forces()
    assert np.abs(hand.forces() - expected).max() < 1e-8 * np.abs(expected).max()
