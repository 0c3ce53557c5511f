"""Pretension: a cut shank that is tightened by a force, and keeps its length."""

from __future__ import annotations

import warnings

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem
from tangents import remainders_in_petsc

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    Checkpoint,
    ContactError,
    ContactWarning,
    ConvergenceError,
    History,
    LoadSteps,
    NonlinearProblem,
    Pretension,
    SNESSolver,
    rigid,
    tools,
)

COMM = MPI.COMM_WORLD
CUT_A, CUT_B, LEFT, RIGHT = 1, 2, 3, 4
E, LENGTH, HEIGHT, FORCE = 200.0, 2.0, 0.5, 3.0
TOLERANCE = 1e-9


class Bars:
    """Two bars in a line without lateral strain, held at both ends."""

    def __init__(self, cell, degree=1, axis=None, faces=(CUT_A, CUT_B), stiff=1.0):
        dim = 2 if cell in ("triangle", "quadrilateral") else 3
        ends = (0.0, LENGTH, 2.0 * LENGTH)
        blocks = [
            Block(
                (4, n) + (2,) * (dim - 2),
                (ends[k],) + (0.0,) * (dim - 1),
                (ends[k + 1],) + (HEIGHT,) * (dim - 1),
                tags=tags,
                body=f"{k}",
            )
            for k, (n, tags) in enumerate(
                [
                    (2, {"left": LEFT, "right": CUT_A}),
                    (3, {"left": CUT_B, "right": RIGHT}),
                ]
            )
        ]
        self.mesh, _, self.tags = assemble_blocks(COMM, blocks, cell)
        self.V = V = tools.vector_space(self.mesh, degree)
        self.u, v = fem.Function(V), ufl.TestFunction(V)
        modulus = stiff * E
        self.area = HEIGHT ** (dim - 1)
        self.stiffness, self.force = modulus * self.area / LENGTH, stiff * FORCE
        strain = ufl.sym(ufl.grad(self.u))
        F = modulus * ufl.inner(strain, ufl.grad(v)) * ufl.dx
        self.end = fem.Constant(self.mesh, np.zeros(dim))
        bcs = [
            tools.prescribe(V, self.tags.find(LEFT)),
            tools.prescribe(V, self.tags.find(RIGHT), self.end),
        ]
        axis = np.eye(dim)[0] if axis is None else axis
        self.bolt = Pretension(self.u, self.tags, faces, axis)
        self.problem = NonlinearProblem(F, self.bolt, bcs)

    def tighten(self, t):
        self.bolt.force = self.force * t


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, degree, faces, stiff",
    [
        ("quadrilateral", 1, (CUT_A, CUT_B), 1.0),
        ("triangle", 2, (CUT_B, CUT_A), 1e9),
        ("hexahedron", 1, (CUT_A, CUT_B), 1.0),
        ("tetrahedron", 2, (CUT_A, CUT_B), 1.0),
    ],
)
def test_a_tightened_shank_keeps_its_length(cell, degree, faces, stiff):
    """The faces overlap by twice F L / (E A). Locked, a bar of the length 2 L is drawn."""
    bars = Bars(cell, degree, faces=faces, stiff=stiff)
    bolt, solver, force = bars.bolt, bars.problem.snes_solver, bars.force
    more = {"opening": bolt.opening, "tension": bolt.tension}
    history = History(bars.problem, more=more)
    steps = LoadSteps(solver, bars.tighten, 2, history=history).run()
    assert max(step.iterations for step in steps) <= 2
    opening = 2.0 * force / bars.stiffness
    np.testing.assert_allclose(history["opening"], [0.5 * opening, opening], TOLERANCE)
    np.testing.assert_allclose(history["tension"], [0.5 * force, force], TOLERANCE)
    assert abs(abs(bolt.resultant().force[0]) - force) <= TOLERANCE * force
    bolt.lock()
    assert bolt.is_locked

    def draw(t):
        bars.end.value[0] = 0.3 * opening * t

    LoadSteps(solver, draw, 2, history=history).run()
    drawn = 0.3 * opening * bars.stiffness / 2.0
    np.testing.assert_allclose(history["opening"][-1], opening, TOLERANCE)
    np.testing.assert_allclose(history["tension"][-1], force + drawn, TOLERANCE)
    # A force ends the lock
    bolt.force = force
    bars.problem.solve()
    assert not bolt.is_locked
    exact = opening + 0.3 * opening * -1.0
    np.testing.assert_allclose(bolt.opening(), exact, 1e-8)


