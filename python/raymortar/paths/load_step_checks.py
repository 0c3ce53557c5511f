"""Checks of the arguments of load steps."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..checked import is_one_of, is_real_number, is_truth_value, is_whole_number
from ..errors import ContactError
from ..problem import CoupledProblem
from ..solvers.newton import NewtonSolver
from ..solvers.snes import SNESSolver
from .control import ArcLength, DisplacementControl
from .history import History
from .progress import is_file

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
    fault = next((text for is_fine, text in _rules(given) if not is_fine), None)
    if fault:
        raise ContactError(fault)


def _rules(given: Any) -> Iterator[tuple[bool, str]]:
    """Yield whether an argument can be used, and what to say if not."""
    progress, steps, halvings = given.progress, given.steps, given.max_halvings
    shown = progress is None or isinstance(progress, bool) or is_file(progress)
    yield shown, f"progress must be True, False, None or a file, not {progress!r}"
    numbers = f"steps = {steps!r} and max_halvings = {halvings!r}"
    yield all(
        map(is_whole_number, (steps, halvings))
    ), f"{numbers} must be whole numbers"
    text = f"steps = {steps} must be positive, max_halvings = {halvings} not negative"
    yield steps >= 1 and halvings >= 0, text
    largest, easy, path = given.largest, given.easy, given.path
    text = f"largest = {largest!r} must be at least 1"
    yield is_real_number(largest) and largest >= 1, text
    text = f"easy = {easy!r} must be a number of iterations"
    yield is_real_number(easy) and easy >= 0, text
    ends = list(path) if isinstance(path, (tuple, list, np.ndarray)) else []
    finite = len(ends) == 2 and all(is_real_number(t) and np.isfinite(t) for t in ends)
    yield finite, f"path must be two numbers, its ends, not {path!r}"
    extrapolate, strategy, scale = given.extrapolate, given.strategy, given.stabilize
    text = f"extrapolate must be True or False, not {extrapolate!r}"
    yield is_truth_value(extrapolate), text
    text = f"strategy must be one of {STRATEGIES}, not {strategy!r}"
    yield strategy is None or is_one_of(strategy, STRATEGIES), text
    scales = is_real_number(scale) and 0.0 <= scale < np.inf
    text = f"stabilize must be True, False, None or a factor, not {scale!r}"
    yield scale is None or is_truth_value(scale) or scales, text
    text = f"apply must be a function of the load factor, not {given.apply!r}"
    yield callable(given.apply), text
    history, control, solver = given.history, given.control, given.solver
    text = f"history must be a History, not {history!r}"
    yield history is None or isinstance(history, History), text
    own = history is None or history.problem is solver.problem
    yield own, "history is of another problem than the solver"
    if control is None:
        return
    kinds = "a DisplacementControl, an ArcLength or None"
    known = isinstance(control, (DisplacementControl, ArcLength))
    yield known, f"control must be {kinds}, not {control!r}"
    control.check()
    led = isinstance(solver, (NewtonSolver, SNESSolver))
    yield led, "control needs a NewtonSolver or an SNESSolver"
    text = "control leads paths of one displacement: the problem has other unknowns"
    yield solver.problem.contact.host.is_plain, text
    yield not scale, "control and stabilize exclude each other"
    yield path[0] != path[1], (
        f"path = {path} must have two ends: the load factor, which control finds, is "
        "measured by them"
    )


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
