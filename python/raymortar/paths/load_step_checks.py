"""Checks of what load steps are given."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from ..checked import is_real_number, is_truth_value, is_whole_number
from ..errors import ContactError
from ..problem import CoupledProblem
from ..solvers.newton import NewtonSolver
from ..solvers.snes import SNESSolver
from .control import ArcLength, DisplacementControl
from .history import History

STRATEGIES = ("auto", "halve")

_POSITIONAL = (
    inspect.Parameter.POSITIONAL_ONLY,
    inspect.Parameter.POSITIONAL_OR_KEYWORD,
)


def check_solver(solver: Any) -> None:
    """Raise unless `solver` is a solver of a problem."""
    problem = getattr(solver, "problem", None)
    if not (isinstance(problem, CoupledProblem) and hasattr(solver, "solve")):
        raise ContactError(
            "solver must be a NewtonSolver, SNESSolver or FixedPointSolver, not "
            f"{solver!r}"
        )


def check_numbers(steps: Any, max_halvings: Any, largest: Any, easy: Any) -> None:
    """Raise unless the numbers and sizes of steps are valid."""
    if not (is_whole_number(steps) and is_whole_number(max_halvings)):
        raise ContactError(
            f"steps = {steps!r} and max_halvings = {max_halvings!r} must be whole "
            "numbers"
        )
    if steps < 1 or max_halvings < 0:
        raise ContactError(
            f"steps = {steps} must be positive, max_halvings = {max_halvings} not "
            "negative"
        )
    if not (is_real_number(largest) and largest >= 1):
        raise ContactError(f"largest = {largest!r} must be at least 1")
    if not (is_real_number(easy) and easy >= 0):
        raise ContactError(f"easy = {easy!r} must be a number of iterations")


def check_truth(extrapolate: Any) -> None:
    if not is_truth_value(extrapolate):
        raise ContactError(f"extrapolate must be True or False, not {extrapolate!r}")


def check_path(path: Any) -> tuple[float, float]:
    """Both ends of a path as numbers."""
    ends = list(path) if isinstance(path, (tuple, list, np.ndarray)) else []
    if len(ends) != 2 or not all(is_real_number(t) and np.isfinite(t) for t in ends):
        raise ContactError(f"path must be two numbers, its ends, not {path!r}")
    return float(ends[0]), float(ends[1])


def check_calls(solver: Any, apply: Any, history: Any) -> None:
    """Raise unless `apply` is callable and `history` a `History` of the same
    problem."""
    if not callable(apply):
        raise ContactError(
            f"apply must be a function of the load factor, not {apply!r}"
        )
    if history is None:
        return
    if not isinstance(history, History):
        raise ContactError(f"history must be a History, not {history!r}")
    if history.problem is not solver.problem:
        raise ContactError("history is of another problem than the solver")


def check_strategy(strategy: Any) -> None:
    """Raise unless a strategy is known."""
    if strategy is not None and strategy not in STRATEGIES:
        raise ContactError(f"strategy must be one of {STRATEGIES}, not {strategy!r}")


def check_stabilize(stabilize: Any) -> None:
    """Raise unless `stabilize` is True, False, None or a number >= 0."""
    if stabilize is None or is_truth_value(stabilize):
        return
    if not (is_real_number(stabilize) and 0.0 <= stabilize < np.inf):
        raise ContactError(
            f"stabilize must be True, False, None or a factor, not {stabilize!r}"
        )


def check_control(
    control: Any, solver: Any, path: tuple[float, float], stabilize: Any
) -> None:
    """Raise unless a control can lead the path."""
    if control is None:
        return
    if not isinstance(control, (DisplacementControl, ArcLength)):
        raise ContactError(
            f"control must be a DisplacementControl, an ArcLength or None, not "
            f"{control!r}"
        )
    control.check()
    if not isinstance(solver, (NewtonSolver, SNESSolver)):
        raise ContactError("control needs a NewtonSolver or an SNESSolver")
    if not solver.problem.contact.host.is_plain:
        raise ContactError(
            "control leads paths of one displacement: the problem has other unknowns"
        )
    if stabilize:
        raise ContactError("control and stabilize exclude each other")
    if path[0] == path[1]:
        raise ContactError(
            f"path = {path} must have two ends: the load factor, which control finds, "
            "is measured by them"
        )


def with_size(apply: Any) -> Callable[[float, float], Any]:
    """`apply` as a function of load factor and step size. The size is passed on if
    `apply` has two arguments without default."""
    found: list[inspect.Parameter] = []
    try:
        found = list(inspect.signature(apply).parameters.values())
    except (TypeError, ValueError):  # some built-in functions have no signature
        pass
    asked = [p for p in found if p.default is p.empty and p.kind in _POSITIONAL]
    if len(asked) == 2:
        return apply
    return lambda factor, size: apply(factor)
