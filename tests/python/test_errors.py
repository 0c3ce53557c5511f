"""Errors on all ranks."""

import numpy as np
import pytest
import ufl
from boxes import box
from dolfinx import fem
from problems import COMM

from raymortar import compat, errors

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
