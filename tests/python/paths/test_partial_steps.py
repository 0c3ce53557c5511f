"""Steps that turn cells inside out are solved from where parts of them lead."""

import numpy as np
import pytest
from dolfinx import fem
from pathing import Path, take
from problems import COMM, SOLVERS, build, fix, worst

import raymortar
from meshes.scenes import two_blocks
from raymortar import ConvergenceError
from raymortar.paths import ways
from raymortar.paths.load_path import PrescribedPath
from raymortar.paths.strategy import FULL, PARTIAL, SMALL_GAMMA

PUSH = 0.1

# With statuses ahead these steps need no parts
pytestmark = pytest.mark.usefixtures("not_ahead")


def punch(steps, friction=None, solver=SOLVERS[0], called=None, facets=5):
    """Path of a narrow block that is pressed into a wide one, both hardly compressible.
    The punch has so many `facets`. `called` takes the load factors, the steps' sizes and the largest displacements with
    which loads are set."""
    scene = two_blocks(COMM, 2, "quadrilateral", 7, facets, upper_size=(0.6, 1.0))
    top = fem.Constant(scene.mesh, np.zeros(2))

    def held(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    options = {"nu": 0.4999, "bcs": held, "friction": friction}
    problem = build(scene, 2, "neo-hookean", **options).problem

    def push(t, size):
        top.value[1] = -PUSH * t
        if called is not None:
            called.append((t, size, worst(problem.contact.u.x.array)))

    force = problem.contact.resultant
    return Path(problem, push, steps, lambda: force().force[1], solver=solver), top


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_step_too_large_for_one_solve_arrives_where_small_steps_do(solver):
    """It takes 19 tangents by halving."""
    path, _ = punch(1, solver=solver)
    found = take(path)
    assert found.arrived and found.ways == {PARTIAL: 1}
    assert found.tangents <= 16 and found.iterations <= 10
    small, _ = punch(8)
    assert take(small).ways == {FULL: 8}
    assert path.result() == pytest.approx(small.result(), rel=1e-8)


@pytest.mark.mpi
def test_friction_counts_from_the_begin_of_the_step():
    """Parts are starts, and no steps: stick and slip are those of the whole step."""
    friction = raymortar.Coulomb(0.5)
    path, _ = punch(2, friction)
    assert take(path).ways == {PARTIAL: 1, FULL: 1}
    other, _ = punch(2, friction)
    found = take(other, strategy="halve")
    # Halving accepts parts of the step, on which friction depends
    assert found.halvings and path.result() == pytest.approx(other.result(), rel=1e-5)
    assert path.result() != pytest.approx(other.result(), rel=1e-9)


@pytest.mark.mpi
def test_loads_of_parts_are_set_where_the_step_begins():
    calls = []
    path, top = punch(1, called=calls)
    take(path)
    factors, sizes, moved = np.array(calls).T
    # The last three are of the energy balance: its begin, the end, and as they were
    assert factors[:3].tolist() == sizes[:3].tolist() == [1.0, 0.5, 1.0]
    assert not moved[:3].any()
    assert top.value[1] == -PUSH


def test_loads_are_whole_again_where_parts_fail(monkeypatch):
    shares = []

    def fail(solver):
        shares.append(-top.value[1] / PUSH)
        raise ConvergenceError("a part")

    monkeypatch.setattr(ways, "solve_roughly", fail)
    path, top = punch(1)
    found = take(path)
    assert shares == [0.5, 0.25]
    assert found.arrived and PARTIAL not in found.ways
    assert top.value[1] == -PUSH


def test_a_state_that_has_lost_contact_gives_way_to_the_next_way(monkeypatch):
    """A part may end below what it should touch."""

    def passed(self, first=False):
        self._path.solver.problem.contact.u.x.array[:] = 0.0
        lost.append(True)
        return 1

    lost = []
    monkeypatch.setattr(ways.PartialSteps, "solve", passed)
    monkeypatch.setattr(
        raymortar.LoadSteps,
        "_loss",
        lambda self: "gone" if lost and lost.pop() else None,
    )
    path, _ = punch(1)
    found = take(path)
    assert found.arrived and found.ways == {SMALL_GAMMA: 1}


@pytest.mark.mpi
@pytest.mark.parametrize("facets, tries", [(5, [0.5]), (3, [])])
def test_contact_of_few_facets_is_not_solved_in_parts(facets, tries, monkeypatch):
    """Their corners break solves in small steps as well."""
    shares, begin = [], PrescribedPath.begin_part

    def begin_part(path, share):
        shares.append(share)
        begin(path, share)

    monkeypatch.setattr(PrescribedPath, "begin_part", begin_part)
    path, _ = punch(1, facets=facets)
    assert take(path).arrived
    assert [share for share in shares if share < 1.0] == tries


@pytest.mark.mpi
def test_a_state_of_the_users_own_goes_back_before_each_part():
    """Its trial values are of a solve that broke."""
    rejected = []
    path, _ = punch(1)
    found = take(path, on_reject=lambda: rejected.append(True))
    assert found.ways == {PARTIAL: 1} and len(rejected) >= 3
