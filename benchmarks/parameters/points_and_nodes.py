"""Where the law holds: at points, at nodes, and at nodes with dual multipliers."""

from __future__ import annotations

import contextlib
import time
from functools import partial, partialmethod
from types import SimpleNamespace
from unittest import mock

import bodies
import coefficient
import manufactured
import numpy as np
import ufl
from dolfinx import fem
from manufactured_fields import SQUARE
from models import cattaneo_mindlin as cylinders
from models import hertz_cylinder
from trials import COMM, attempt, automatic_times

import raymortar
from meshes.scenes import two_cylinders
from raymortar import tools

CONDITIONS = {
    "points": {"condition": "points"},
    "nodes": {"condition": "nodes"},
    "dual": {"condition": "nodes", "multiplier": "dual"},
}


@contextlib.contextmanager
def law_at(condition):
    """Default of every multiplier made within: a law at points or at nodes."""
    method = raymortar.AugmentedLagrangian
    changed = partialmethod(method.__init__, **CONDITIONS[condition])
    with mock.patch.object(method, "__init__", changed):
        yield


# Paths


def paths():
    """Iterations, CPU seconds and results of whole paths."""
    for scene, run in scenes().items():
        for condition in CONDITIONS:
            with law_at(condition):
                start = time.process_time()
                iterations, halved, figure = attempt(run) or ("fails", "", np.nan)
                seconds = time.process_time() - start
            yield {
                "scene": scene,
                "condition": condition,
                "iterations": iterations,
                "halved": halved,
                "seconds": round(seconds, 1),
                "figure": float(figure),
            }


def scenes():
    """Runs by name, each gives iterations, halvings and the figure in question."""
    repeated = ("120 x 30", "two spheres")
    return {
        name: run
        for name, run in {**coefficient.SCENES, **ERRORS}.items()
        if not any(word in name for word in repeated)
    }


def hertz_error(degree):
    """Error of the vertical traction in L2, of Hertz's pressure over the undeformed x."""
    case = hertz_cylinder.SMALL
    result = hertz_cylinder.solve(COMM, case, 20, degree)
    scene, lam = result.scene, result.contact.multiplier
    # A scalar multiplier is the normal traction
    p = lam[1] if lam.ufl_shape else -lam
    force = 2.0 * result.contact.resultant(0).force[1]
    a = fem.Constant(
        scene.mesh, np.sqrt(4.0 * force * case.radius / (np.pi * hertz_cylinder.E_STAR))
    )
    x = ufl.SpatialCoordinate(scene.mesh)[0]
    hertz = 2.0 * force / (np.pi * a) * ufl.sqrt(ufl.max_value(0, 1 - (x / a) ** 2))
    rule = {"quadrature_degree": 8}
    ds = ufl.Measure("ds", scene.mesh, subdomain_data=scene.facet_tags, metadata=rule)
    ds = ds(scene.tags["slave"])
    error, size = (tools.integral(f**2 * ds, scene.mesh) for f in (p - hertz, hertz))
    return sum(result.iterations), 0, np.sqrt(error / size)


def partial_slip_error(degree):
    """Error of the tangential traction in L2."""
    result = cylinders.solve(COMM, 20, degree)
    return sum(result.iterations), 0, cylinders.measure(result).tangential_off


