"""Several contacts beside other unknowns, and on several meshes."""

from __future__ import annotations

import hosts
import numpy as np
import pytest
import ufl
from dolfinx import fem
from interacting import LOWER, MOTION, UPPER
from problems import fix, stack

import raymortar
from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    versions,
)
from raymortar.core import compat

# Other unknowns, and other meshes


def test_contacts_between_bodies_on_meshes_of_their_own():
    """Two penalties of half the coefficient are one of the whole."""
    forces = []
    for parts in (1, 2):
        pairs, law = [(hosts.UPPER + 1, hosts.LOWER + 2)], Coulomb(0.2)
        hosted = hosts.apart(hosts.meshes(), method=Penalty(20.0), friction=law)
        tags = [scene.facet_tags for scene in hosted.scene]
        given = hosted.functions
        contacts = [
            raymortar.Contact(given, tags, pairs, Penalty(20.0 / parts), friction=law)
            for _ in range(parts)
        ]
        F, bcs = hosted.problem.forms[0], hosted.problem.bcs
        problem = NonlinearProblem(F, contacts, bcs, u=given)
        solver = SNESSolver(problem)
        for t in (0.5, 1.0):
            hosted.push(0.02 * t, -0.05 * t)
            solver.solve()
            problem.contact.advance()
        found = [problem.contact.resultant(i).force for i in range(parts)]
        forces.append(np.sum(found, axis=0))
    assert np.allclose(*forces, rtol=1e-9, atol=0.0)
    assert forces[0][1] > 0.0


@pytest.mark.parametrize("way", ["mixed", "blocked"])
def test_contacts_are_beside_other_unknowns(way):
    """A part of a mixed Function, and one of several Functions."""
    ends = []
    for split in (False, True):
        scene = stack("triangle", (2, 3, 2))
        tags = [tuple(scene.tags[n] for n in pair) for pair in (LOWER, UPPER)]
        parts = ("Lagrange", 2, (2,)), ("Lagrange", 1, ())
        if way == "mixed":
            w = fem.Function(versions.mixed_space(scene.mesh, *parts))
            functions, spaces = [w], [w.function_space.sub(0)]
            (u, p), given = ufl.split(w), w.sub(0)
            tests = ufl.split(ufl.TestFunction(w.function_space))
        else:
            u, p = functions = [
                fem.Function(compat.space(scene.mesh, *part), name=name)
                for name, part in zip("up", parts)
            ]
            given, spaces = u, [u.function_space]
            tests = [ufl.TestFunction(f.function_space) for f in functions]
        v, q = tests
        P, equation = hosts.neo_hookean(u, p, 100.0 * hosts.MU)
        dx = ufl.dx(metadata={"quadrature_degree": 4})
        F = [ufl.inner(P, ufl.grad(v)) * dx, ufl.inner(equation, q) * dx]
        bcs = [fix(spaces[0], scene, "bottom_0", i) for i in (0, 1)]
        bcs += [fix(spaces[0], scene, "top_2", i, MOTION[2][i]) for i in (0, 1)]
        options = {"method": AugmentedLagrangian(5.0), "friction": Coulomb(0.2)}

        def contact(*pairs):
            return raymortar.Contact(given, scene.facet_tags, pairs, **options)

        contacts = [contact(pair) for pair in tags] if split else contact(*tags)
        several = {} if way == "mixed" else {"u": functions}
        F = sum(F[1:], F[0]) if way == "mixed" else F
        problem = NonlinearProblem(F, contacts, bcs, **several)
        SNESSolver(problem).solve()
        ends.append([problem.contact.resultant(i).force for i in (0, 1)])
    assert np.allclose(*ends, rtol=1e-8, atol=1e-10)


def test_slaves_may_be_on_several_meshes():
    """Springs from either side: each mesh has slaves of one contact."""
    sides = (hosts.UPPER + 1, hosts.LOWER + 2)
    hosted = hosts.apart(hosts.meshes(), method=Penalty(40.0))
    tags = [scene.facet_tags for scene in hosted.scene]
    contacts = [
        raymortar.Contact(hosted.functions, tags, [pair], Penalty(20.0))
        for pair in (sides, sides[::-1])
    ]
    F, bcs = hosted.problem.forms[0], hosted.problem.bcs
    both = NonlinearProblem(F, contacts, bcs, u=hosted.functions)
    forces = []
    for problem in (both, hosted.problem):
        for f in hosted.functions:
            f.x.array[:] = 0.0
        hosted.push(0.0, -0.05)
        SNESSolver(problem).solve()
        zones = range(len(problem.contact.zones))
        found = [problem.contact.resultant(i).force[1] for i in zones]
        # The second contact's slave is the lower block
        forces.append(found[0] - sum(found[1:]))
    assert found[0] > 0.0
    assert forces[0] == pytest.approx(forces[1], rel=0.05)
