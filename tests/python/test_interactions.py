"""Several contacts in one problem, each with its own method, law and search."""

from __future__ import annotations

from mpi4py import MPI

import gathered
import numpy as np
import problems
import pytest
from interacting import (
    FIRST,
    LAWS,
    LOWER,
    ON_FIRST,
    ON_SECOND,
    SECOND,
    UPPER,
    E,
    Stack,
    difference,
    largest,
    table,
    three,
    two_pairs,
)
from problems import COMM, SOLVERS, fix, stack, tolerate
from tangents import remainders_in_petsc

import raymortar
from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    Friction,
    NonlinearProblem,
    Penalty,
    Search,
    SNESSolver,
    Tresca,
)
from raymortar.core import compat

pytestmark = pytest.mark.mpi
STICK, SLIP = 2, 3


# Interactions that know nothing of each other

# With a law of the slip rate, whose time is that of the load steps, and an interference
RATES = (
    {
        "friction": Friction(
            lambda p, v: 0.2 * p + 0.01 * v,
            lambda p, v: (0.2 + 0.0 * p, 0.01 + 0.0 * v),
        )
    },
    {"method": Penalty(400.0), "friction": Coulomb(0.2), "offset": -0.005},
)
CASES = {"AL-penalty": LAWS, "penalty-AL": LAWS[::-1], "rate-offset": RATES}


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: s.__name__)
@pytest.mark.parametrize("laws", CASES.values(), ids=list(CASES))
def test_two_stacks_are_as_two_problems(laws, solver):
    """Each contact does what it does in a problem of its own."""
    both = two_pairs()
    contacts = [both.contact(p, **law) for p, law in zip((FIRST, SECOND), laws)]
    path = both.path(contacts, solver=solver)
    tolerate(path.solver, rtol=1e-13)
    path.run()
    for k, (pair, law) in enumerate(zip((FIRST, SECOND), laws)):
        alone = two_pairs()
        contact = alone.contact(pair, **law)
        lone = alone.path(contact, solver=solver)
        tolerate(lone.solver, rtol=1e-13)
        lone.run()
        assert contact.gamma == pytest.approx(contacts[k].gamma, rel=1e-12)
        height = alone.V.tabulate_dof_coordinates()[:, alone.dim - 1]
        dofs = np.repeat((height < 5.0) == (k == 0), alone.dim)
        assert difference(both.u, alone.u, dofs) <= 1e-12
        if contact.multiplier is not None:
            assert difference(contacts[k].multiplier, contact.multiplier) <= 1e-11
        for name in ("force", "normal", "tangential"):
            here = path.history.vectors(f"{name}_{k}")
            there = lone.history.vectors(f"{name}_0")
            assert np.abs(here - there).max() <= 1e-11 * np.abs(there).max()
        assert np.all(here[-1] != 0.0)


@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_one_contact_in_two_is_the_same(cell):
    """Pairs of one contact, and one contact for each pair."""
    options = {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.2)}
    whole, parts = three(cell), three(cell)
    one = whole.path(whole.contact(LOWER, UPPER, **options))
    contacts = [parts.contact(pair, **options) for pair in (LOWER, UPPER)]
    two = parts.path(contacts)
    one.run()
    two.run()
    assert difference(parts.u, whole.u) <= 1e-9
    assert two.history.columns == one.history.columns
    assert two.history["iterations"].tolist() == one.history["iterations"].tolist()
    for column in ("force_0_y", "force_1_y", "tangential_1_x", "friction_work"):
        assert two.history[column] == pytest.approx(one.history[column], rel=1e-9)
    joint, lone = (path.solver.problem.contact for path in (two, one))
    for name in ("hits", "active_points", "min_gap", "max_pressure"):
        found = getattr(joint.statistics, name)
        assert found == pytest.approx(getattr(lone.statistics, name), rel=1e-7)
    assert joint.layout.size_global == lone.layout.size_global


@pytest.mark.parametrize("degree", [1, 2])
def test_a_body_between_a_multiplier_and_a_penalty(degree):
    """Uniform pressure: three columns, and the spring of the penalty."""
    gamma, down = 50.0, 0.06
    scene = stack("quadrilateral", (3, 4, 2))
    blocks = Stack(scene, ["bottom_0"], ["top_2"], degree)
    bcs = [fix(blocks.V, scene, "bottom_0", 1), fix(blocks.V, scene, "top_2", 1, -down)]
    bcs.append(fix(blocks.V, scene, ["left_0", "left_1", "left_2"], 0))
    contacts = [blocks.contact(LOWER), blocks.contact(UPPER, method=Penalty(gamma))]
    problem = NonlinearProblem(blocks.F, contacts, bcs)
    SNESSolver(problem).solve()
    modulus = E / (1.0 - 0.3**2)
    pressure = down / (3.0 / modulus + 1.0 / gamma)
    found = [problem.contact.resultant(i).force for i in (0, 1)]
    assert np.allclose(found, [0.0, pressure], rtol=0.0, atol=1e-9 * pressure)
    assert np.array_equal(found[1], contacts[1].resultant().force)
    assert problem.reactions({"top": bcs[1]})["top"][1] == pytest.approx(-pressure)
    slave = contacts[0].multiplier.x.array[contacts[0].zones[0].multiplier_nodes]
    assert largest(slave + pressure) <= 1e-9 * pressure