def manufactured_error(cell, degree):
    """Error of the multiplier in L2."""
    problem = manufactured.solve(SQUARE, cell, 32 // degree, degree, shake=0.2)
    return "", "", problem.errors()["multiplier"]


ERRORS = {
    "Hertz's cylinder, degree 1; pressure": partial(hertz_error, 1),
    "Hertz's cylinder, degree 2; pressure": partial(hertz_error, 2),
    "Cattaneo and Mindlin, degree 1; tangential traction": partial(
        partial_slip_error, 1
    ),
    "manufactured, triangles of degree 1; multiplier": partial(
        manufactured_error, "triangle", 1
    ),
    "manufactured, quadrilaterals of degree 2; multiplier": partial(
        manufactured_error, "quadrilateral", 2
    ),
}

# Partial slip

STICK = raymortar.results.Status.STICK
DEPTH = 0.45
LEGS = 16
# Half ways of the cycles: shear forces of 0.19 and 0.72 of what friction can carry
WAYS = {"0.19": 0.0315, "0.72": 0.125}


class Cylinders:
    """Two cylinders whose cuts are held: pressed together, then moved to and fro."""

    def __init__(self, facets):
        scene = two_cylinders(
            COMM,
            geometry_degree=1,
            radius=cylinders.RADIUS,
            contact_half_width=cylinders.B,
            facets_across=facets,
            master_ratio=0.8,
        )
        V = tools.vector_space(scene.mesh, 1)
        self.u, v = fem.Function(V), ufl.TestFunction(V)
        stress = bodies.hooke(self.u, cylinders.E, cylinders.NU)
        self.contact = raymortar.Contact(
            self.u,
            scene.facet_tags,
            [(scene.tags["slave"], scene.tags["master"])],
            friction=raymortar.Coulomb(cylinders.FRICTION),
        )
        self.cut = fem.Constant(scene.mesh, np.zeros(2))
        bcs = [
            tools.prescribe(V, scene.find("bottom")),
            tools.prescribe(V, scene.find("top"), self.cut),
        ]
        form = ufl.inner(stress, bodies.small_strain(v)) * ufl.dx
        problem = raymortar.NonlinearProblem(form, self.contact, bcs)
        self.solver = raymortar.SNESSolver(problem, cylinders.LINE_SEARCH)
        self.iterations = 0

    def to(self, x, y):
        """Shear and normal force with the upper cut there."""
        self.cut.value[:] = x, -y
        self.iterations += self.solver.solve()[0]
        self.contact.advance()
        force = self.contact.resultant(0).force
        return force[0], force[1]

    def half_widths(self):
        """Half widths of contact and of stick, by their shares of the surface."""
        points = self.contact.points()
        found = []
        status = points["status"]
        for chosen in (status >= STICK, status == STICK):
            found.append(0.5 * float(points["weight"][chosen].sum()))
        return found


def cycled(facets, way):
    """Loop of the second cycle, and the state where the first leg ends."""
    model = Cylinders(facets)
    for y in (0.5 * DEPTH, DEPTH):
        model.to(0.0, y)
    legs = np.arange(1, LEGS + 1) / LEGS
    first = [model.to(way * s, DEPTH) for s in legs][-1]
    a, c = model.half_widths()
    path = [way * (1.0 - 2.0 * s) for s in legs]
    path += [-x for x in path]
    for x in path:
        model.to(x, DEPTH)
    shears = [model.to(x, DEPTH)[0] for x in path]
    ends = np.array([way, *path]), np.array([shears[-1], *shears])
    area = float(abs(np.trapz(ends[1], ends[0])))
    share = abs(first[0]) / (cylinders.FRICTION * abs(first[1]))
    return SimpleNamespace(
        area=area, share=share, a=a, c=c, iterations=model.iterations
    )


def partial_slip():
    """Energy of a cycle in partial slip, and width of the zone that sticks."""
    for facets in (20, 40):
        for share, way in WAYS.items():
            for condition in CONDITIONS:
                for factor in (0.1, 1.0, 10.0):
                    with law_at(condition), automatic_times(factor):
                        found = attempt(cycled, facets, way)
                    yield slip_row(facets, share, condition, factor, found)


def slip_row(facets, share, condition, factor, found):
    row = {
        "facets": facets,
        "share": share,
        "condition": condition,
        "gamma": factor,
    }
    if found is None:
        nothing = dict.fromkeys(("Q", "loop", "stick", "mindlin", "facet"), "")
        return {**row, **nothing, "iterations": "fails"}
    return {
        **row,
        "Q": found.share,
        "loop": found.area,
        "stick": found.c / found.a,
        "mindlin": np.sqrt(1.0 - found.share),
        "facet": 2.0 * cylinders.B / facets / found.a,
        "iterations": found.iterations,
    }
