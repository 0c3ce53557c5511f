"""What a problem of several contacts refuses."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from interacting import LOWER, UPPER, three

from raymortar import ContactError, ContactWarning, Penalty, SNESSolver, Stick, solvers
from raymortar.core.state import State

pytestmark = pytest.mark.mpi


def refused(text):
    return pytest.raises(ContactError, match=text)


def test_lists_that_are_none_are_refused():
    blocks = three()
    one = blocks.contact(LOWER)
    with refused("contact is an empty list"):
        blocks.problem([])
    with refused(r"contact\[1\] must be a Contact, not str"):
        blocks.problem([one, "other"])
    with refused(r"contact\[1\], of slave tag 21, is in the list twice"):
        blocks.problem([one, one])
    with refused(r"contact\[1\], of slave tag 31, has the displacement u, contact"):
        blocks.problem([one, three().contact(UPPER)])
    assert blocks.problem([one]).contact is one


def test_contacts_do_not_change_their_problem():
    """Rows are settled by the first problem; others of the same contacts may follow."""
    blocks = three()
    one, other, third = (blocks.contact(pair) for pair in (LOWER, UPPER, UPPER))
    blocks.problem(one)
    with refused("slave tag 21 belongs to a problem alone"):
        blocks.problem([one, other])
    pair = [other, third]
    blocks.problem(pair)
    blocks.problem(pair)
    for wrong in (other, [third, other]):
        with refused("belongs to a problem with others"):
            blocks.problem(wrong)
    blocks.problem(one)


def test_states_of_other_contacts_are_refused():
    blocks = three()
    contacts = [blocks.contact(LOWER), blocks.contact(UPPER, method=Penalty(5.0))]
    joint = blocks.problem(contacts).contact
    with refused("the state is of 1 contacts, here are 2"):
        joint.restore(contacts[0].state())
    state = joint.state()
    turned = State(state)
    turned["multiplier 1"] = turned.pop("multiplier 0")
    with refused("another contact, mesh or method: multiplier 0 of shape None"):
        joint.restore(turned)
    more = State(state)
    more["multiplier 1"] = more["multiplier 0"]
    with refused(r"multiplier 1 of shape \(.*, here None"):
        joint.restore(more)
    with refused("the state is of 2 contacts, here are 1"):
        contacts[0].restore(state)


def test_iterative_solvers_take_several_penalties():
    """Several multipliers: test_solvers."""
    forces = []
    for options in (None, solvers.iterative()):
        blocks = three()
        law = {"method": Penalty(20.0), "friction": Stick()}
        contacts = [blocks.contact(pair, **law) for pair in (LOWER, UPPER)]
        blocks.move(1.0)
        SNESSolver(blocks.problem(contacts), options).solve()
        forces.append([contact.resultant().force for contact in contacts])
    assert np.allclose(*forces, rtol=1e-6, atol=1e-8)


def test_two_multipliers_on_one_pair_are_told():
    """Either way round; a penalty leaves the traction to the other one."""
    blocks = three()
    one, other = blocks.contact(UPPER), blocks.contact(UPPER[::-1])
    with pytest.warns(ContactWarning, match="both have multipliers on slave tag"):
        blocks.problem([one, other])
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        third = blocks.contact(UPPER, method=Penalty(5.0))
        blocks.problem([blocks.contact(UPPER), third])
