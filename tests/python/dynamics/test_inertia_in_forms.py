"""A user whose form has inertia beside contact is told which page to read, once."""

import warnings

import moving
import pytest
import ufl
from dolfinx import fem

import raymortar
from raymortar import ContactWarning, rigid


def problem_with(more):
    """A problem with one more term of u, an older u, the test function and a measure."""
    scene = moving.bars(n=2, lower=False)
    _, residual = moving.elastic(scene)
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(scene.u, scene.facets, [(moving.SLAVE, floor)])
    old = fem.Function(scene.V, name="u_old")
    return raymortar.NonlinearProblem(residual + more(scene.u, old, scene.v), contact)


def inertia(u, old, v):
    return 7.8 / 0.1**2 * ufl.inner(u - 2.0 * old, v) * ufl.dx


def by_rate(u, old, v):
    dt = fem.Constant(u.function_space.mesh, 0.1)
    return sum((u[i] - old[i]) / dt * v[i] for i in range(2)) * ufl.dx


@pytest.mark.mpi
@pytest.mark.parametrize("more", [inertia, by_rate])
def test_inertia_is_told_once(more):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", ContactWarning)
        problem_with(more)
    (told,) = [w for w in found if w.category is ContactWarning]
    text = str(told.message)
    assert "u_old" in text and "docs/messages/fields.md" in text
    assert told.filename == __file__


@pytest.mark.parametrize(
    "more",
    [
        lambda u, old, v: 3.0 * ufl.inner(u, v) * ufl.dx,  # springs
        lambda u, old, v: ufl.inner(old, v) * ufl.dx,  # a load
        lambda u, old, v: 3.0 * ufl.inner(u - old, v) * ufl.ds,  # dashpots
        lambda u, old, v: ufl.inner(ufl.grad(u - old), ufl.grad(v))
        * ufl.dx,  # viscosity
    ],
    ids=["springs", "load", "dashpots", "viscosity"],
)
def test_nothing_else_is_taken_for_inertia(more):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        problem_with(more)
