"""Attributes and modules that have moved are found where they were, with a warning."""

import pytest
from interacting import FIRST, SECOND, two_pairs
from pressed import Pressed, beside_another_unknown
from problems import COMM

import raymortar
from raymortar import moved
from raymortar.diagnose.failure import part_of

pytestmark = pytest.mark.mpi


@pytest.fixture
def solver():
    return raymortar.SNESSolver(Pressed().problem)


def moves(name):
    return pytest.warns(DeprecationWarning, match=f"{name} has moved: use .*[.]")


def test_all_attributes_of_a_contact(solver):
    for name in moved._OF_CONTACT:
        with moves(f"^contact[.]{name}") as caught:
            getattr(solver.problem.contact, name)
        assert [one.filename for one in caught] == [__file__]


def test_couplings_of_each_row_to_its_own_field():
    _, problem = beside_another_unknown()
    with moves("own_couplings"):
        found = problem.contact.own_couplings
    to_fields = problem.contact.system.volume.couplings
    assert (found > 0.0).all() and (found == to_fields).any(axis=0).all()


def test_solves_as_a_part(solver):
    problem = solver.problem
    with moves("^problem[.]as_part") as caught:
        part = problem.as_part(steps=True)
    with part:
        assert part_of(problem) == {"steps": True}
    assert not part_of(problem) and caught[0].filename == __file__


def test_one_tangent(solver):
    problem, x = solver.problem, solver.problem.start()
    b, dx = problem.create_vector(), problem.create_vector()
    with moves("^solver[.]linearise"):
        solver.linearise(x, {})
    problem.F(x, b)
    with solver.options, moves("^solver[.]correct"):
        solver.correct(b, dx)
    left, tangent = problem.create_vector(), problem.create_matrix()
    problem.J(x, tangent)
    tangent.mult(dx, left)
    left.axpy(-1.0, b)
    assert left.norm() < 1e-8 * b.norm()


def test_class_of_several_contacts():
    with pytest.warns(DeprecationWarning, match="several.interactions") as caught:
        from raymortar.core.interactions import Interactions
    assert {one.filename for one in caught} == {__file__}
    scene = two_pairs()
    problem = scene.problem([scene.contact(FIRST), scene.contact(SECOND)])
    assert isinstance(problem.contact, Interactions)


def test_other_names_are_refused_as_ever(solver):
    for thing in (solver, solver.problem, solver.problem.contact):
        kind = type(thing).__name__
        with pytest.raises(AttributeError, match=f"{kind}' object .* 'nonsense'"):
            thing.nonsense


def test_errors_within_properties_are_not_hidden(solver, monkeypatch):
    inner = property(lambda self: COMM.nonsense)
    for thing in (solver, solver.problem):
        monkeypatch.setattr(type(thing), "asked", inner, raising=False)
        with pytest.raises(AttributeError, match="mpi4py.*'nonsense'"):
            thing.asked