# One slave tag in two interactions


def test_a_slave_tag_of_two_penalties_meets_both_masters():
    """Springs of two contacts on one surface are those of one contact."""
    options = {"method": Penalty(60.0), "friction": Coulomb(0.3)}
    whole, parts = table(), table()
    one = whole.path(whole.contact(ON_FIRST, ON_SECOND, **options))
    two = parts.path([parts.contact(p, **options) for p in (ON_FIRST, ON_SECOND)])
    one.run()
    two.run()
    assert difference(parts.u, whole.u) <= 1e-9
    sums = [two.history[f"force_{i}_y"] for i in (0, 1)]
    assert np.all(np.array(sums) > 0.0)
    assert sum(sums) == pytest.approx(one.history["force_0_y"], rel=1e-9)


def test_a_slave_tag_may_have_two_multipliers():
    """Each is zero where its own master covers nothing; forces are in balance."""
    whole, parts = table(), table()
    one = whole.path(whole.contact(ON_FIRST, ON_SECOND, friction=Coulomb(0.3)))
    contacts = [parts.contact(p, friction=Coulomb(0.3)) for p in (ON_FIRST, ON_SECOND)]
    two = parts.path(contacts)
    one.run()
    two.run()
    forces = [two.history.vectors(f"force_{i}") for i in (0, 1)]
    balance = sum(forces) - two.history.vectors("reaction_held")
    assert np.abs(balance).max() <= 1e-8 * np.abs(forces).max()
    there = one.history.vectors("force_0")
    assert np.abs(sum(forces) - there).max() <= 0.02 * np.abs(there).max()
    for contact, side in zip(contacts, (1.0, -1.0)):
        W = contact.multiplier.function_space
        x = W.tabulate_dof_coordinates()[:, 0]
        beyond = side * (x - 0.6) > 0.1
        values = contact.multiplier.x.array.reshape(-1, 2)
        assert largest(values[beyond]) == 0.0
        assert largest(values) > 0.0


# The coupled system


def test_problems_of_the_same_contacts_take_turns():
    """Matrices and rows of the first are good after the second has been made."""
    blocks = three()
    contacts = [blocks.contact(p, **law) for p, law in zip((LOWER, UPPER), LAWS)]
    for contact in contacts:
        contact.update()  # pairs that are found before rows are known
    first, second = (SNESSolver(blocks.problem(contacts)) for _ in range(2))
    blocks.move(1.0)
    start, found = first.problem.contact.state(), []
    for solver in (first, second, first):
        solver.problem.contact.restore(start)
        solver.solve()
        found.append([contact.resultant().force for contact in contacts])
    assert np.allclose(found[1:], found[0], rtol=1e-9, atol=1e-12)
    assert np.abs(found[0]).min() > 0.0


def smooth(stack, contacts, seed):
    """Unknowns of a problem, and a direction, from waves: alike on all ranks."""
    random = np.random.default_rng(seed)

    def wave(x, size, c):
        k, a = random.normal(size=(2, c, len(x)))
        found = [np.sin(k[i] @ x + a[i, 0]) for i in range(c)]
        return size * np.array(found)

    stack.u.interpolate(lambda x: wave(x, 1.0, stack.dim))
    for contact in contacts:
        if contact.multiplier is not None:
            c = contact.layout.components
            contact.multiplier.interpolate(
                lambda x: wave(x, 1.0, c)[0 if c == 1 else slice(None)]
            )


