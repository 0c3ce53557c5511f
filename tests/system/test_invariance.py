"""Solved problems in other units, places, frames and numberings (F4, F5, F6).

What `test_identities` shows for one residual holds for whole solutions, Newton's
iterations included: no stage has an absolute tolerance or knows the axes.
"""

from petsc4py import PETSc

import gathered
import numpy as np
import pytest
from dolfinx import fem
from frames import Frame, Framed, Solution, quarter_turn
from problems import COMM, DIMENSION, build, fix, worst
from public_models import MODELS
from rotations import rotation
from states import CLOSED, by_place

from meshes.scenes import two_blocks
from raymortar import Coulomb, Penalty, SNESSolver

LAWS = {
    "frictionless": lambda: {},
    "coulomb": lambda: {"friction": Coulomb(0.3)},
    "penalty": lambda: {"friction": Coulomb(0.3), "method": Penalty()},
}
SOLVER = SNESSolver, {
    "snes_linesearch_type": "bt",
    "snes_max_it": 50,
    "snes_rtol": 1e-13,
}
# Pressed from rest, pulled aside until part of the surface slips, back, and further
PATH = [(0.0, -0.03), (0.02, -0.03), (0.01, -0.03), (0.03, -0.03)]


class Solved(Framed):
    """A narrow block on a wide one in a frame."""

    def __init__(self, cell, law, degree=1, **frame):
        dim = DIMENSION[cell]
        self.frame = Frame(**{"Q": np.eye(dim)} | frame)
        n = (5, 4) if dim == 2 else (3, 2)
        size = (0.6,) * dim
        scene = two_blocks(COMM, dim, cell, *n, upper_size=size)
        scene, eta, Q = self.frame.place(scene), self.frame.eta, self.frame.Q
        top = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))
        self.problem = build(
            scene,
            degree,
            "neo-hookean",
            E=2000.0 * self.frame.xi,
            bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", None, top)],
            **LAWS[law](),
        )
        contact = self.problem.contact
        contact.set_gamma(0.1 * contact.gamma)
        self.iterations = []
        for aside, down in PATH:
            move = np.zeros(dim)
            move[0], move[-1] = aside, down
            top.value[:] = eta * Q @ move
            self.problem.solve(*SOLVER)
            self.iterations.append(self.problem.solver.snes.getIterationNumber())
            contact.advance()


_first = {}


def original(cell, law, degree):
    """Solved once."""
    key = cell, law, degree
    if key not in _first:
        _first[key] = Solved(*key)
    return _first[key]


def same_path(one, other):
    """Newton's iterations; one more where the residual ends near rounding error."""
    more = np.abs(np.subtract(other.iterations, one.iterations)).max()
    assert more <= 1


def same(one, other, tolerance):
    for name in ("displacement", "traction", "force"):
        a, b = getattr(one, name), getattr(other, name)
        error = worst(b - a) / worst(a)
        print(f"{name}: {error:.1e}")
        assert error <= tolerance


def same_by_place(one, other, tolerance):
    """Where dofs are numbered differently."""
    u = one.displacement[by_place(one.places, other.places)]
    assert worst(other.displacement - u) <= tolerance * worst(u)
    assert worst(other.force - one.force) <= tolerance * worst(one.force)


def compare(cell, law, degree, tolerance, **frame):
    one, other = original(cell, law, degree), Solved(cell, law, degree, **frame)
    if "shift" not in frame:
        same_path(one, other)
    assert other.counts == one.counts
    same(one, other, tolerance)
    return one, other


SMALL = [("triangle", 1), ("quadrilateral", 2), ("tetrahedron", 1), ("hexahedron", 1)]
# What several ranks take too
ON_RANKS = [("triangle", "coulomb"), ("quadrilateral", "penalty")]
ON_RANKS += [("hexahedron", "coulomb")]
every = pytest.mark.parametrize(
    "cell, degree, law", [(*small, law) for small in SMALL for law in LAWS]
)


@pytest.mark.mpi
def test_both_regimes_are_met():
    """Or the tests below show little."""
    contact = original("triangle", "coulomb", 1).problem.contact
    assert {2, 3} <= gathered.found(contact.points()["status"])


@pytest.mark.mpi(
    where=lambda cell, law, eta, **_: (cell, law) in ON_RANKS and eta < 1e-6
)
@every
@pytest.mark.parametrize("eta, xi", [(1e-9, 1e6), (1e-3, 1e-6), (1e6, 1.0)])
def test_units_change_nothing(cell, degree, law, eta, xi):
    compare(cell, law, degree, 1e-9, eta=eta, xi=xi)


