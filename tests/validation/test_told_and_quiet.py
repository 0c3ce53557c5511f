"""Right programs are told nothing, wrong ones by words that mend them (issue 55)."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import dolfinx
import dolfinx.mesh
import numpy as np
import pytest
import ufl
from boxes import COMM
from dolfinx import fem

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactWarning,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    Tie,
    rigid,
)
from raymortar.core import compat
from raymortar.tools import prescribe, vector_space

ROOT = Path(__file__).parents[2]
NAMES = {"lid": "slave", "bed": "master", "bottom": "bottom", "top": "top"}
PAIR = ("lid", "bed")


class Blocks:
    """A block on another one, whose top is led."""

    def __init__(self, lower=6, upper=4, law="neo-hookean", **scene):
        self.scene = two_blocks(COMM, 2, "quadrilateral", lower, upper, **scene)
        self.mesh, self.tags = self.scene.mesh, self.scene.facet_tags
        self.V = vector_space(self.mesh, 1)
        self.u, self.v = fem.Function(self.V), ufl.TestFunction(self.V)
        self.names = {name: self.scene.tags[tag] for name, tag in NAMES.items()}
        self.down = fem.Constant(self.mesh, np.zeros(2))
        self.form = self.of(self.u, law)
        self.bcs = [
            prescribe(self.V, self.find("bottom")),
            prescribe(self.V, self.find("top"), self.down),
        ]

    def find(self, name):
        return self.tags.find(self.names[name])

    def of(self, u, law="neo-hookean"):
        if law == "linear":
            strain = ufl.sym(ufl.grad(u))
            stress = 2.0 * strain + ufl.tr(strain) * ufl.Identity(2)
            return ufl.inner(stress, ufl.grad(self.v)) * ufl.dx
        F = ufl.Identity(2) + ufl.grad(u)
        log_J = ufl.ln(ufl.det(F))
        energy = 0.5 * (ufl.inner(F, F) - 2) - log_J + log_J**2
        return ufl.derivative(energy * ufl.dx(degree=3), u, self.v)

    def problem(self, pairs=(PAIR,), petsc_options=None, **options):
        tags = options.pop("tags", self.tags)
        pairs = list(pairs) if isinstance(pairs, tuple) else pairs
        contact = Contact(self.u, tags, pairs, names=self.names, **options)
        return NonlinearProblem(
            self.form, contact, self.bcs, petsc_options=petsc_options
        )

    def solve(self, down=-0.05, aside=0.0, **options):
        problem = self.problem(**options)
        self.down.value[:] = aside, down
        problem.solve()
        return problem

    def path(self, down=-0.05, aside=0.0, steps=2, **options):
        problem = self.problem(**options)

        def apply(t):
            self.down.value[:] = aside * t, down * t

        LoadSteps(SNESSolver(problem), apply, steps, progress=False).run()


def ball(n, depth, place=1.3, radius=0.3, friction=None):
    """A rigid circle pressed on a block."""
    blocks = Blocks(n, 2, gap=1.0)
    circle = rigid.Body(rigid.Circle((0.45, place), radius), name="ball")
    contact = Contact(
        blocks.u, blocks.tags, [("bed", circle)], names=blocks.names, friction=friction
    )
    problem = NonlinearProblem(blocks.form, contact, blocks.bcs)
    LoadSteps(
        SNESSolver(problem), lambda t: circle.move((0.0, -depth * t)), 2, progress=False
    ).run()


def flat(place, normal, **options):
    line = rigid.Body(rigid.Line(place, normal), name="floor")
    Blocks(gap=0.5).solve(pairs=[("lid", line)], **options)


def loaded(kept):
    blocks = Blocks()
    blocks.form += ufl.inner(ufl.as_vector((0.02, 0.1)), blocks.v) * ufl.dx
    blocks.bcs = blocks.bcs[:kept]
    blocks.solve()


def changed(**attributes):
    blocks = Blocks()
    for name, value in attributes.items():
        setattr(blocks, name, value(blocks))
    blocks.solve()


def three_solves(accepts):
    blocks = Blocks()
    problem = blocks.problem(friction=Coulomb(0.2))
    for k in range(1, 5):
        blocks.down.value[:] = 0.05 * k, -0.02 * k
        problem.solve()
        if accepts:
            problem.contact.advance()


def tied():
    blocks = Blocks()
    tie = Tie(blocks.u, blocks.tags, [PAIR], names=blocks.names)
    blocks.down.value[:] = 0.1, 0.1
    NonlinearProblem(blocks.form, tie, blocks.bcs).solve()


def given(*conditions, mode="solve", force=0.0, **options):
    """Blocks with some of their conditions, and a force on both along y."""
    blocks = Blocks()
    if force:
        blocks.form += ufl.inner(ufl.as_vector((0.0, force)), blocks.v) * ufl.dx
    blocks.bcs = [blocks.bcs[k] for k in conditions]
    getattr(blocks, mode)(**options)


def inside_one_body():
    """Blocks that share the nodes of their interface."""
    mesh = dolfinx.mesh.create_rectangle(COMM, [[0.0, 0.0], [1.0, 2.0]], [4, 8])
    found = [
        find(mesh, 1, lambda x, y=y: np.isclose(x[1], y))
        for find, y in (
            (dolfinx.mesh.locate_entities, 1.0),
            (dolfinx.mesh.locate_entities_boundary, 2.0),
        )
    ]
    facets, tags = np.concatenate(found), np.repeat([1, 2], [len(one) for one in found])
    order = np.argsort(facets)
    tagged = compat.meshtags(mesh, 1, facets[order], tags[order].astype(np.int32))
    Contact(fem.Function(vector_space(mesh, 1)), tagged, [(1, 2)])


def other_way_round():
    """Forces asked for by the master."""
    problem = Blocks().solve()
    problem.contact.resultant("bed", "lid")


RIGHT = {
    "one solve": lambda: Blocks().solve(),
    "steps": lambda: Blocks().path(-0.2),
    "linear": lambda: Blocks(law="linear").solve(),
    "friction": lambda: Blocks().path(-0.1, 0.1, friction=Coulomb(0.3)),
    "penalty": lambda: Blocks().solve(method=Penalty()),
    "finer slave": lambda: Blocks(4, 12).solve(),
    "finer master": lambda: Blocks(16, 5).solve(),
    "other sides": lambda: Blocks().solve(pairs=[PAIR[::-1]]),
    "master's frame": lambda: Blocks().solve(frame="master"),
    "a gap that closes": lambda: Blocks(gap=0.01).path(-0.1),
    "a gap that stays": lambda: Blocks(gap=0.2).solve(),
    "lifted": lambda: Blocks().solve(0.05),
    "interference": lambda: Blocks().solve(0.0, offset=-0.02),
    "interface that waves": lambda: Blocks(
        interface=lambda x: 1.0 + 0.02 * np.sin(6.0 * x[:, 0]), lower=16, upper=12
    ).path(-0.1),
    "ball on many facets": lambda: ball(32, 0.03),
    "ball beside which a multiplier swings": lambda: ball(12, 0.03),
    "ball that rubs": lambda: ball(24, 0.03, friction=Coulomb(0.3)),
    "floor": lambda: flat((0.5, 1.5), (0.0, 1.0)),
    "accepted solves": lambda: three_solves(True),
    "tie": tied,
}
# Wrong programs, with words by which each is mended
WRONG = {
    "misspelt name": (lambda: Blocks().solve(pairs=[("lidd", "bed")]), "'lid'"),
    "missing tag": (lambda: Blocks().solve(pairs=[(99, "bed")]), "99"),
    "another face": (
        lambda: Blocks().solve(-0.3, pairs=[("lid", "bottom")]),
        "tag that of another face",
    ),
    "another face on a path": (
        lambda: Blocks().path(-0.3, pairs=[("lid", "bottom")]),
        "tag that of another face",
    ),
    "far apart": (lambda: Blocks(gap=5.0).solve(), "another unit"),
    "floor far below": (lambda: flat((0.5, -50.0), (0.0, 1.0)), "another unit"),
    "floor upside down": (lambda: flat((0.5, 1.5), (0.0, -1.0)), "normal"),
    "a floor through the block": (lambda: flat((0.5, 1.7), (0, 1)), "deep in"),
    "nothing held": (lambda: loaded(0), "held by nothing"),
    "upper block not held": (lambda: loaded(1), "held by nothing"),
    "negative friction": (lambda: Blocks().solve(friction=Coulomb(-0.3)), "negative"),
    "friction as number": (lambda: Blocks().solve(friction=0.3), "Coulomb"),
    "pair not in a list": (lambda: Blocks().solve(pairs=["lid", "bed"]), "pairs"),
    "method by name": (lambda: Blocks().solve(method="penalty"), "Penalty"),
    "both sides one tag": (lambda: Blocks().solve(pairs=[("lid", "lid")]), "Penalty"),
    "scalar space": (
        lambda: changed(
            u=lambda b: fem.Function(vector_space(b.mesh, 1).sub(0).collapse()[0])
        ),
        "displacement",
    ),
    "conditions of another space": (
        lambda: changed(
            bcs=lambda b: [prescribe(vector_space(b.mesh, 1), b.find("top"))]
        ),
        "space",
    ),
    "form of another function": (
        lambda: changed(form=lambda b: b.of(fem.Function(b.V))),
        "does not depend on",
    ),
    "tags of another mesh": (
        lambda: changed(tags=lambda b: Blocks().tags),
        "another mesh",
    ),
    "misspelt option": (
        lambda: Blocks().solve(petsc_options={"snes_maxit": 5}),
        "'snes_maxit'",
    ),
    "bodies that overlap": (lambda: Blocks(gap=-0.1).solve(), "starts 0.1 deep"),
    "interference in another unit": (
        lambda: Blocks().solve(0.0, offset=-20.0),
        "unit of the mesh",
    ),
    "motion in another unit": (lambda: Blocks(law="linear").solve(-5.0), "unit"),
    "gamma in another unit": (
        lambda: Blocks().solve(method=AugmentedLagrangian(gamma=1e-300)),
        "leave gamma out",
    ),
    "soft penalty": (
        lambda: Blocks(law="linear").solve(method=Penalty(1e-3)),
        "gamma",
    ),
    "ball on two facets": (lambda: ball(3, 0.03), "Make facets there smaller"),
    "ball of another unit": (lambda: ball(8, 0.03, 1300.0, 300.0), "another unit"),
    "solves that nobody accepts": (lambda: three_solves(False), "contact.advance()"),
    "results before a solve": (
        lambda: Blocks().problem().contact.resultant(),
        "nothing has been solved yet",
    ),
    "findings before a solve": (
        lambda: Blocks().problem(method=Penalty()).check(),
        "solve",
    ),
    "no condition and no load": (lambda: given(), "nothing holds it along x"),
    "the upper block forgotten": (lambda: given(0), "nothing holds it along x"),
    "a block on a frictionless one": (
        lambda: given(0, force=0.1),
        "Prescribe it there, or give friction",
    ),
    "a path of a block on a frictionless one": (
        lambda: given(0, force=0.1, mode="path"),
        "Prescribe it there, or give friction",
    ),
    "a form with the trial function": (
        lambda: changed(form=lambda b: b.of(ufl.TrialFunction(b.V), "linear")),
        "rank 2",
    ),
    "a displacement of degree 3": (
        lambda: changed(u=lambda b: fem.Function(vector_space(b.mesh, 3))),
        "supported are 1 and 2",
    ),
    "tags of cells": (
        lambda: changed(tags=lambda b: b.scene.cell_tags),
        "entities of dimension 2",
    ),
    "bodies that share nodes": (inside_one_body, "must not share nodes"),
    "forces by the master": (other_way_round, "('lid', 'bed')"),
    "displacement in place of contact": (
        lambda: NonlinearProblem(Blocks().form, Blocks().u, []),
        "must be a Contact",
    ),
    "nearly all of the height at once": (lambda: Blocks().solve(-1.7), "LoadSteps"),
    "friction by another name": (lambda: Blocks().solve(mu=0.3), "'mu'"),
}


# A sentence has at most so many words besides names, numbers and places in brackets
MOST_WORDS = 25
PAGE = re.compile(r" \(docs/messages/([a-z]+)\.md\)$")


def fault_of_form(text):
    """What is wrong with the form of a warning, if anything."""
    if "\n" in text:
        return "has several lines"
    page = PAGE.search(text)
    if page is None or not (ROOT / f"docs/messages/{page[1]}.md").is_file():
        return "has no page"
    plain = re.sub(r"\([^()]*\)|'[^']*'", "", text[: page.start()])
    count = len(re.findall(r"[A-Za-z_]{2,}", plain))
    return f"has {count} words" if count > MOST_WORDS else None


def told(program):
    """Warnings of a program, and its error."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        try:
            program()
            error = []
        except Exception as failure:
            error = [f"{type(failure).__name__}: {failure}"]
    ours = [w for w in caught if issubclass(w.category, ContactWarning)]
    texts = [str(w.message) for w in ours]
    faults = {text: fault_of_form(text) for text in texts if fault_of_form(text)}
    assert not faults and len(set(texts)) == len(texts), faults or texts
    assert {w.filename for w in ours} <= {__file__}  # the user's own line
    return texts + error


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_program_is_told_nothing(name):
    assert told(RIGHT[name]) == []


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_program_is_told_what_mends_it(name):
    program, words = WRONG[name]
    assert any(words in text for text in told(program)), told(program)


def test_there_are_enough_programs():
    assert len(RIGHT) >= 20 and len(WRONG) >= 40
