"""Stacks of blocks whose interfaces are contacts of one problem, shared by the tests."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import problems
from dolfinx import fem
from problems import COMM, SOLVERS, fix, residual, stack

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import (
    Contact,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    Tresca,
)
from raymortar.core import compat
from raymortar.paths import DisplacementControl

E = 10.0
# Of the tops, at the end of a path: sideways and down
MOTION = {2: (0.02, -0.04), 3: (0.02, 0.01, -0.04)}

# Of two contacts that have nothing in common
LAWS = (
    {"friction": Coulomb(0.3)},
    {"method": Penalty(400.0), "friction": Tresca(0.05), "measure": "current"},
)


class Stack:
    """Blocks on each other, with any of their interfaces in contact.

    Parameters
    ----------
    scene
        Of `problems.stack`, or one whose tags are named alike.
    held, moved
        Names of the tags that rest, and of those that go down and sideways.
    degree
        Of the displacement.
    """

    def __init__(self, scene, held, moved, degree=1, material="linear"):
        self.scene, self.dim = scene, scene.mesh.geometry.dim
        self.V = compat.vector_space(scene.mesh, degree)
        self.u = fem.Function(self.V, name="u")
        self.F, self.moduli, self.load = residual(scene, self.u, material, E)
        self.motion = [
            fem.Constant(scene.mesh, PETSc.ScalarType(0.0)) for _ in range(self.dim)
        ]
        self.bcs = [fix(self.V, scene, held)]
        for i, value in enumerate(self.motion):
            self.bcs.append(fix(self.V, scene, moved, i, value))

    def contact(self, *pairs, method=None, kind=Contact, **options):
        """Contact, or a tie, of pairs of names of tags."""
        tags = [tuple(self.scene.tags[name] for name in pair) for pair in pairs]
        return kind(self.u, self.scene.facet_tags, tags, method, **options)

    def move(self, t):
        """Move the tops to a share of their whole way."""
        for value, end in zip(self.motion, MOTION[self.dim]):
            value.value = t * end

    def top_control(self):
        """The way down of the uppermost top leads the path."""
        dim = self.dim
        facets = self.scene.facet_tags.find(self.scene.tags["top_2"])
        dofs = fem.locate_dofs_topological(self.V, dim - 1, facets)
        return DisplacementControl(dofs, dim - 1, by=MOTION[dim][-1])

    def problem(self, contacts):
        return NonlinearProblem(self.F, contacts, self.bcs)

    def path(self, contacts, steps=3, solver=SOLVERS[-1], file=None, **options):
        """Load steps on contacts, with a history."""
        problem = self.problem(contacts)
        history = History(problem, file, {"held": self.bcs[0]})
        return LoadSteps(solver(problem), self.move, steps, history=history, **options)


def three(cell="triangle", **options):
    """Three blocks on each other."""
    scene = stack(cell, (3, 4, 2), widths=(1.4, 1.0, 1.2))
    return Stack(scene, ["bottom_0"], ["top_2"], **options)


LOWER, UPPER = ("bottom_1", "top_0"), ("bottom_2", "top_1")


def two_pairs(cell="triangle"):
    """Two stacks of two blocks that never meet."""
    gaps, widths = (0.0, 0.0, 9.0, 0.0), (1.4, 1.0, 1.4, 1.0)
    scene = stack(cell, (3, 4, 4, 3), gaps=gaps, widths=widths)
    return Stack(scene, ["bottom_0", "bottom_2"], ["top_1", "top_3"])


FIRST, SECOND = ("bottom_1", "top_0"), ("bottom_3", "top_2")


def table(gap=0.4):
    """A slab on two blocks beside each other, whose ends its facets do not cross."""
    tags = {"bottom": 1, "top": 2}
    blocks = []
    for i, (left, right) in enumerate(((-0.1, 0.4), (0.4 + gap, 0.9 + gap))):
        sides = {name: 10 * (i + 1) + k for name, k in tags.items()}
        blocks.append(Block((3, 3), (left, 0.0), (right, 0.5), tags=sides))
    sides = {name: 30 + k for name, k in tags.items()}
    blocks.append(Block((6, 2), (0.0, 0.5), (0.8 + gap, 1.0), tags=sides))
    mesh, cell_tags, facet_tags = assemble_blocks(
        problems.COMM, blocks, "quadrilateral", 1
    )
    names = {f"{n}_{i}": 10 * (i + 1) + k for i in range(3) for n, k in tags.items()}
    scene = Scene(mesh, cell_tags, facet_tags, names, {str(i): i + 1 for i in range(3)})
    return Stack(scene, ["bottom_0", "bottom_1"], ["top_2"])


ON_FIRST, ON_SECOND = ("bottom_2", "top_0"), ("bottom_2", "top_1")


# Comparisons


def largest(values):
    """Largest absolute value on any rank."""
    return COMM.allreduce(float(np.abs(values).max(initial=0.0)), op=MPI.MAX)


def difference(a, b, where=slice(None)):
    """Of two Functions or arrays, over the largest value of the second."""
    a, b = (getattr(f, "x", f) for f in (a, b))
    a, b = (np.asarray(getattr(x, "array", x))[where] for x in (a, b))
    return largest(a - b) / largest(b)