@every
@pytest.mark.parametrize("eta, xi", [(2.0**-30, 2.0**20), (2.0**20, 2.0**-20)])
def test_binary_units_change_not_even_the_rounding(cell, degree, law, eta, xi):
    """1e-9 and 1e6, about: nothing is rounded otherwise, so every branch is taken
    alike, unless something is compared with a number that has a unit."""
    one, other = compare(cell, law, degree, 1e-12, eta=eta, xi=xi)
    assert other.iterations == one.iterations


@pytest.mark.mpi(where=lambda cell, law, **_: (cell, law) in ON_RANKS)
@every
def test_frame_changes_nothing(cell, degree, law):
    compare(cell, law, degree, 1e-9, Q=rotation(DIMENSION[cell]))


@pytest.mark.mpi(where=lambda cell, law, **_: (cell, law) in ON_RANKS)
@every
def test_place_changes_nothing(cell, degree, law):
    """A thousand sizes away: three digits fewer."""
    shift = 1e3 * np.array([1.0, -0.8, 0.6])[: DIMENSION[cell]]
    compare(cell, law, degree, 1e-7, shift=shift)


@every
@pytest.mark.parametrize("seed", range(2))
def test_numbering_changes_nothing(cell, degree, law, seed):
    one, other = original(cell, law, degree), Solved(cell, law, degree, seed=seed)
    same_path(one, other)
    assert other.counts == one.counts
    same_by_place(one, other, 1e-10)


# Demos and validation


def away(dim, size):
    return size * np.array([1.0, -0.8, 0.6])[:dim]


# Takes a model, the dimension and the size of a scene to a frame
FRAMES = {
    "turned": lambda model, dim, size: Frame(
        rotation(dim) if model.turns else quarter_turn(dim)
    ),
    "ten sizes away": lambda model, dim, size: Frame(
        np.eye(dim), shift=away(dim, 10.0 * size)
    ),
    "length 1e-9": lambda model, dim, size: Frame(np.eye(dim), eta=1e-9),
    "length 1e6": lambda model, dim, size: Frame(np.eye(dim), eta=1e6),
    "force 1e-6": lambda model, dim, size: Frame(np.eye(dim), xi=1e-6),
    "force 1e6": lambda model, dim, size: Frame(np.eye(dim), xi=1e6),
    "renumbered": lambda model, dim, size: Frame(np.eye(dim), seed=1),
}


def posed(name, frame=None):
    """A public problem solved in a frame; in its own, once."""
    if frame is not None:
        return Solution(MODELS[name](), frame)
    if name not in _first:
        model = MODELS[name]()
        dim = model.scene().mesh.geometry.dim
        _first[name] = Solution(model, Frame(np.eye(dim)))
    return _first[name]


@pytest.mark.parametrize("name", MODELS)
def test_public_problems_are_in_contact(name):
    """Part of the surface at least; with friction, that slips."""
    one = posed(name)
    contact, found = one.problem.contact, set()
    for zone in range(len(contact.zones)):
        found |= gathered.found(contact.points(zone)["status"])
    assert one.closed[-1] > 0 and CLOSED in found
    assert max(one.iterations) > 2


@pytest.mark.parametrize("change", FRAMES)
@pytest.mark.parametrize("name", MODELS)
def test_public_problems_do_not_depend_on_the_frame(name, change):
    """Every step takes the same iterations to as many active points."""
    one = posed(name)
    X = one.places[:, 1:]
    dim, size = X.shape[1], worst(X)
    other = posed(name, FRAMES[change](MODELS[name](), dim, size))
    assert other.iterations == one.iterations
    assert other.closed == one.closed
    boxes = one.segments, other.segments
    assert len(boxes[0]) == len(boxes[1])
    for some, others in (boxes, boxes[::-1]):
        apart = np.abs(some[:, None] - others).max(axis=2).min(axis=1)
        assert worst(apart) <= 1e-9 * size
    if change == "renumbered":
        return same_by_place(one, other, 1e-9)
    np.testing.assert_array_equal(other.pairs, one.pairs)
    # At the plate's held corner a traction follows from the gap alone, by E / h: of
    # positions that have lost a digit it is 1.7e-9
    lost = (name, change) == ("plate", "ten sizes away")
    same(one, other, 1e-8 if lost else 1e-9)