def test_one_newton_step_solves_a_linear_problem():
    """The tangent is exact, with a force and locked."""
    for is_locked in (False, True):
        bars = Bars("triangle", 2)
        bars.tighten(1.0)
        problem, rng = bars.problem, np.random.default_rng(1)
        if is_locked:
            bars.bolt.lock()
        x, way = problem.start(), problem.create_vector()
        for vector in (x, way):
            vector.array[:] = rng.normal(size=len(x.array))
            vector.array[np.flatnonzero(problem.prescribed)] = 0.0
        b = problem.create_vector()
        problem.F(x, b)
        found = remainders_in_petsc(problem, x, way, np.array([1.0]))
        assert found[0] <= 1e-11 * b.norm()


@pytest.mark.mpi
@pytest.mark.parametrize("extrapolate", [None, True, False])
def test_a_lock_in_the_middle_of_a_path_stays(extrapolate):
    """Also where a step starts from where the last ones lead, or is halved."""
    bars = Bars("quadrilateral")

    def load(t):
        if t <= 0.5:
            bars.tighten(2.0 * t)
        elif not bars.bolt.is_locked:
            bars.bolt.lock()
        bars.end.value[0] = 0.02 * max(t - 0.5, 0.0)

    solver = bars.problem.snes_solver
    LoadSteps(solver, load, 4, extrapolate=extrapolate).run()
    assert bars.bolt.is_locked
    expected = FORCE + bars.stiffness * 0.01 / 2.0
    np.testing.assert_allclose(bars.bolt.tension(), expected, TOLERANCE)


def test_a_lock_of_a_step_that_fails_ends_with_it():
    """The halved step tightens on, as its load factor says."""
    bars, asked = Bars("quadrilateral"), []

    class Fails(SNESSolver):
        def solve(self, u=None):
            asked.append(bars.bolt.is_locked)
            if asked == [True]:
                raise ConvergenceError("for this test")
            return super().solve(u)

    def load(t):
        if t < 0.9:
            bars.tighten(t)
        elif not bars.bolt.is_locked:
            bars.bolt.lock()

    solver = Fails(bars.problem)
    assert LoadSteps(solver, load, 1, strategy="halve").run()[-1].halvings == 1
    assert asked == [True, False, True]
    np.testing.assert_allclose(bars.bolt.tension(), 0.5 * FORCE, TOLERANCE)


@pytest.mark.mpi
def test_results_before_a_solve_are_told_of():
    for name in ("tension", "resultant"):
        bars = Bars("quadrilateral")
        with pytest.warns(ContactWarning, match="nothing has been solved yet"):
            getattr(bars.bolt, name)()
    bars.problem.solve()
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        bars.bolt.tension()
        bars.bolt.resultant()


def test_a_checkpoint_keeps_the_lock(folder):
    bars = Bars("quadrilateral")
    LoadSteps(bars.problem.snes_solver, bars.tighten, 1).run()
    bars.bolt.lock()
    Checkpoint(bars.problem, folder / "bolt.chk").write(1.0)
    other = Bars("quadrilateral")
    Checkpoint(other.problem, folder / "bolt.chk").read()
    assert other.bolt.is_locked
    other.problem.solve()
    np.testing.assert_allclose(other.bolt.tension(), FORCE, TOLERANCE)


def test_what_cannot_be_is_refused():
    body = rigid.Body(rigid.Plane((LENGTH, 0.0), (-1.0, 0.0)), name="head")
    for kwargs, text in (
        ({"axis": (0.0, 1.0)}, "runs along the faces"),
        ({"axis": (0.0, 0.0)}, "axis is zero"),
        ({"axis": (1.0, 0.0, 0.0)}, "not in the space of the mesh"),
        ({"faces": (CUT_A,)}, "two faces of a cut"),
        ({"faces": (CUT_A, body)}, "faces = .* must be the tags or names of two faces"),
        ({"faces": (body, CUT_A)}, "faces = .* must be the tags or names of two faces"),
    ):
        with pytest.raises(ContactError, match=text):
            Bars("quadrilateral", **kwargs)
    bars = Bars("quadrilateral")
    with pytest.raises(ContactError, match="force = nan must be a finite number"):
        bars.bolt.force = np.nan
    alone = Pretension(bars.u, bars.tags, (CUT_A, CUT_B), (1.0, 0.0))
    with pytest.raises(ContactError, match="is in no problem"):
        alone.lock()
