"""Blocks that adhere to each other, shared by the tests of adhesion."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from problems import COMM, build, fix

from meshes.scenes import two_blocks
from raymortar import Cohesive, SNESSolver

STRENGTH, TOUGHNESS = (5.0, 8.0), (0.2, 0.5)
HEIGHT = 2.0


def glue(unit=1.0, **options):
    """The law, with stresses in some unit."""
    given = {"strength": STRENGTH, "toughness": TOUGHNESS} | options
    for name in ("strength", "toughness"):
        given[name] = tuple(unit * value for value in np.broadcast_to(given[name], 2))
    return Cohesive(**given)


class Blocks:
    """Two blocks of height 1 and width 1 without lateral strain, the upper one led."""

    def __init__(
        self, cell="quadrilateral", degree=1, modulus=2000.0, unit=1.0, law=None, **more
    ):
        dim = 2 if cell in ("triangle", "quadrilateral") else 3
        options = {n: more.pop(n) for n in ("gap", "rotation") if n in more}
        divisions = (3, 4) if dim == 2 else (2, 3)
        scene = two_blocks(COMM, dim, cell, *divisions, **options)
        self.top = fem.Constant(scene.mesh, np.zeros(dim))
        material = more.pop("material", "linear")
        self.model = build(
            scene,
            degree,
            material,
            more.pop("method", None),
            E=unit * modulus,
            nu=0.0,
            bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", None, self.top)],
            adhesion=glue(unit) if law is None else law,
            **more,
        )
        self.problem, self.contact = self.model.problem, self.model.contact
        self.bond = self.contact.bond
        self.solver = SNESSolver(self.problem)
        self.solver.snes.setTolerances(rtol=1e-11, max_it=25)

    def lead(self, *displacement):
        """Lead the top there in one step, and accept it; the force on the master."""
        self.top.value[:] = displacement
        self.solver.solve()
        force = -self.bond.force()
        self.contact.advance()
        return force


def criticals(law):
    """Openings in both modes at which nothing holds any more."""
    pairs = zip(np.broadcast_to(law.strength, 2), np.broadcast_to(law.toughness, 2))
    return [2.0 * G / s for s, G in pairs]
