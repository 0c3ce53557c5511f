"""Surfaces that follow rigid bodies: hubs, rims, heads of bolts."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import locate_entities_boundary, meshtags
from tangents import remainders_in_petsc

from meshes.blocks import Block
from meshes.discs import ring_blocks
from meshes.meshing import assemble_blocks
from raymortar import (
    AugmentedLagrangian,
    Checkpoint,
    Contact,
    ContactError,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    Tie,
    rigid,
    tools,
)

COMM = MPI.COMM_WORLD
INNER, OUTER, RIM, TYRE = 1.0, 2.0, 1, 2
G, LAME = 1.0, 1.5


class Ring:
    """An annulus between two radii, whose rim follows a hub.

    Parameters
    ----------
    hub
        Options of `rigid.Body`.
    held
        Whether its outer surface is.
    linear
        Whether strains are small, or the ring is neo-Hookean.
    """

    def __init__(
        self, hub, degree=2, n=8, held=False, linear=False, method=None, line=None
    ):
        blocks = ring_blocks(n, (INNER, OUTER), max(n // 2, 2), 1, (0.0, OUTER))
        self.mesh, _, _ = assemble_blocks(COMM, blocks, "quadrilateral", degree)
        middle = OUTER

        def radius(x):
            return np.hypot(x[0], x[1] - middle)

        share = 0.5 * (INNER + OUTER)
        sides = [
            locate_entities_boundary(self.mesh, 1, lambda x: radius(x) < share),
            locate_entities_boundary(self.mesh, 1, lambda x: radius(x) > share),
        ]
        facets = np.concatenate(sides)
        tags = np.repeat(np.array([RIM, TYRE], dtype=np.int32), [len(s) for s in sides])
        order = np.argsort(facets)
        self.tags = meshtags(self.mesh, 1, facets[order], tags[order])
        self.V = V = tools.vector_space(self.mesh, degree)
        self.u, v = fem.Function(V), ufl.TestFunction(V)
        if linear:
            e = ufl.sym(ufl.grad(self.u))
            density = G * ufl.inner(e, e) + 0.5 * LAME * ufl.tr(e) ** 2
        else:
            F = ufl.Identity(2) + ufl.grad(self.u)
            log_J = ufl.ln(ufl.det(F))
            density = (
                0.5 * G * (ufl.inner(F, F) - 2 - 2 * log_J) + 0.5 * LAME * log_J**2
            )
        self.energy = density * ufl.dx(degree=4)
        residual = ufl.derivative(self.energy, self.u, v)
        self.hub = rigid.Body(rigid.Frame((0.0, OUTER)), name="hub", **hub)
        self.tie = Tie(self.u, self.tags, [(RIM, self.hub)], method)
        several = [self.tie]
        if line is not None:
            self.contact = Contact(
                self.u, self.tags, [(TYRE, rigid.Line((0.0, 0.0), (0.0, 1.0)))], **line
            )
            several.append(self.contact)
        bcs = [tools.prescribe(V, sides[1])] if held else []
        self.problem = NonlinearProblem(residual, several, bcs)


@pytest.mark.mpi
@pytest.mark.parametrize("method", [None, Penalty(1e4)], ids=["multiplier", "penalty"])
def test_a_moment_turns_a_hub_by_the_closed_form(method):
    """E1: M / (4 pi G) (1 / a^2 - 1 / b^2)."""
    moment = 1e-3
    free = dict(free=("x", "y", "r"), moment=moment)
    ring = Ring(free, held=True, linear=True, method=method)
    history = History(ring.problem)
    (step,) = LoadSteps(
        ring.problem.snes_solver, lambda t: None, 1, history=history
    ).run()
    assert step.iterations <= 3
    exact = moment / (4.0 * np.pi * G) * (INNER**-2.0 - OUTER**-2.0)
    assert abs(history["rotation_hub"][-1] / exact - 1.0) <= 1e-3
    # Springs are far stiffer than the ring, which rounding errors show
    bound = (1e-10 if method is None else 1e-8) * moment
    assert abs(history["moment_hub"][-1] + moment) <= bound
    on = ring.tie.results.resultant_on(ring.hub)
    assert np.abs(on.force).max() <= bound


def test_a_ring_follows_its_hub_without_stress():
    """E1: led by 90 degrees and away, the ring is free elsewhere."""
    ring = Ring({}, n=4)

    def lead(t):
        ring.hub.move((0.7 * t, -0.2 * t), rotation=0.5 * np.pi * t)

    LoadSteps(ring.problem.snes_solver, lead, 6).run()
    # Of Green's strain, as the logarithm has a rounding error of 1e-16
    F = ufl.Identity(2) + ufl.grad(ring.u)
    strain = 0.5 * (F.T * F - ufl.Identity(2))
    density = G * ufl.inner(strain, strain) + 0.5 * LAME * ufl.tr(strain) ** 2
    energy = COMM.allreduce(fem.assemble_scalar(fem.form(density * ufl.dx(degree=4))))
    assert 0.0 <= energy <= 1e-20, energy
    X = ring.V.tabulate_dof_coordinates()[:, :2] - [0.0, OUTER]
    u = ring.u.x.array.reshape(-1, 2)
    exact = X @ np.array([[0.0, 1.0], [-1.0, 0.0]]) - X + [0.7, -0.2]
    assert np.abs(u - exact).max() <= 1e-10


@pytest.mark.mpi
def test_a_wheel_rolls_on_a_line(folder):
    """E2: pressed by a force, led along the line; friction turns the hub."""
    law = dict(method=AugmentedLagrangian(condition="points"), friction=Coulomb(0.5))
    load = 0.02

    def make():
        hub = dict(free=("y", "r"), force=(0.0, 0.0), stiffness={"y": 1e-6})
        return Ring(hub, n=8, line=law)

    wheel = make()
    hub, problem, history = wheel.hub, wheel.problem, None
    history = History(problem)

    def press(t):
        hub.force = (0.0, -load * t)

    LoadSteps(problem.snes_solver, press, 2, history=history).run()
    checkpoint = Checkpoint(problem, folder / "wheel.chk", history=history)
    checkpoint.write(1.0)

    def drive(t):
        hub.move((0.3 * t, 0.0))

    LoadSteps(problem.snes_solver, drive, 3, history=history).run()
    springs = 1e-6 * history["translation_hub_y"]
    loads = np.array([0.5, 1.0, 1.0, 1.0, 1.0]) * load
    balance = history["push_hub_y"] - loads - springs
    assert np.abs(balance).max() <= 1e-10 * load
    line = wheel.contact.resultant().force
    assert (
        np.abs(line - [history["push_hub_x"][-1], load + springs[-1]]).max()
        <= 1e-9 * load
    )
    assert abs(history["moment_hub"][-1]) <= 1e-10 * load
    turned = -history["rotation_hub"][-1]
    assert abs(turned / (0.3 / OUTER) - 1.0) <= 0.05
    # Resumed, the path is the same
    other = make()
    again = History(other.problem)
    Checkpoint(other.problem, folder / "wheel.chk", history=again).read()
    other.hub.force = (0.0, -load)
    path = LoadSteps(
        other.problem.snes_solver,
        lambda t: other.hub.move((0.3 * t, 0.0)),
        3,
        history=again,
    )
    path.run()
    assert abs(again["rotation_hub"][-1] - history["rotation_hub"][-1]) <= 1e-9


BOX = {"bottom": 1, "top": 2}
ALL = ("x", "y", "z", "rx", "ry", "rz")


def block(cell, degree, method=None, **hub):
    """A block whose bottom is held, and whose top follows a free body."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    n = (2,) * dim
    mesh, _, tags = assemble_blocks(
        COMM, [Block(n, (0.0,) * dim, (1.0,) * dim, tags=BOX, body="b")], cell
    )
    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    F = ufl.Identity(dim) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    density = 0.5 * G * (ufl.inner(F, F) - dim - 2 * log_J) + 0.5 * LAME * log_J**2
    residual = ufl.derivative(density * ufl.dx(degree=4), u, v)
    names = ALL if dim == 3 else ("x", "y", "r")
    body = rigid.Body(rigid.Frame((0.3,) * (dim - 1) + (1.2,)), free=names, **hub)
    tie = Tie(u, tags, [(2, body)], method)
    problem = NonlinearProblem(residual, tie, [tools.prescribe(V, tags.find(1))])
    return problem, body, tie


