"""The automatic coefficient, and multiples of it, on whole load paths."""

from __future__ import annotations

from unittest import mock

import blocks_3d
import numpy as np
from models import (
    cattaneo_mindlin,
    half_ring,
    hertz_cylinder,
    hertz_sphere,
    shallow_ironing,
)
from problems import build
from small import clamped_ends, moved, narrow_on_wide
from trials import COMM, attempt, automatic_times

import raymortar

FACTORS = (0.01, 0.1, 0.3, 1.0, 10.0)


def iron(size, friction, press, slide, until):
    """Shallow ironing: the model and its rows."""
    model = shallow_ironing.Ironing(COMM, size, friction=friction, gamma=None)
    rows = list(model.path(0.0, press, slide, until))
    return model, rows


def counted(rows):
    """Iterations and halvings of a path that is given by its rows."""
    return sum(row.iterations for row in rows), rows[-1].halvings


def cylinder(case=hertz_cylinder.SMALL, force=None):
    result = hertz_cylinder.solve(COMM, case, 20, 2, force=force)
    return sum(result.iterations), 0, np.nan


def spheres():
    result = hertz_sphere.solve(COMM, 8)
    found = hertz_sphere.measure(result)
    return sum(result.iterations), 0, found.axis / found.p0 - 1.0


def partial_slip():
    result = cattaneo_mindlin.solve(COMM, 20)
    off = cattaneo_mindlin.measure(result).tangential_off
    return sum(result.iterations), 0, off


def hexahedra():
    return sum(blocks_3d.punch(COMM, 4, 1).iterations), 0, np.nan


def ring(friction, steps):
    result = half_ring.solve(COMM, 32, steps, friction)
    return sum(result.iterations), result.halvings, np.nan


def ironing(size, friction, until):
    model, rows = iron(size, friction, 10, 100, until)
    return *counted(rows), rows[-1].V


# Name: a run that gives iterations, halvings, and the figure in question
SCENES = {
    "Hertz's cylinder, degree 2": cylinder,
    "NAFEMS benchmark 1, degree 2": lambda: cylinder(hertz_cylinder.NAFEMS, 35e3),
    "two spheres; peak pressure": spheres,
    "hexahedra, punch": hexahedra,
    "Cattaneo and Mindlin, degree 2; tangential traction": partial_slip,
    "half ring, mu = 0.5, 20 steps": lambda: ring(0.5, 20),
    "half ring, frictionless, 40 steps": lambda: ring(0.0, 40),
    "ironing, mu = 0.3, 60 x 15, 80 steps; V": lambda: ironing(60, 0.3, 1.7),
    "ironing, frictionless, 60 x 15, 50 steps; V": lambda: ironing(60, 0.0, 1.4),
    "ironing, mu = 0.3, 120 x 30, 70 steps; V": lambda: ironing(120, 0.3, 1.6),
}


def automatic():
    """Iterations over the coefficient, augmented Lagrangian."""
    for name, run in SCENES.items():
        for factor in FACTORS:
            with automatic_times(factor):
                found = attempt(run)
            iterations, halved, figure = found or ("fails", "", np.nan)
            yield {
                "scene": name,
                "factor": factor,
                "iterations": iterations,
                "halved": halved,
                "figure": float(figure),
            }


# Penalty: contact force


def cylinder_force(degree, method):
    case = hertz_cylinder.SMALL
    result = hertz_cylinder.solve(COMM, case, 20, degree, method=method())
    return result.contact.resultant(0).force[1], sum(result.iterations), 0


def ironing_force(method):
    """At t = 1.4, in 30 steps."""
    with automatic_method(method):
        model, rows = iron(60, 0.3, 10, 50, until=1.4)
    return model.contact.resultant(0).force[1], *counted(rows)


def automatic_method(method):
    """Have demos that choose the augmented Lagrangian take another method."""
    return mock.patch.object(raymortar, "AugmentedLagrangian", lambda gamma: method())


def block_force(ratio, method):
    """A block on a block in 2D, the upper one's modulus times a ratio."""
    scene = narrow_on_wide()
    bcs, top = clamped_ends(scene)
    moduli = {"lower": 10.0, "upper": 10.0 * ratio}
    problem = build(scene, 1, "neo-hookean", method(), E=moduli, bcs=bcs)

    def apply(factor):
        top.value[-1] = -0.1 * 1.6 * factor

    iterations = moved(problem, apply)
    return problem.contact.resultant(0).force[-1], sum(iterations), 0


FORCES = {
    "Hertz's cylinder, degree 1": lambda method: cylinder_force(1, method),
    "Hertz's cylinder, degree 2": lambda method: cylinder_force(2, method),
    "ironing, mu = 0.3, 60 x 15": ironing_force,
    "block on a block, upper 1000 times softer": lambda m: block_force(1e-3, m),
    "block on a block, equally stiff": lambda method: block_force(1.0, method),
    "block on a block, upper 1000 times stiffer": lambda m: block_force(1e3, m),
}


def automatic_penalty():
    """Error of the force against the augmented Lagrangian; factors of the stiffness,
    of which penalty's automatic coefficient is ten times."""
    for name, run in FORCES.items():
        exact = run(raymortar.AugmentedLagrangian)[0]
        for factor in (1.0, 3.0, 10.0, 30.0):
            with automatic_times(factor / raymortar.Penalty.automatic_factor):
                found = attempt(run, raymortar.Penalty)
            force, iterations, halved = found or (np.nan, "fails", "")
            yield {
                "scene": name,
                "factor": factor,
                "force": float(force / exact - 1.0),
                "iterations": iterations,
                "halved": halved,
            }


# With friction


def with_friction():
    """Mean reactions of ironing over the coefficient and the slip of a step."""
    for size, gamma, slip, window in (
        *((60, g, 0.025, (1.3, 1.4)) for g in (300.0, 1000.0, None)),
        *((60, g, 0.1, (1.3, 1.4)) for g in (300.0, 1000.0, None, 20000.0)),
        *((120, g, 1 / 12, (1.3, 1.7)) for g in (100.0, 300.0, 1000.0, 3000.0)),
        *((120, g, 1 / 12, (1.3, 1.7)) for g in (None, 10000.0, 30000.0)),
    ):
        model = shallow_ironing.Ironing(COMM, size, gamma=gamma)
        rate = shallow_ironing.SLID / slip
        rows = list(model.path(0.0, 10, rate, window[1]))
        late = [row for row in rows if row.t >= window[0] - 1e-9]
        slides = [row for row in rows if row.t > 1.0 + 1e-9]
        yield {
            "size": size,
            "gamma": "automatic" if gamma is None else gamma,
            "value": float(np.mean(model.contact.gamma)),
            "slip": slip,
            "V": float(np.mean([row.V for row in late])),
            "H": float(np.mean([row.H for row in late])),
            "iterations": float(np.mean([row.iterations for row in slides])),
            "halved": rows[-1].halvings,
        }
