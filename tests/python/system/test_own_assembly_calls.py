"""Your own assembly with matrices, forms and conditions of all kinds; free bodies in it."""

from petsc4py import PETSc

import dolfinx.fem.petsc as fem_petsc
import numpy as np
import pytest
import rigid_scenes
import ufl
from by_hand import MESH, PENALTY, SLIDING, Blocks, ByHand, bodies
from dolfinx import fem
from problems import COMM

import raymortar
from raymortar import io, rigid, tools
from raymortar.core import compat


@pytest.mark.mpi
def test_a_matrix_of_dolfinx_gets_room():
    hand = ByHand(PENALTY, SLIDING)
    hand.load(1.0)
    hand.solve()
    own = fem_petsc.create_matrix(hand.a)
    with pytest.raises(raymortar.ContactError, match=r"call contact\.make_room\(A\)"):
        hand.contact.assemble_matrix(own, hand.bcs)
    own = fem_petsc.create_matrix(hand.a)
    assert hand.J(hand.x, own)
    assert not hand.J(hand.x, own)
    hand.J(hand.x, hand.A)
    assert (own - hand.A).norm() < 1e-13 * hand.A.norm()


@pytest.mark.mpi
def test_a_matrix_that_is_not_set_up_gets_room():
    hand = ByHand(PENALTY, SLIDING)
    hand.load(1.0)
    hand.solve()
    bare = PETSc.Mat().create(COMM)
    rows = hand.contact.layout.size, None
    bare.setSizes((rows, rows))
    bare.setType(PETSc.Mat.Type.AIJ)
    assert hand.contact.make_room(bare)
    hand.contact.assemble_matrix(bare, hand.bcs)
    bare.assemble()
    known = hand.contact.create_matrix(hand.a)
    hand.contact.assemble_matrix(known, hand.bcs)
    known.assemble()
    assert (bare - known).norm() < 1e-13 * known.norm()


SPACES = {
    "mesh": lambda: tools.vector_space(io.read_gmsh(MESH, COMM, gdim=2).mesh, 1),
    "degree": lambda: tools.vector_space(bodies(1.0).mesh, 2),
    "values": lambda: compat.scalar_space(bodies(1.0).mesh, 1),
}


@pytest.mark.mpi
@pytest.mark.parametrize("kind", SPACES)
def test_a_form_on_another_space_is_told(kind):
    blocks, V = Blocks(PENALTY, None), SPACES[kind]()
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    a = fem.form(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)
    with pytest.raises(raymortar.ContactError, match="a has a test or trial function"):
        blocks.contact.create_matrix(a)


@pytest.mark.mpi
@pytest.mark.quick
def test_conditions_that_are_no_list_are_told():
    hand = ByHand(PENALTY, None)
    (one, _), contact = hand.bcs, hand.contact
    for call in (
        lambda: contact.assemble_matrix(hand.A, one),
        lambda: contact.assemble_vector(hand.b, one),
        lambda: contact.apply_lifting(hand.b, one, hand.u.x.array, -1.0),
        lambda: contact.assemble_vector(hand.b, hand.bcs if COMM.rank else one),
    ):
        with pytest.raises(raymortar.ContactError, match="bcs must be a list of"):
            call()


@pytest.mark.mpi
@pytest.mark.skipif(COMM.size == 1, reason="there is one rank")
def test_conditions_that_differ_between_ranks_are_told():
    """They would be looked for on some ranks alone, which wait for the others."""
    hand = ByHand(PENALTY, None)
    with pytest.raises(raymortar.ContactError, match="number_of_conditions differs"):
        hand.contact.assemble_vector(hand.b, hand.bcs if COMM.rank else [])


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("alpha", ["-1", None, np.nan, True])
def test_a_factor_of_lifting_is_a_number(alpha):
    hand = ByHand(PENALTY, None)
    with pytest.raises(raymortar.ContactError, match="alpha must be a number, not"):
        hand.contact.apply_lifting(hand.b, hand.bcs, hand.u.x.array, alpha)


@pytest.mark.mpi
@pytest.mark.skipif(COMM.size == 1, reason="there is one rank")
def test_arguments_that_differ_between_ranks_are_told():
    """Ranks that keep their points would wait for those which make them anew."""
    hand = ByHand(PENALTY, None)
    with pytest.raises(raymortar.ContactError, match="pair differs between ranks"):
        hand.contact.update(pair=COMM.rank > 0)
    factor, array = -1.0 - COMM.rank, hand.u.x.array
    with pytest.raises(raymortar.ContactError, match="alpha differs between ranks"):
        hand.contact.apply_lifting(hand.b, hand.bcs, array, factor)


@pytest.mark.mpi
@pytest.mark.quick
def test_a_vector_is_of_a_compiled_linear_form():
    blocks = Blocks(PENALTY, None)
    v = ufl.TestFunction(blocks.u.function_space)
    for form in (ufl.inner(blocks.u, v) * ufl.dx, blocks.a, "L"):
        with pytest.raises(raymortar.ContactError, match="L must be a compiled linear"):
            blocks.contact.create_vector(form)
    assert blocks.contact.create_vector().size == blocks.contact.layout.size_global


class Wheel(ByHand):
    """A wheel that a force presses on a block, and that may turn."""

    def __init__(self):
        circle = rigid.Circle((0.45, 1.89), 0.9)
        freedom = dict(free=("x", "y", "r"), moment=0.05)
        springs = dict(stiffness={"x": 5.0, "r": 0.5})
        self.wheel = rigid.Body(circle, (0.5, 2.0), **freedom, **springs)
        scene = rigid_scenes.press("triangle", self.wheel, friction=SLIDING)
        self.u, self.contact, self.problem = scene.u, scene.contact, scene.problem
        self.L, self.a, self.bcs = self.problem.L, self.problem.a, self.problem.bcs

    def load(self, t):
        self.wheel.force = 0.1 * t, -2.0 * t


@pytest.mark.mpi
def test_a_free_body_goes_on_turning_from_the_accepted_step():
    """Its rotation among the unknowns counts from there: `to_vector` after a step."""
    hand, known = Wheel(), Wheel()
    hand.begin()
    for t in (0.4, 0.7, 1.0):
        hand.load(t)
        hand.solve(1e-11)
        hand.contact.advance()
        hand.contact.to_vector(hand.x)
        known.load(t)
        known.problem.solve()
        known.contact.advance()
    forces = [one.contact.resultant().force for one in (hand, known)]
    assert np.abs(forces[0] - forces[1]).max() < 1e-9 * np.abs(forces[1]).max()
    turns = [one.wheel.rotation[-1] for one in (hand, known)]
    assert abs(turns[1]) > 1e-3
    assert abs(turns[0] - turns[1]) < 1e-8 * abs(turns[1])


@pytest.mark.mpi
def test_a_turn_that_nothing_stops_is_told():
    """Newton's first iterates may leave all points slipping."""
    hand = Wheel()
    hand.begin()
    rows = hand.contact.layout.body_rows[hand.wheel]
    if COMM.rank == 0:
        hand.x[int(rows[hand.wheel.freedom.is_turn][0])] = -1.5e15
    hand.x.assemble()
    with pytest.raises(raymortar.ContactError, match=r"turns by 1\.5e\+15 rad"):
        hand.contact.from_vector(hand.x)