@pytest.mark.parametrize(
    "cell, degree, method",
    [
        ("triangle", 2, None),
        ("quadrilateral", 1, Penalty(20.0)),
        ("tetrahedron", 1, None),
        ("hexahedron", 2, None),
        ("tetrahedron", 2, Penalty(20.0)),
    ],
)
def test_the_tangent_is_that_of_the_residual(cell, degree, method):
    problem, body, _ = block(cell, degree, method)
    rng = np.random.default_rng(5)
    x, way = problem.start(), problem.create_vector()
    for vector, size in ((x, 2e-2), (way, 1.0)):
        vector.array[:] = size * rng.normal(size=len(x.array))
        vector.array[np.flatnonzero(problem.prescribed)] = 0.0
    steps = 10.0 ** -np.array([3.0, 3.5, 4.0])
    remainders = remainders_in_petsc(problem, x, way, steps)
    slopes = np.diff(np.log10(remainders)) / np.diff(np.log10(steps))
    assert np.abs(slopes - 2.0).max() <= 0.05


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_forces_and_moments_balance_in_space(degree):
    loads = dict(force=(0.02, -0.01, 0.03), moment=(0.004, -0.006, 0.01))
    problem, body, tie = block("hexahedron", degree, **loads)
    problem.solve()
    on = tie.results.resultant_on(body)
    assert np.abs(on.force + loads["force"]).max() <= 1e-10
    assert np.abs(on.moment + loads["moment"]).max() <= 1e-10
    held = problem.reactions({"bottom": problem.bcs})["bottom"]
    assert np.abs(held + loads["force"]).max() <= 1e-10


def test_what_cannot_be_is_refused():
    hub = rigid.Body(rigid.Frame((0.0, OUTER)), name="hub")
    other = rigid.Body(rigid.Frame((0.0, 0.0)), name="other")
    ring = Ring({}, n=4)
    with pytest.raises(
        ContactError, match="the rigid hub is a Frame, which has no surface"
    ):
        Contact(ring.u, ring.tags, [(RIM, hub)])
    with pytest.raises(ContactError, match="a surface follows one body"):
        Tie(ring.u, ring.tags, [(RIM, hub), (RIM, other)])
    with pytest.raises(ContactError, match="there is no gap to close"):
        Tie(ring.u, ring.tags, [(RIM, hub)], adjust="close")
    with pytest.raises(ContactError, match="point = "):
        rigid.Frame((0.0, np.nan))
