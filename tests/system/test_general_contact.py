"""pairs="all": contact that finds its pairs, by name after the fact (W4)."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import gathered
import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, DIMENSION, fix, residual, stack

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import (
    AugmentedLagrangian,
    Checkpoint,
    Contact,
    ContactError,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    Tie,
    rigid,
)
from raymortar.core import compat

pytestmark = pytest.mark.mpi
GAMMA = 100.0


class Pile:
    """Three blocks on each other, which are pressed by their top."""

    def __init__(self, cell="triangle", degree=1, gaps=(0.0, 0.01, 0.01)):
        self.scene = stack(cell, gaps=gaps, divisions=(3, 4, 2))
        self.V = compat.vector_space(self.scene.mesh, degree)
        self.u = fem.Function(self.V)
        self.F = residual(self.scene, self.u, "neo-hookean", 10.0)[0]
        self.dim = self.scene.mesh.geometry.dim
        self.down = fem.Constant(self.scene.mesh, PETSc.ScalarType(0.0))
        self.bcs = [fix(self.V, self.scene, "bottom_0")]
        self.bcs += [fix(self.V, self.scene, "top_2", self.dim - 1, self.down)]
        sides = ["left_0", "left_1", "left_2"]
        self.bcs += [fix(self.V, self.scene, sides, 0)]
        if self.dim == 3:
            fronts = ["front_0", "front_1", "front_2"]
            self.bcs += [fix(self.V, self.scene, fronts, 1)]

    def contact(self, pairs, gamma=GAMMA, **options):
        names = options.pop("names", self.scene.tags)
        tags, method = self.scene.facet_tags, Penalty(gamma, **options.pop("law", {}))
        return Contact(self.u, tags, pairs, method, names=names, **options)

    def press(self, contacts, depth=0.1, steps=2):
        problem = NonlinearProblem(self.F, contacts, self.bcs)
        history = History(problem)

        def apply(t):
            self.down.value = -depth * t

        LoadSteps(problem.snes_solver, apply, steps, history=history).run()
        return problem, history

    def answer(self):
        return gathered.owned(self.V, self.u.x.array.reshape(-1, self.dim))


@pytest.mark.parametrize(
    "cell, degree", [("triangle", 1), ("quadrilateral", 2), ("hexahedron", 1)]
)
def test_nobody_is_named(cell, degree):
    """The same answer as with named pairs, each in both orders with half the weight."""
    found = []
    for names in (False, True):
        pile = Pile(cell, degree)
        if names:
            pairs = [("top_0", "bottom_1"), ("top_1", "bottom_2")]
            contacts = [pile.contact(pairs, 0.5 * GAMMA)]
            contacts += [pile.contact([p[::-1] for p in pairs], 0.5 * GAMMA)]
        else:
            contacts = pile.contact("all")
        problem, history = pile.press(contacts)
        found.append(pile.answer())
        if not names:
            met = {(m.one, m.other): m for m in contacts.results.meetings()}
            assert set(met) == {("top_0", "bottom_1"), ("top_1", "bottom_2")}
            force = met["top_0", "bottom_1"].resultant.force
            held = problem.reactions({"held": pile.bcs[:1]})["held"]
            assert force[-1] == pytest.approx(-held[-1], rel=1e-8)
            column = f"force_on_top_0_{'xyz'[pile.dim - 1]}"
            assert history[column][-1] == pytest.approx(force[-1])
            same = contacts.resultant("bottom_1", "top_0").force
            np.testing.assert_allclose(same, -force, atol=1e-12)
    alone, named = found
    assert np.abs(named).max() > 0.05
    assert np.abs(alone - named).max() < 1e-10


def test_bodies_without_tags_are_numbered_by_their_place():
    pile = Pile()
    contact = Contact(pile.u, None, "all", Penalty(GAMMA))
    pile.press(contact)
    names = [(m.one, m.other) for m in contact.results.meetings()]
    assert names == [("body_0", "body_1"), ("body_1", "body_2")]
    force = contact.resultant("body_0").force
    assert force[-1] < -0.1
    np.testing.assert_allclose(contact.resultant("body_1", "body_0").force, -force)
    assert "body_0 and body_1" in str(contact.results.meetings()[0])
    # Points of either body that have hit the other
    each = [contact.points(*of) for of in (names[0], names[0][::-1])]
    closed = sum(int(np.count_nonzero(points["status"] > 1)) for points in each)
    assert COMM.allreduce(closed) == contact.results.meetings()[0].points > 0


def test_new_contacts_are_found_along_a_path():
    """The second gap closes when the first one has."""
    pile = Pile(gaps=(0.0, 0.01, 0.05))
    contact = pile.contact("all")
    problem = NonlinearProblem(pile.F, contact, pile.bcs)
    seen = []

    def apply(t):
        pile.down.value = -0.15 * t

    for _ in LoadSteps(problem.snes_solver, apply, 4):
        seen.append(len(contact.results.meetings()))
    assert seen == sorted(seen)
    assert seen[-1] == 2


def test_all_facets_meet_a_tool_too():
    pile = Pile()
    tool = rigid.Body(rigid.Line((0.0, 3.02), (0.0, -1.0)), name="plate")
    contact = pile.contact([("all", "all"), ("all", tool)])
    pile.bcs = [pile.bcs[0], pile.bcs[2]]
    problem = NonlinearProblem(pile.F, contact, pile.bcs)

    def apply(t):
        tool.move((0.0, -0.1 * t))

    LoadSteps(problem.snes_solver, apply, 3, stabilize=True).run()
    met = [(m.one, m.other) for m in contact.results.meetings()]
    assert ("top_0", "bottom_1") in met
    assert ("all", "plate") in met
    push = contact.results.resultant_on(tool).force
    np.testing.assert_allclose(contact.resultant("top_2").force, -push, atol=1e-9)


def pressed_on_tools(cell, everywhere, friction, method):
    """Forces of a floor and of a lid on a block, whose facets may all meet both; or the
    same with one tag on all of them."""
    dim = DIMENSION[cell]
    sides = {"left_0": 1, "front_0": 2} if dim == 3 else {"left_0": 1}
    named = {name.partition("_")[0]: tag for name, tag in sides.items()}
    block = Block((3,) * dim, (0.0,) * dim, (1.0,) * dim, tags=named)
    scene = Scene(*assemble_blocks(COMM, [block], cell), sides)
    mesh = scene.mesh
    u = fem.Function(compat.vector_space(mesh, 1))
    F = residual(scene, u, "neo-hookean", 10.0)[0]
    up = np.eye(dim)[-1]
    flat = rigid.Line if dim == 2 else rigid.Plane
    floor = rigid.Body(flat(0.0 * up, up), name="floor")
    lid = rigid.Body(flat(up, -up), name="lid")
    skin = compat.exterior_facets(mesh)
    tags = compat.meshtags(mesh, dim - 1, skin, np.full(len(skin), 9))
    slave, tags = ("all", None) if everywhere else (9, tags)
    pairs = [(slave, floor), (slave, lid)]
    contact = Contact(u, tags, pairs, method, friction)
    bcs = [fix(u.function_space, scene, name, k) for k, name in enumerate(sides)]
    problem = NonlinearProblem(F, contact, bcs)

    def apply(t):
        lid.move(-0.1 * t * up)

    LoadSteps(problem.snes_solver, apply, 2).run()
    forces = [contact.results.resultant_on(body).force for body in (floor, lid)]
    return np.array(forces), gathered.owned(
        u.function_space, u.x.array.reshape(-1, dim)
    )


@pytest.mark.parametrize("friction", [None, Coulomb(0.3)], ids=["frictionless", "mu"])
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral", "hexahedron"])
def test_all_facets_meet_tools_with_a_multiplier(cell, friction):
    """The tools lead; no facet meets another."""
    method = AugmentedLagrangian()
    whole, u = pressed_on_tools(cell, True, friction, method)
    named, same = pressed_on_tools(cell, False, friction, method)
    np.testing.assert_allclose(u, same, atol=1e-11)
    np.testing.assert_allclose(whole, named, rtol=1e-10, atol=1e-11)
    assert whole[0, -1] == pytest.approx(-whole[1, -1]) and abs(whole[0, -1]) > 0.05


def test_all_facets_beside_named_ones_have_contacts_of_their_own():
    pile = Pile()
    tool = rigid.Body(rigid.Line((0.0, 3.02), (0.0, -1.0)), name="plate")
    pairs, names = [("all", tool), ("top_0", "bottom_1")], pile.scene.tags
    with pytest.raises(ContactError, match="has slave 'all' beside others"):
        Contact(pile.u, pile.scene.facet_tags, pairs, names=names)
    one = Contact(pile.u, None, [("all", tool)])
    for master, fails in ((tool, True), ("bottom_1", False)):
        other = pile.contact([("top_0", master)])
        if not fails:
            NonlinearProblem(pile.F, [one, other], pile.bcs)
            continue
        with pytest.raises(ContactError, match="one of those of 'all' of contact.0"):
            NonlinearProblem(pile.F, [one, other], pile.bcs)


def test_exact_penalty_closes_the_gap():
    """Whatever gamma is, down to 1e-4 of a facet around each node."""
    found = []
    for gamma in (30.0, 300.0):
        pile = Pile()
        contact = pile.contact("all", gamma, law={"exact": True})
        pile.press(contact)
        gap = np.nan_to_num(contact.gap().x.array)
        touching = contact.pressure().x.array > 1e-6
        worst = np.abs(gap[touching]).max(initial=0.0)
        assert COMM.allreduce(float(worst), op=MPI.MAX) < 3e-4 * 0.5
        found.append(pile.answer())
        assert contact.stored_energy() == 0.0
    assert np.abs(found[0] - found[1]).max() < 1e-3 * np.abs(found[0]).max()


PLATE = rigid.Body(rigid.Line((0.0, 3.02), (0.0, -1.0)), name="plate")
BAD = [
    ("all", None, "pairs has 'all', where each facet is slave and master"),
    ([("all", "top_0")], Penalty(), "pairs has 'all' with tag 12"),
    ([("top_0", "all")], Penalty(), "pairs has 'all' with tag 12"),
    (
        [("all", "all"), ("top_0", "bottom_1")],
        Penalty(),
        r"pair \('top_0', 'bottom_1'\) is one of those of 'all'",
    ),
    (
        [("all", PLATE), ("top_2", PLATE)],
        Penalty(),
        r"pair \('top_2', 'plate'\) is one of those of 'all'",
    ),
]


@pytest.mark.parametrize("pairs, method, pattern", BAD)
def test_bad_pairs_of_all_are_refused(pairs, method, pattern):
    pile = Pile()
    with pytest.raises(ContactError, match=pattern):
        Contact(pile.u, pile.scene.facet_tags, pairs, method, names=pile.scene.tags)


def test_named_pairs_are_not_counted_twice_in_a_problem():
    """But those of a tie or of a tool that not all facets meet may be beside."""
    pile = Pile()
    whole, named = pile.contact("all"), pile.contact([("top_0", "bottom_1")])
    for contacts in ([whole, named], [named, whole]):
        message = (
            r"has the pair \('top_0', 'bottom_1'\), which is one of those of 'all'"
        )
        with pytest.raises(ContactError, match=message):
            NonlinearProblem(pile.F, contacts, pile.bcs)
    tie = Tie(
        pile.u, pile.scene.facet_tags, [("top_0", "bottom_1")], names=pile.scene.tags
    )
    beside = pile.contact([("top_2", PLATE)])
    problem = NonlinearProblem(pile.F, [whole, tie, beside], pile.bcs)
    assert len(problem.contact.contacts) == 3


def test_things_that_are_no_tags_are_refused():
    pile = Pile()
    with pytest.raises(ContactError, match="facet_tags must be MeshTags, not list"):
        Contact(pile.u, [1], "all", Penalty())


def test_friction_and_steps_go_back():
    """Springs and exact tractions are part of a state."""
    pile = Pile()
    contact = pile.contact("all", law={"exact": True}, friction=Coulomb(0.3))
    pile.press(contact)
    before, u = contact.state(), pile.answer()
    pile.u.x.array[:] *= 1.1
    contact.update()
    contact.restore(before)
    np.testing.assert_array_equal(pile.answer(), u)
    after = contact.state()
    np.testing.assert_array_equal(after["augmentation 0"], before["augmentation 0"])


def test_a_checkpoint_has_the_tractions_of_an_exact_penalty(folder):
    law, file = {"exact": True}, folder / "pile.chk"
    first, second = Pile(), Pile()
    contact = first.contact("all", law=law)
    problem, _ = first.press(contact)
    contact.advance()
    Checkpoint(problem, file).write(1.0)
    other = second.contact("all", law=law)
    later = NonlinearProblem(second.F, other, second.bcs)
    assert Checkpoint(later, file).read() == 1.0
    np.testing.assert_array_equal(second.answer(), first.answer())
    carried = contact.state()["augmentation 0"]
    assert COMM.allreduce(float(np.abs(carried).max(initial=0.0)), op=MPI.MAX) > 0.0
    np.testing.assert_array_equal(other.state()["augmentation 0"], carried)
