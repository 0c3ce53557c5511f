"""Solutions of blocks beside other unknowns along a path, and a field without coupling."""

from __future__ import annotations

from functools import lru_cache

import hosts
import ufl
from dolfinx import fem
from hosts import MU
from problems import SOLVERS, worst

import raymortar
from raymortar import Coulomb, Penalty
from raymortar.core import compat

PUSHES = ((0.0, -0.03), (0.03, -0.06))
METHODS = {
    "vector": {"friction": Coulomb(0.3)},
    "normal": {},
    "penalty": {"method": Penalty(), "friction": Coulomb(0.3)},
}


def solve(found, solver=SOLVERS[0], pushes=PUSHES):
    """Solve along a path; the iterations of its steps."""
    one, iterations = solver(found.problem), []
    for push in pushes:
        found.push(*push)
        iterations.append(one.solve()[0])
        found.contact.advance()
    return iterations


def differences(a, b):
    """Largest differences of the parts of two solutions, over their sizes."""
    return [worst(x - y) / worst(x) for x, y in zip(a, b)]


@lru_cache(maxsize=None)
def solved(way, method, solver=SOLVERS[0]):
    found = hosts.taylor_hood(way, **METHODS[method])
    # Springs that slip want a line search
    solver = SOLVERS[-1] if method == "penalty" else solver
    return found, solve(found, solver)


def alone(**options):
    """Elastic blocks without a further unknown."""
    return elastic(None, **options)


def elastic(way, **options):
    """Elastic blocks, and a field that has nothing to do with them."""
    scene = hosts.blocks()
    mesh = scene.mesh
    parts = {"u": ("Lagrange", 1, (2,)), "c": ("Lagrange", 1, ())}
    dx = ufl.dx(metadata={"quadrature_degree": 2})
    top = hosts.moving_top(scene)

    def of_u(u, v):
        F = ufl.Identity(2) + ufl.grad(u)
        J, inverse = ufl.det(F), ufl.inv(F).T
        stress = MU * (F - inverse) + 2.0 * MU * ufl.ln(J) * inverse
        return ufl.inner(stress, ufl.grad(v)) * dx(mesh)

    def residual(unknowns, tests):
        (u, c), (v, q) = unknowns, tests
        of_c = (ufl.inner(ufl.grad(c), ufl.grad(q)) + (c + c**3 - 2.0) * q) * dx(mesh)
        return [of_u(u, v), of_c][: len(parts)]

    if way is None:
        u = fem.Function(compat.space(mesh, *parts["u"]))
        pairs = [(scene.tags["slave"], scene.tags["master"])]
        contact = raymortar.Contact(u, scene.facet_tags, pairs, **options)
        F = of_u(u, ufl.TestFunction(u.function_space))
        bcs = hosts.conditions(u.function_space, scene, top)
        problem = raymortar.NonlinearProblem(F, contact, bcs)
        return hosts.Hosted(scene, contact, problem, [u], top)
    found = hosts.hosted(
        way,
        scene,
        parts,
        residual,
        lambda spaces: hosts.conditions(spaces[0], scene, top),
        **options,
    )
    found.move = top
    return found
