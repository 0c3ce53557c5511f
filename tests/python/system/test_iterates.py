"""Iterates that contacts take over: when they pair anew, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from problems import COMM, build, stack, worst

from raymortar import AugmentedLagrangian, ContactError, Penalty
from raymortar.core.errors import NotFinite

pytestmark = pytest.mark.mpi


def overlapping(method=None):
    """Two blocks that overlap a little, and their system."""
    case = build(stack("triangle", (2, 3), gaps=[0.0, -0.01]), method=method)
    return case, case.contact.system


def vector_of(system):
    """The present unknowns as a PETSc vector."""
    x = system.layout.create_vector()
    system.to_vector(x)
    return x


@pytest.mark.parametrize("method", [AugmentedLagrangian(50.0), Penalty(50.0)])
def test_unknowns_come_back_from_a_vector(method):
    """Multipliers are divided by gamma on the way, and multiplied on the way back."""
    case, system = overlapping(method)
    rng = np.random.default_rng(3 + COMM.rank)
    functions = [f for f in (case.u, case.contact.multiplier) if f is not None]
    for f in functions:
        f.x.array[:] = rng.normal(size=len(f.x.array))
        f.x.scatter_forward()
    if method == AugmentedLagrangian(50.0):  # which lives at slave nodes alone
        nodes = case.contact.zones[0].multiplier_nodes
        functions[1].x.array[
            np.setdiff1d(np.arange(len(functions[1].x.array)), nodes)
        ] = 0
    known = [f.x.array.copy() for f in functions]
    x = vector_of(system)
    for f in functions:
        f.x.array[:] = 0.0
    case.contact.from_vector(x)
    for f, values in zip(functions, known):
        assert worst(f.x.array - values) <= 1e-14 * worst(values)


def test_an_iterate_is_paired_once():
    """The same vector again does nothing; another one, or a change of gamma, pairs."""
    case, system = overlapping(AugmentedLagrangian(50.0))
    x = vector_of(system)
    seen = system.take(x, None)
    count = system.updates
    assert system.take(x, seen) == seen and system.updates == count
    x.shift(1e-4)
    seen = system.take(x, seen)
    assert system.updates == count + 1
    case.contact.set_gamma(60.0)
    assert system.revision != seen
    system.take(x, seen)
    assert system.updates == count + 2


@pytest.mark.parametrize("name", ["displacement", "multiplier"])
def test_values_that_are_not_finite_are_named(name):
    """On all ranks alike, though one alone has them."""
    case, system = overlapping(AugmentedLagrangian(50.0))
    f = case.u if name == "displacement" else case.contact.multiplier
    owned = f.function_space.dofmap.index_map.size_local
    has = COMM.allgather(owned > 0)
    if COMM.rank == has.index(True):
        f.x.array[0] = np.nan
    with pytest.raises(NotFinite, match=f"the {name} has .* not finite"):
        system.update()


def test_points_are_kept_after_the_first_pairing_only():
    case, system = overlapping(Penalty(50.0))
    with pytest.raises(ContactError, match="has no points to keep"):
        system.update(pair=False)
    system.update()
    before = case.contact.points()["xi"].copy()
    case.u.x.array[:] += 1e-3
    system.update(pair=False)
    assert np.array_equal(case.contact.points()["xi"], before)