def test_tangent_of_a_multiplier_and_a_penalty_is_the_derivative():
    """Taylor remainders of volume and contacts together are of second order."""
    scene = stack("quadrilateral", (3, 4, 2), gaps=(0.0, -0.02, -0.02))
    blocks = Stack(scene, ["bottom_0"], ["top_2"], material="neo-hookean")
    laws = (
        {"friction": Coulomb(0.3)},
        {"method": Penalty(60.0), "friction": Tresca(0.1)},
    )
    contacts = [blocks.contact(p, **law) for p, law in zip((LOWER, UPPER), laws)]
    problem = NonlinearProblem(blocks.F, contacts)
    b = problem.create_vector()
    smooth(blocks, contacts, 0)
    direction = problem.start()
    state = direction.copy()
    state.scale(0.01)
    # The lowest block has slipped below the others
    X = blocks.V.tabulate_dof_coordinates()
    lowest = np.unique(contacts[0].system.bodies.dofs[X[:, 1] < 0.5])
    slipped = np.isin(contacts[0].system.bodies.dofs, lowest)
    blocks.u.x.array[:] = np.outer(0.02 * slipped, [1.0, 0.0]).ravel()
    contacts[0].multiplier.interpolate(lambda x: np.outer([0.0, 1.0], 1.0 + 0.0 * x[0]))
    state.axpy(1.0, problem.start())
    problem.F(state, b)
    for contact, kind in zip(contacts, (SLIP, STICK)):
        status = gathered.points(contact)["status"]
        assert np.all(status[status > 0] == kind) and status.any()
    steps = 10.0 ** -np.arange(3.0, 5.1, 0.5)
    remainders = remainders_in_petsc(problem, state, direction, steps)
    slopes = np.diff(np.log10(remainders)) / np.diff(np.log10(steps))
    assert np.abs(slopes - 2.0).max() <= 0.05, slopes


def test_rows_follow_each_other_rank_by_rank():
    """[host | first multiplier | second], and both ways between Functions and rows."""
    blocks = three()
    contacts = [blocks.contact(LOWER, friction=Coulomb(0.3)), blocks.contact(UPPER)]
    problem = blocks.problem(contacts)
    joint = problem.contact.layout
    first, second = (contact.layout for contact in contacts)
    assert joint.size == first.size == second.size
    assert joint.size == joint.n + first.owned_size + second.owned_size
    assert np.array_equal(joint.ranges, second.ranges)
    used = [c.layout.multiplier_rows[c.layout.owned_multipliers] for c in contacts]
    begin = joint.begin + joint.n
    assert np.array_equal(used[0], begin + 2 * np.arange(len(used[0])))
    begin += first.owned_size
    assert np.array_equal(used[1], begin + np.arange(len(used[1])))
    smooth(blocks, contacts, 1)
    functions = [blocks.u, *(contact.multiplier for contact in contacts)]
    for f in functions:
        compat.scatter_forward(f.x)
    x = problem.start()
    kept = [f.x.array.copy() for f in functions]
    for f in functions:
        f.x.array[:] = 0.0
    joint.from_vector(x, problem.contact.system.scales)
    assert difference(functions[0], kept[0]) == 0.0
    for contact, f, values in zip(contacts, functions[1:], kept[1:]):
        nodes = contact.zones[0].multiplier_nodes
        c = contact.layout.components
        found, wanted = (a.reshape(-1, c)[nodes] for a in (f.x.array, values))
        assert largest(found - wanted) <= 1e-15


def test_any_number_of_ranks_gives_the_same(monkeypatch):
    """The whole path on one rank, beside it on all."""

    def forces():
        blocks = three()
        contacts = [blocks.contact(p, **law) for p, law in zip((LOWER, UPPER), LAWS)]
        path = blocks.path(contacts)
        path.run()
        return np.array(path.history.rows)

    all_ranks = forces()
    with monkeypatch.context() as patch:
        patch.setattr(problems, "COMM", MPI.COMM_SELF)
        alone = forces()
    scale = np.abs(alone).max(axis=0) + 1e-3
    assert np.abs((all_ranks - alone) / scale).max() <= 1e-8


# What each has of its own


def test_each_contact_has_its_own_picture_and_fields(folder):
    blocks = three()
    contacts = [blocks.contact(LOWER), blocks.contact(UPPER, method=Penalty(50.0))]
    blocks.path(contacts, steps=1).run()
    for i, contact in enumerate(contacts):
        assert largest(contact.traction().x.array) > 0.0
        file = folder / f"{i}.png"
        raymortar.plot(contact, file)
        assert COMM.rank or file.stat().st_size > 1000


def test_gamma_is_the_automatic_one_of_each():
    """A search, a rule and a coefficient of one leave the others alone."""
    blocks = three()
    contacts = [
        blocks.contact(LOWER, search=Search("pang", reach=0.3), quadrature_degree=4),
        blocks.contact(UPPER, method=Penalty()),
    ]
    problem = blocks.problem(contacts)
    for pair, contact in zip((LOWER, UPPER), contacts):
        other = three()
        lone = other.contact(pair, method=contact.method)
        other.problem(lone)
        assert lone.gamma == pytest.approx(contact.gamma, rel=1e-12)
    before = contacts[1].gamma
    revision = problem.contact.system.revision
    contacts[0].set_gamma(7.0)
    assert contacts[1].gamma == before
    assert problem.contact.gamma == [7.0, before]
    assert problem.contact.system.revision > revision
