"""Checks of the arguments of load steps."""

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


def check_solver(solver: Any) -> None:
    """Raise unless `solver` is a solver of a problem."""
    problem = getattr(solver, "problem", None)
    if not (isinstance(problem, CoupledProblem) and hasattr(solver, "solve")):
        raise ContactError(
            "solver must be a NewtonSolver, SNESSolver or FixedPointSolver, not "
            f"{solver!r}"
        )


def check_arguments(given: Any) -> None:
    """Raise unless all arguments, as attributes of `LoadSteps`, can be used."""
    fault = _fault_of_sizes(given) or _fault_of_options(given)
    fault = fault or _fault_of_control(given)
    if fault:
        raise ContactError(fault)


def _fault_of_sizes(given: Any) -> str | None:
    """Say why numbers and sizes of steps cannot be used, if so."""
    steps, max_halvings, path = given.steps, given.max_halvings, given.path
    if not (is_whole_number(steps) and is_whole_number(max_halvings)):
        return (
            f"steps = {steps!r} and max_halvings = {max_halvings!r} must be whole "
            "numbers"
        )
    if steps < 1 or max_halvings < 0:
        return (
            f"steps = {steps} must be positive, max_halvings = {max_halvings} not "
            "negative"
        )
    if not (is_real_number(given.largest) and given.largest >= 1):
        return f"largest = {given.largest!r} must be at least 1"
    if not (is_real_number(given.easy) and given.easy >= 0):
        return f"easy = {given.easy!r} must be a number of iterations"
    ends = list(path) if isinstance(path, (tuple, list, np.ndarray)) else []
    if len(ends) != 2 or not all(is_real_number(t) and np.isfinite(t) for t in ends):
        return f"path must be two numbers, its ends, not {path!r}"
    return None


def _fault_of_options(given: Any) -> str | None:
    """Say why other arguments cannot be used, if so."""
    strategy, stabilize, history = given.strategy, given.stabilize, given.history
    if not is_truth_value(given.extrapolate):
        return f"extrapolate must be True or False, not {given.extrapolate!r}"
    if strategy is not None and strategy not in STRATEGIES:
        return f"strategy must be one of {STRATEGIES}, not {strategy!r}"
    scales = is_real_number(stabilize) and 0.0 <= stabilize < np.inf
    if not (stabilize is None or is_truth_value(stabilize) or scales):
        return f"stabilize must be True, False, None or a factor, not {stabilize!r}"
    if not callable(given.apply):
        return f"apply must be a function of the load factor, not {given.apply!r}"
    if history is not None and not isinstance(history, History):
        return f"history must be a History, not {history!r}"
    if history is not None and history.problem is not given.solver.problem:
        return "history is of another problem than the solver"
    return None


def _fault_of_control(given: Any) -> str | None:
    """Say why a control cannot lead the path, if so."""
    control, solver = given.control, given.solver
    if control is None:
        return None
    if not isinstance(control, (DisplacementControl, ArcLength)):
        return (
            f"control must be a DisplacementControl, an ArcLength or None, not "
            f"{control!r}"
        )
    control.check()
    if not isinstance(solver, (NewtonSolver, SNESSolver)):
        return "control needs a NewtonSolver or an SNESSolver"
    if not solver.problem.contact.host.is_plain:
        return "control leads paths of one displacement: the problem has other unknowns"
    if given.stabilize:
        return "control and stabilize exclude each other"
    if given.path[0] == given.path[1]:
        return (
            f"path = {given.path} must have two ends: the load factor, which control "
            "finds, is measured by them"
        )
    return None


def with_size(apply: Any) -> Callable[[float, float], Any]:
    """Pass the step size on if `apply` has two arguments without default."""
    found: list[inspect.Parameter] = []
    try:
        found = list(inspect.signature(apply).parameters.values())
    except (TypeError, ValueError):  # some built-in functions have no signature
        pass
    positional = (p for p in found if p.kind <= p.POSITIONAL_OR_KEYWORD)
    if sum(p.default is p.empty for p in positional) == 2:
        return apply
    return lambda factor, size: apply(factor)
