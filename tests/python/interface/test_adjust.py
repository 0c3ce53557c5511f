"""Meshes with noise on surfaces that should touch: `Contact.adjust` (K2)."""

from __future__ import annotations

import gathered
import numpy as np
import pytest
from problems import DIMENSION, SOLVERS, build, fix, stack

from raymortar import ContactError, Penalty
from raymortar.core import compat

CELLS = ("triangle", "quadrilateral", "tetrahedron", "hexahedron")
H = {2: 1.0 / 6.0, 3: 1.0 / 3.0}  # facets of the slave


def noisy(cell, noise):
    """Blocks on each other; nodes near the interface off by up to `noise` facets."""
    dim = DIMENSION[cell]
    n = round(1.0 / H[dim])
    scene = stack(cell, (n - 1, n), widths=[1.0, 1.0])
    X = scene.mesh.geometry.x
    at = np.abs(X[:, dim - 1] - 1.0) < 1e-9
    # The same on all ranks: of the place
    phase = np.sin(1e3 * X[:, 0] + 2e3 * X[:, 1] + 3e3 * X[:, 2] * (dim == 3))
    body = np.where(in_upper(scene), 1.0, -0.7)
    X[at, dim - 1] += noise * H[dim] * (phase * body)[at]
    return scene


def in_upper(scene):
    """Whether nodes are of the upper body."""
    mesh = scene.mesh
    nodes = np.zeros(len(mesh.geometry.x), dtype=bool)
    cells = scene.cell_tags.find(scene.bodies["1"])
    nodes[np.unique(compat.geometry_dofmap(mesh)[cells])] = True
    return nodes


def pressed_problem(scene, degree=1, **options):
    last = scene.mesh.geometry.dim - 1

    def conditions(V, scene):
        sides = [fix(V, scene, "top", i) for i in range(last + 1)]
        return [fix(V, scene, "bottom"), *sides]

    return build(scene, degree, bcs=conditions, E=1000.0, **options)


def press(found, by):
    """Force of the contact once the top has moved down."""
    last = found.scene.mesh.geometry.dim - 1
    V = found.u.function_space
    found.problem.bcs[-1] = fix(V, found.scene, "top", last, -by)
    _, converged = SOLVERS[-1](found.problem).solve()
    assert converged
    return found.contact.resultant(0).force[last]


@pytest.mark.mpi
@pytest.mark.parametrize("degree", (1, 2))
@pytest.mark.parametrize("cell", CELLS)
def test_the_start_is_free_of_stress_and_the_end_is_that_of_exact_meshes(cell, degree):
    exact = pressed_problem(noisy(cell, 0.0), degree)
    force = press(exact, 0.04)
    found = pressed_problem(noisy(cell, 1e-3), degree)
    dim = DIMENSION[cell]
    rough = abs(press(found, 0.0))
    found = pressed_problem(noisy(cell, 1e-3), degree)
    done = found.contact.adjust(within=0.01 * H[dim])
    assert 0.0 < done.largest < 4e-3 * H[dim]
    assert done.facets > 0
    # Of the modulus
    assert abs(press(found, 0.0)) < 1e-12 * 1000.0
    assert rough > 1e-4 * abs(force)
    assert press(found, 0.04) == pytest.approx(force, rel=1e-3)


def test_it_stays_beside_an_offset_that_is_set_later():
    found = pressed_problem(noisy("triangle", 1e-3), method=Penalty(1e4))
    found.contact.adjust(within=0.01)
    found.contact.set_offset(-1e-3)
    found.contact.update()
    gap = gathered.points(found.contact)["gap"]
    assert -1e-3 - 1e-12 < gap.min() < -0.9e-3 and gap.max() < 0.0


def test_an_interference_that_is_set_before_stays():
    found = pressed_problem(noisy("triangle", 1e-3), method=Penalty(1e4), offset=-1e-3)
    found.contact.adjust(within=0.01)
    found.contact.update()
    gap = gathered.points(found.contact)["gap"]
    assert -1e-3 - 1e-12 < gap.min() < -0.9e-3 and gap.max() < 0.0


def test_it_is_for_the_start():
    found = pressed_problem(noisy("triangle", 1e-3))
    press(found, 0.01)
    with pytest.raises(ContactError, match="adjust is for the undeformed start"):
        found.contact.adjust(within=0.01)


def test_a_second_adjustment_changes_nothing():
    found = pressed_problem(noisy("quadrilateral", 1e-3))
    first = found.contact.adjust(within=0.01)
    assert found.contact.adjust(within=0.01).largest < 1e-2 * first.largest


def test_what_is_farther_apart_stays():
    found = pressed_problem(stack("triangle", (3, 4), gaps=[0.0, 0.1]))
    done = found.contact.adjust(within=0.05)
    assert (done.facets, done.largest) == (0, 0.0)


@pytest.mark.parametrize("within", (0.0, -1.0, np.nan, "far", True))
def test_within_is_a_positive_number(within):
    found = pressed_problem(stack("triangle", (2, 2)))
    with pytest.raises(ContactError, match="within = .* must be a positive number"):
        found.contact.adjust(within)
