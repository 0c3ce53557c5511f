"""Results and residuals after the contact has changed under a problem's feet."""

import numpy as np
import pytest
from problems import COMM, build
from sheared_blocks import pressed_and_sheared

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, ContactError, Coulomb, Penalty

pytestmark = [pytest.mark.quick, pytest.mark.mpi]
CELL = "quadrilateral"


def sheared_twice(method):
    """A problem after two accepted steps, and the state after the first."""
    problem, move, push = pressed_and_sheared(CELL, method, Coulomb(0.5))
    first, force = problem.contact.state(), problem.contact.resultant().force
    push[0] += 0.02
    move(push)
    problem.solve()
    problem.contact.advance()
    return problem, first, force


def springs(contact):
    """What the friction springs of each slave surface hold."""
    state = contact.state()
    return [state[f"springs {k}"] for k, _ in enumerate(contact.zones)]


def residual(problem):
    x, b = problem.problem.start(), problem.problem.create_vector()
    problem.problem.F(x, b)
    return x, b


def test_results_are_of_the_restored_state():
    problem, first, force = sheared_twice(AugmentedLagrangian())
    assert np.linalg.norm(problem.contact.resultant().force - force) > 1e-3
    problem.contact.restore(first)
    np.testing.assert_allclose(problem.contact.resultant().force, force, rtol=1e-12)


def test_springs_that_advance_after_restore_are_of_the_restored_state():
    problem, first, _ = sheared_twice(Penalty(30.0))
    contact = problem.contact
    contact.restore(first)
    contact.advance()
    got = springs(contact)
    contact.restore(first)
    contact.update()
    contact.advance()
    for one, two in zip(got, springs(contact)):
        np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("smooth", [False, True])
def test_a_state_of_other_surfaces_is_refused(smooth):
    """One with curved facets, the other without; arrays are alike."""
    one, other = (
        build(two_blocks(COMM, 2, CELL, 4, 4), smooth=s).contact
        for s in (smooth, not smooth)
    )
    one.restore(one.state())
    said = f"the state is of a contact with smooth={smooth}, .* has smooth={not smooth}"
    with pytest.raises(ContactError, match=said):
        other.restore(one.state())


def shaken(method):
    """A problem with its residual at unknowns of no equilibrium."""
    problem, first, _ = sheared_twice(method)
    problem.contact.restore(first)
    problem.u.x.array[:] += 1e-3 * np.sin(1e3 * problem.u.x.array)
    return problem, *residual(problem)


@pytest.mark.parametrize("change", ["gamma", "advance"])
def test_residual_at_the_same_unknowns_follows_the_contact(change):
    problem, x, b = shaken(Penalty(30.0))
    before = b.copy()
    if change == "gamma":
        problem.contact.set_gamma(60.0)
    else:
        problem.contact.advance()
    problem.problem.F(x, b)
    _, expected = residual(problem)
    # An accepted step hands on the force that it has
    assert ((before - expected).norm() > 1e-6) == (change == "gamma")
    assert (b - expected).norm() <= 1e-12 * expected.norm()


def test_residual_is_of_the_unknowns_not_of_u():
    problem, x, b = shaken(AugmentedLagrangian())
    expected = b.copy()
    problem.u.x.array[:] = 0.0
    problem.problem.F(x, b)
    assert expected.norm() > 1e-6
    assert (b - expected).norm() <= 1e-12 * expected.norm()
