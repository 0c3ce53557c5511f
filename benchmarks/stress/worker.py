"""Solves the settings that come in, one line of JSON each, and answers in kind.

A process of its own, so that a crash or a hang ends one scene and not the matrix.
"""

from __future__ import annotations

import json
import logging
import sys
import time
import warnings

from petsc4py import PETSc

import numpy as np
from scenes import LINE_SEARCH, SCENES, Setting

import raymortar

logging.getLogger().setLevel(logging.WARNING)

FAILURES = (raymortar.ConvergenceError, raymortar.ContactError, PETSc.Error)
# Larger matrices have no condition estimate
LARGEST = 1500


def one_step(case):
    case.apply(1.0)
    case.problem.solve(max_it=25)
    return len(case.problem.history) - 1


def with_line_search(case):
    case.apply(1.0)
    case.problem.solve(raymortar.SNESSolver, LINE_SEARCH)
    return case.problem.solver.snes.getIterationNumber()


def in_steps(case, options=None, largest=1):
    solver = raymortar.SNESSolver(case.problem.problem, options)
    case.problem.solver = solver
    path = raymortar.LoadSteps(
        solver, case.apply, case.steps, largest=largest, history=case.history
    )
    return sum(step.iterations for step in path)


def in_searched_steps(case):
    return in_steps(case, LINE_SEARCH)


def in_growing_steps(case):
    """Four times as large where that is easy: over the end of a path of equilibria."""
    return in_steps(case, largest=4)


# In the order of their cost: the first that converges counts
WAYS = {
    "one step": one_step,
    "line search": with_line_search,
    "steps": in_steps,
    "steps with line search": in_searched_steps,
    "growing steps": in_growing_steps,
}


def condition(A):
    """Condition number of a small matrix, NaN for others."""
    if A.getSize()[0] > LARGEST:
        return float("nan")
    dense = A.convert("dense").getDenseArray()
    return float(np.linalg.cond(dense))


def solve(setting):
    """How a setting ends: the way that converged, its figures, or why none did."""
    result = {"way": "", "message": ""}
    ways = [way for way in WAYS if setting.scene != "slide" or "steps" in way]
    for way in ways:
        case = SCENES[setting.scene](setting)
        try:
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always", raymortar.ContactWarning)
                result["iterations"] = WAYS[way](case)
        except FAILURES as failure:
            result["message"] += f"{way}: {str(failure)[:400]} | "
            continue
        history = case.problem.history
        result["way"] = way
        kinds = [issubclass(w.category, raymortar.ContactWarning) for w in told]
        result["warned"] = bool(kinds and kinds[-1])
        result["floor"] = history[-1] / max(history) if max(history) > 0.0 else 0.0
        result |= case.errors()
        result |= case.defects()
        result["condition"] = condition(case.problem.solver.A)
        break
    return result


def main():
    for line in sys.stdin:
        values = json.loads(line)
        values["divisions"] = tuple(values["divisions"])
        begin = time.perf_counter()
        answer = solve(Setting(**values))
        answer["seconds"] = time.perf_counter() - begin
        # Apart from what libraries print
        print("answer " + json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
