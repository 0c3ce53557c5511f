"""Errors on all ranks."""

import pytest
from problems import COMM

from raymortar import errors

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
