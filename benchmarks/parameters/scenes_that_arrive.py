"""Scenes that have to arrive with nothing tuned, and what their paths take."""

from __future__ import annotations

import time
import warnings
from unittest import mock

import numpy as np
import ufl
from arriving import free_disc, loose_stack, squeezed_disc, stacked
from dolfinx import fem
from first_tries import read
from materials import MATERIALS, lame
from models import forming
from pathing import Path, take
from points_and_nodes import law_at
from slender import bent, leaves
from trials import COMM

import raymortar
from raymortar import rigid, tools

# Of the O-ring, in m and Pa
CORD, GROOVE, FLUID = 5e-3, 4e-3, 3e6


def o_ring(size=3e-4, steps=12):
    """A cord of rubber squeezed in its groove in 5 steps, then wetted from the left.

    The part of the skin that is not in contact is wet.
    """

    def draw(occ):
        disc = occ.addDisk(0, CORD / 2, 0, CORD / 2, CORD / 2)
        return {"cord": disc}, {"skin": ("cord", lambda x, y: True)}

    found = read(draw, size)
    mesh, tags = found.mesh, found.facet_tags
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V), ufl.TestFunction(V)
    fluid, wet = fem.Constant(mesh, 0.0), fem.Function(tools.scalar_space(mesh, 2))
    F = ufl.Identity(2) + ufl.grad(u)
    ds = ufl.Measure("ds", mesh, subdomain_data=tags)(found.names["skin"][1])
    stress = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(6e6, 0.47))
    normal = ufl.det(F) * ufl.inv(F).T * ufl.FacetNormal(mesh)
    form = ufl.inner(stress, ufl.grad(v)) * ufl.dx(degree=4)
    form += fluid * wet * ufl.inner(normal, v) * ds(degree=6)
    lines = [((0, CORD), (0, -1)), ((0, 0), (0, 1)), ((CORD / 2 + 2e-4, 0), (-1, 0))]
    walls = [rigid.Body(rigid.Line(*line)) for line in lines]
    pairs = [("skin", wall) for wall in walls]
    contact = raymortar.Contact(
        u, tags, pairs, friction=raymortar.Coulomb(0.1), names=found.names
    )
    left = wet.function_space.tabulate_dof_coordinates()[:, 0] < 0.0
    share = 5 / (5 + steps)

    def apply(t):
        walls[0].move((0.0, -(CORD - GROOVE) * min(t / share, 1.0)))
        fluid.value = FLUID * max(t - share, 0.0) / (1.0 - share)

    def accepted():
        wet.interpolate(contact.status())
        wet.x.array[:] = left & (wet.x.array < 1.5)

    problem = raymortar.NonlinearProblem(form, contact)
    options = {"on_accept": accepted}
    return Path(problem, apply, 5 + steps, lambda: None, options)


def drawing(depth=0.8, steps=16):
    """Deep drawing of a sheet with the automatic coefficient, from the touch on."""
    with mock.patch.object(forming, "GAMMA", None):
        model = forming.Forming(COMM, 2)
    model.punch.move((0.0, forming.ABOVE))
    first = 1 / (steps + 1)  # the punch comes down to the sheet

    def apply(t):
        down = max(t - first, 0.0) / (1.0 - first)
        model.punch.move(
            (0.0, forming.ABOVE * max(1.0 - t / first, 0.0) - depth * down)
        )

    return Path(model.problem, apply, steps + 1)


def scenes():
    """Scene, law and what makes its path."""
    for steps in (3, 6, 12, 24, 48):
        yield f"three blocks, {steps} steps", "points", lambda n=steps: stacked(n)
    for law in ("points", "nodes"):
        for slenderness in (20, 60, 100):
            scene = f"strip, L/t {slenderness}, mu 0.3"
            yield scene, law, lambda s=slenderness: bent(s, 0.3)
        yield "deep drawing", law, drawing
        yield "O-ring, squeezed and wetted", law, o_ring
        yield "three leaves, 4 steps", law, lambda: leaves(share=1.0, steps=4)
    yield "loose stack, fine, degree 2", "points", lambda: loose_stack(2, 2)
    yield "free disc", "points", free_disc
    yield "disc between lines, penalty", "penalty", squeezed_disc


def arriving():
    """Iterations, halvings, tangents and ways of each path."""
    for scene, law, make in scenes():
        with law_at("points" if law == "penalty" else law), warnings.catch_warnings():
            warnings.simplefilter("ignore", raymortar.ContactWarning)
            path, start = make(), time.process_time()
            found = take(path)
        counts = [step.iterations for step in found.steps]
        yield {
            "scene": scene,
            "law": law,
            "arrived": "yes" if found.arrived else "no",
            "steps": len(counts),
            "mean": float(np.mean(counts)) if counts else "",
            "most": max(counts, default=""),
            "halvings": found.halvings,
            "tangents": found.tangents,
            "ways": "; ".join(
                f"{way} {n}" for way, n in found.ways.items() if way != "full"
            ),
            "seconds": round(time.process_time() - start, 1),
        }
