"""Paths without statuses ahead."""

from unittest import mock

from raymortar.solvers import statuses_ahead


def without():
    """Iterations end with the statuses that their linear step has at its begin."""
    return mock.patch.object(statuses_ahead, "MOST_COLUMNS", 0)
