"""Moments of both bodies with friction (3): points have gaps where a multiplier closes
them in the mean. Tractions act over these gaps too where moments have to balance, as in
steps of `Midpoint`; elsewhere the bodies lack the moment of these gaps."""

from __future__ import annotations

import numpy as np
import pytest
import states
import ufl
from balances import moments, nodal_forces, nodal_positions
from dolfinx import fem
from materials import lame
from problems import COMM, build, fix
from states import CELLS, Case

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    History,
    NonlinearProblem,
    tools,
)
from raymortar.dynamics import Inertia, Midpoint, TimeSteps

FRICTION = {"friction": Coulomb(0.3)}
SLAVE, MASTER = 1, 2


def turning(contact):
    """Moments of contact on all bodies about the origin, and their size."""
    turn = moments(nodal_positions(contact), nodal_forces(contact))
    return turn.sum(axis=0), np.abs(turn).sum()


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("condition", ["points", "nodes"])
@pytest.mark.parametrize("frame", ["slave", "master"])
def test_random_states_are_in_balance(cell, degree, condition, frame):
    case = Case(cell, degree, degree, method="vector")
    scene = case.scene("overhang")
    contact = states.make_contact(
        scene, case, condition=condition, frame=frame, **FRICTION
    )
    contact.assembly.present.couples_over_gaps = True
    states.set_state(contact, scene, "mixed", 3, noise=0.01)
    total, size = turning(contact)
    assert np.abs(total).max() <= 1e-13 * size


@pytest.mark.mpi(where=lambda cell, **_: cell == "quadrilateral")
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
@pytest.mark.parametrize("law", ["points", "nodes"])
@pytest.mark.parametrize("over_gaps", [True, False])
def test_pressed_and_sheared_blocks_are_in_balance(
    cell, law, over_gaps, record_property
):
    """But for the moment of gaps, where that is left out."""
    method = AugmentedLagrangian(condition=law)
    dim = 2 if cell == "quadrilateral" else 3
    scene = two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=4 if dim == 2 else 2,
        upper_divisions=3,
        lower_size=(2.0,) * (dim - 1) + (0.7,),
        upper_size=(1.0,) * (dim - 1) + (0.4,),
        overhang=(0.45,) * (dim - 1),
        interface=states.curved,
    )
    top = fem.Constant(scene.mesh, np.zeros(dim))
    problem = build(
        scene,
        1,
        "neo-hookean",
        method,
        E=10.0,
        nu=0.3,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=top)],
        **FRICTION,
    )
    contact = problem.contact
    contact.assembly.present.couples_over_gaps = over_gaps
    lacks = []
    for down, along in [(0.03, 0.0), (0.03, 0.02), (0.03, 0.04)]:
        top.value[-1], top.value[0] = -down, along
        problem.solve()
        total, size = turning(contact)
        lacks.append(np.abs(total).max() / size)
        contact.advance()
    record_property("lacks", lacks)
    assert max(lacks) <= (1e-11 if over_gaps else 1e-3)
    assert over_gaps or max(lacks) > 1e-9


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize(
    "degree, geometry, smooth",
    [(1, 1, False), (1, 2, False), (2, 2, False), (1, 1, True), (2, 1, True)],
)
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
def test_the_resultant_is_that_of_the_slaves_rows(
    cell, degree, geometry, smooth, friction
):
    """Also of arcs, and of facets of a higher degree than the displacement (2.18)."""
    case = Case(cell, degree, geometry, method="penalty")
    scene = case.scene("overhang")
    options = {} if friction is None else {"friction": friction}
    contact = states.make_contact(scene, case, smooth=smooth, **options)
    states.set_state(contact, scene, "mixed", 3, noise=0.01)
    x, forces = nodal_positions(contact), -nodal_forces(contact)
    V = contact.u.function_space
    upper = np.zeros(len(states.dof_positions(V)), dtype=bool)
    upper[states.upper_dofs(scene, V)] = True
    mine = upper_of_all(V, upper)
    turn = moments(x[mine], forces[mine])
    moment = np.ravel(contact.results.resultant().moment)
    size = np.abs(turn).sum()
    assert size > 0.0
    assert np.abs(turn.sum(axis=0) - moment).max() <= 1e-10 * size
    assert np.abs(
        forces[mine].sum(axis=0) - contact.results.resultant().force
    ).max() <= (1e-10 * np.abs(forces).sum())


def upper_of_all(V, marks):
    """Marks of the owned dofs of all ranks."""
    owned = marks[: V.dofmap.index_map.size_local]
    return np.concatenate(COMM.allgather(owned))


def rounded(x):
    return x + np.outer(0.6 * (1.02 - x[:, 1]) * (x[:, 0] - 0.75) ** 2, [0.0, 1.0])


def bouncing(law):
    """Two free blocks that meet obliquely, the upper one with a round bottom."""
    blocks = [
        Block((6, 3), (0.0, 0.0), (1.5, 0.5), tags={"top": MASTER}),
        Block(
            (4, 3), (0.35, 0.52), (1.25, 1.02), mapping=rounded, tags={"bottom": SLAVE}
        ),
    ]
    mesh, _, facets = assemble_blocks(COMM, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    mu, la = lame(10.0, 0.3)
    F = ufl.Identity(2) + ufl.grad(u)
    J = ufl.det(F)
    energy = mu / 2 * (ufl.inner(F, F) - 2 - 2 * ufl.ln(J)) + la / 2 * ufl.ln(J) ** 2
    dx = ufl.dx(metadata={"quadrature_degree": 2})
    contact = Contact(
        u, facets, [(SLAVE, MASTER)], AugmentedLagrangian(condition=law), **FRICTION
    )
    problem = NonlinearProblem(ufl.derivative(energy * dx, u, v), contact)
    velocity = fem.Function(V)
    above = V.tabulate_dof_coordinates()[:, 1] > 0.51
    velocity.x.array.reshape(-1, 2)[above] = 0.2, -0.3
    inertia = Inertia(ufl.inner(ufl.TrialFunction(V), v) * dx, contact)
    return problem, inertia, velocity, energy * dx


@pytest.mark.mpi(where=lambda law: law == "points")
@pytest.mark.parametrize("law", ["points", "nodes"])
def test_an_impact_keeps_the_moment_of_momentum(law):
    problem, inertia, velocity, energy = bouncing(law)
    history = History(problem)
    steps = TimeSteps(
        problem.snes_solver,
        inertia,
        history=history,
        end=0.6,
        dt=0.02,
        scheme=Midpoint(),
        velocity=velocity,
        energy=energy,
    )
    steps.run()
    assert history["active"].max() > 0
    assert history["friction_work"][-1] > 1e-4
    moment = history["moment_of_momentum"]
    assert np.abs(moment - moment[0]).max() <= 1e-9 * np.abs(moment).max()
