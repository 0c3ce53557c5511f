"""Load steps that grow or start ahead, and line searches."""

from __future__ import annotations

import numpy as np
from models import half_ring, shallow_ironing
from problems import DIMENSION
from sheared_blocks import clamped
from trials import COMM, METHODS, attempt, automatic_times, listed

import raymortar

SEARCHES = ("basic", "bt", "l2", "cp")


# Load steps


def growing_steps():
    """Steps that grow to `largest` times the first."""
    for largest in (1, 2, 4, 8):
        model = shallow_ironing.Ironing(COMM, 60, gamma=None)
        steps = []
        for begin, end, count in ((0.0, 1.0, 20), (1.0, 1.8, 80)):
            path = raymortar.LoadSteps(
                model.solver,
                model.apply,
                count,
                extrapolate=True,
                largest=largest,
                path=(begin, end),
                history=model.history,
            )
            steps += path.run()
        last = model.history.rows[-1]
        figure = listed((round(-last.reaction_top_y, 2), round(last.reaction_top_x, 2)))
        yield row_of("ironing, 60 x 15; V, H", largest, steps, figure)
    for largest in (1, 2, 4, 8):
        model = half_ring.HalfRing(COMM)
        path = raymortar.LoadSteps(
            model.solver, model.apply, 64, largest=largest, history=model.history
        )
        steps = path.run()
        below = model.history["below_y"][-1]
        yield row_of("half ring; middle of the block", largest, steps, f"{below:.4f}")


def row_of(scene, largest, steps, figure):
    return {
        "scene": scene,
        "largest": largest,
        "steps": len(steps),
        "halved": steps[-1].halvings,
        "iterations": sum(step.iterations for step in steps),
        "figure": figure,
    }


def extrapolated():
    """Iterations of a step of ironing on the fine mesh, for t from 1 on."""
    for rate, until in ((100, 1.7), (500, 1.14)):
        for ahead in (False, True):
            model = shallow_ironing.Ironing(COMM, 120, extrapolate=ahead)
            rows = [r for r in model.path(0.0, 10, rate, until) if r.t > 1.0 + 1e-9]
            yield {
                "steps_per_unit": rate,
                "until": until,
                "extrapolate": ahead,
                "iterations": float(np.mean([row.iterations for row in rows])),
                "halved": rows[-1].halvings,
            }


# Line search


def ironed(search, extrapolate=True):
    """Mean iterations of a step, t in [1, 1.2]."""
    model = shallow_ironing.Ironing(
        COMM,
        60,
        gamma=None,
        extrapolate=extrapolate,
        options={"snes_linesearch_type": search},
    )
    rows = [r for r in model.path(0.0, 10, 100, 1.2) if r.t > 1.0 + 1e-9]
    return f"{np.mean([row.iterations for row in rows]):.1f}", rows[-1].halvings


def ringed(search):
    """All iterations of 20 steps."""
    options = {"snes_linesearch_type": search}
    result = half_ring.solve(COMM, 32, 20, options=options)
    return sum(result.iterations), result.halvings


def sheared(cell, method, lifted, search):
    """Clamped blocks of degree 1: iterations in all, with paths of three lengths."""
    found = []
    for count in (1, 4, 16) if lifted else ((1, 1), (2, 1), (6, 3)):
        found.append(attempt(sheared_once, cell, method, lifted, count, search))
    return ", ".join("fails" if n is None else str(n) for n in found), 0


def sheared_once(cell, method, lifted, count, search):
    """Pressed, then sheared; or lifted, then both at once."""
    problem, move = clamped(cell, METHODS[method](), raymortar.Coulomb(0.5))
    options = {"snes_linesearch_type": search}
    solver = raymortar.SNESSolver(problem.problem, options)
    if lifted:
        start, corners = (0.0, 0.01), [((0.02, -0.03), count)]
    else:
        start = (0.0, 0.0)
        corners = [((0.0, -0.06), count[0]), ((0.03, -0.06), count[1])]
    places = [start] if lifted else []
    for corner, steps in corners:
        shares = np.arange(1, steps + 1)[:, None] / steps
        places += list(np.array(start) + shares * (np.array(corner) - start))
        start = corner
    iterations, top = 0, np.zeros(DIMENSION[cell])
    for top[0], top[-1] in places:
        move(top)
        iterations += solver.solve()[0]
        problem.contact.advance()
    return iterations


def line_search():
    """Full steps and PETSc's line searches."""
    runs = {
        "augmented; ironing, each step": (1.0, ironed),
        "augmented; without extrapolation": (1.0, lambda s: ironed(s, False)),
        "augmented; ten times gamma": (10.0, ironed),
        "augmented; half ring": (1.0, ringed),
        "augmented; half ring, five times gamma": (5.0, ringed),
    }
    for method in METHODS:
        for lifted, cell in (
            (False, "quadrilateral"),
            (False, "hexahedron"),
            (True, "quadrilateral"),
            (True, "hexahedron"),
        ):
            name = f"{method}; {'lifted first' if lifted else 'pressed'}, {cell}"
            runs[name] = 1.0, partial_of(cell, method, lifted)
    for name, (factor, run) in runs.items():
        row = {"scene": name}
        for search in SEARCHES:
            with automatic_times(factor):
                found = attempt(run, search)
            row[search], row[f"{search}_halved"] = found or ("fails", "")
        yield row


def partial_of(cell, method, lifted):
    return lambda search: sheared(cell, method, lifted, search)
