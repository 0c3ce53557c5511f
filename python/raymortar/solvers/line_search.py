"""A solver with a line search, for load steps on which full Newton steps fail."""

from __future__ import annotations

from typing import Any

from .newton import NewtonSolver
from .snes import SNESSolver

# Factor for the number of iterations, as shorter steps need more
MORE_ITERATIONS = 2

_LINE_SEARCH = "snes_linesearch_type"


def with_line_search(solver: Any) -> SNESSolver | None:
    """SNES with line search, on the matrix and with the linear solver of another one.

    None if the given solver already has a line search, or is of another kind.
    Collective.
    """
    options = dict(solver.options.given) if hasattr(solver, "options") else {}
    # A tolerance of the user's is among the settings that are taken. The default was
    # the rounding error of all bodies when the solver was made: asked for as a
    # tolerance, it would be one that the softest body is not solved to
    options.pop("snes_atol", None)
    if isinstance(solver, SNESSolver):
        if options.get(_LINE_SEARCH) != "basic" or solver.snes.getType() != "newtonls":
            return None
    elif not (
        isinstance(solver, NewtonSolver) and solver.convergence_criterion == "residual"
    ):
        return None
    other = SNESSolver(solver.problem, {**options, _LINE_SEARCH: "l2"}, matrix=solver.A)
    other.take_settings(solver, MORE_ITERATIONS)
    return other
