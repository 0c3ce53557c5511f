"""Errors and warnings on all ranks."""

import warnings

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from boxes import box
from dolfinx import fem
from pressed import Pressed
from problems import COMM

import raymortar
from raymortar.core import compat, errors

pytestmark = pytest.mark.mpi


def test_error_of_one_rank_is_raised_on_all():
    last = COMM.size - 1
    message = f"bad on {COMM.rank}" if COMM.rank == last else None
    where = rf" \(rank {last}\)" if COMM.size > 1 else ""
    with pytest.raises(errors.ContactError, match=f"^bad on {last}{where}$"):
        errors.raise_everywhere(COMM, message)


def test_lowest_rank_speaks_and_the_type_is_free():
    where = r" \(rank 0\)" if COMM.size > 1 else ""
    with pytest.raises(errors.ConvergenceError, match=f"^from 0{where}$"):
        errors.raise_everywhere(COMM, f"from {COMM.rank}", errors.ConvergenceError)


def test_silence_raises_nothing():
    errors.raise_everywhere(COMM, None)


@pytest.mark.parametrize(
    "point, others, text",
    [
        ((6.14e-12, 0.03), (), "(0, 0.03)"),
        ((6e-12, -1e-17), [[0.5, 0.1]], "(0, 0)"),
        ((2e-10, 1.23456789e-3), (), "(0, 0.00123457)"),
        ((2e-9, 0.0), [[1e-6, 0.0]], "(2e-09, 0)"),
    ],
)
def test_coordinates_of_messages_have_no_noise(point, others, text):
    assert errors.format_point(np.array(point), others) == text


def test_values_of_messages_are_a_line():
    """Functions by name, shape and element, whatever their own text is."""
    mesh = box("triangle", 1)
    V = compat.vector_space(mesh, 2)
    w = fem.Function(V, name="speed")
    text = errors.described([w])
    assert "the Function 'speed' with values (2,) in" in text and "Mesh" not in text
    assert errors.described(V).startswith("a space of ")
    assert errors.described(ufl.grad(w)) == "a UFL expression with values (2, 2)"
    assert errors.described(np.zeros((3, 4))) == "an array (3, 4)"
    assert errors.described((1, "a")) == "[1, 'a']"
    assert errors.described(list(range(9))) == "[0, 1, 2, 3, ... 9 in all]"
    assert len(errors.described("long " * 99)) == 120


@pytest.fixture
def shown(monkeypatch):
    """Messages that Python would print on this rank."""
    found = []
    monkeypatch.setattr(warnings, "_showwarnmsg_impl", lambda one: found.append(one))
    warnings.simplefilter("always")
    return found


@pytest.mark.quick
def test_a_warning_of_all_ranks_is_shown_once(shown):
    errors.speak_on(COMM)
    errors.warn("of all")
    assert len(shown) == (COMM.rank == 0)


def test_a_rank_alone_shows_its_own_warnings(shown, monkeypatch):
    monkeypatch.setattr(errors, "_speaks", None)
    errors.speak_on(MPI.COMM_SELF)
    errors.warn("of each")
    assert len(shown) == 1


@pytest.mark.quick
def test_filters_see_warnings_on_all_ranks():
    with pytest.warns(raymortar.ContactWarning, match="of all"):
        errors.warn("of all")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(raymortar.ContactWarning):
            errors.warn("of all")


@pytest.mark.filterwarnings("always")
def test_a_warning_is_at_the_line_of_the_user():
    """Of a coefficient that is judged deep within the package."""
    case = Pressed()
    stiff = raymortar.AugmentedLagrangian(1e8)
    contact = raymortar.Contact(case.u, case.scene.facet_tags, [(3, 4)], stiff)
    with pytest.warns(
        raymortar.ContactWarning, match="Newton's method may fail"
    ) as found:
        raymortar.NonlinearProblem(case.F, contact, bcs=case.bcs)
    ours = [one for one in found if one.category is raymortar.ContactWarning]
    assert {one.filename for one in ours} == {__file__}
