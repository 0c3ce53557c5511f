"""Coefficients of the forms that a user's function sets for each iterate."""

from __future__ import annotations

from collections.abc import Callable

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..discretization.unknowns import Unknowns
from ..errors import together


class Updated:
    """Calls the user's function once for each state of the unknowns. Collective.

    Parameters
    ----------
    unknowns
        What the problem solves for.
    function
        Sets coefficients of the forms from the present unknowns.
    """

    def __init__(self, unknowns: Unknowns, function: Callable[[], object]) -> None:
        self._unknowns, self._function = unknowns, function
        # Unknowns of the last call; None: it has to be called again
        self._last: Array | None = None
        self._is_new = False

    def bring(self) -> None:
        """Call the function if the unknowns have changed since its last call.

        Raises
        ------
        Exception
            On all ranks, what the function raises on any: see `errors.together`.
        """
        comm, now = self._unknowns.comm, self._unknowns.values()
        changed = self._last is None or not np.array_equal(self._last, now)
        if not comm.allreduce(changed, op=MPI.LOR):
            return
        self._last = None
        with together(comm):
            self._function()
        self._last, self._is_new = now, True

    def bring_for_residual(self) -> None:
        """As `bring`, and again where a residual has been assembled before: only a new
        solve asks for it at the same unknowns, and loads may have changed."""
        if not self._is_new:
            self._last = None
        self.bring()
        self._is_new = False

    def forget(self) -> None:
        """Call the function next time though the unknowns stay the same."""
        self._last = None
