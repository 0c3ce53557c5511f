"""Bodies that contact alone holds find their seat."""

import numpy as np
import pytest
from load_paths import resting, top_moves, under_a_press
from problems import CELLS_2D, SOLVERS, worst

from raymortar import ContactError, ConvergenceError, Coulomb, History, LoadSteps
from raymortar.viscous.stabilization import Stabilization

GAPS = [0.0, 1e-6, 0.1, 5.0]


@pytest.fixture(params=["landed", "unlanded"])
def fall(request):
    """Bodies land first, or fall under viscous forces alone."""
    if request.param == "unlanded":
        request.getfixturevalue("unlanded")


def lands(problem, weight, tolerance=1e-9):
    """Contact carries the weight, and the block has landed."""
    force = problem.contact.resultant(0).force
    assert abs(force[-1] - weight) <= tolerance * weight
    assert worst(force[:-1]) <= 1e-6 * weight
    assert problem.contact.statistics.min_gap <= 1e-2


@pytest.mark.mpi(
    where=lambda cell, gap, friction: cell in ("triangle", "hexahedron")
    and gap == 0.1
    and friction
)
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
@pytest.mark.parametrize("gap", GAPS)
def test_a_block_lands_from_any_height(cell, gap, friction):
    problem, steps, weight = resting(cell, gap, friction, stabilize=True)
    path = steps.run()
    assert [step.factor for step in path] == [0.5, 1.0] and steps.halvings == 0
    lands(problem, weight)


@pytest.mark.mpi(where=lambda solver, **_: solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("degree", [1, 2])
def test_either_solver_and_degree(solver, degree):
    problem, steps, weight = resting(
        "triangle", 0.1, Coulomb(0.3), solver, degree, stabilize=True
    )
    steps.run()
    lands(problem, weight)


@pytest.mark.mpi
@pytest.mark.usefixtures("fall")
def test_viscous_forces_take_the_energy_of_the_fall():
    """What the weight has done on the way, less what the blocks store: small here."""
    gap = 5.0
    problem, steps, weight = resting("quadrilateral", gap, stabilize=True)
    history = History(problem)
    steps = LoadSteps(steps.solver, steps.apply, 2, stabilize=True, history=history)
    steps.run()
    # The fall is in the first step, under half of the weight
    assert history["viscous_work"][0] == pytest.approx(0.5 * weight * gap, rel=1e-2)
    # The second one has next to no way to go
    assert np.diff(history["viscous_work"])[0] < 1e-3 * weight * gap
    assert (history["viscous_share"] <= 1e-6).all()


@pytest.mark.mpi
@pytest.mark.usefixtures("fall")
def test_the_end_does_not_depend_on_their_size():
    found = []
    for size in (0.1, 1.0, 10.0):
        problem, steps, weight = resting(
            "quadrilateral", 0.1, Coulomb(0.3), stabilize=size
        )
        steps.run()
        lands(problem, weight)
        found.append(problem.contact.u.x.array.copy())
    for u in found[1:]:
        assert worst(u - found[0]) <= 1e-3 * worst(found[0])


@pytest.mark.mpi
@pytest.mark.usefixtures("fall")
def test_the_unit_of_forces_does_not_matter():
    found = []
    # Where a block lands flat all points touch at once, and rounding decides which of
    # them are closed first: no count of iterations would follow from the physics
    for force in (1.0, 2.0**30, 1e9):
        problem, steps, weight = resting(
            "triangle", 0.1, Coulomb(0.3), force=force, lean=0.1, stabilize=True
        )
        counts = [step.iterations for step in steps]
        lands(problem, weight)
        found.append((counts, problem.contact.u.x.array.copy()))
    for counts, u in found[1:]:
        assert counts == found[0][0]
        assert worst(found[0][1] - u) <= 1e-8


@pytest.mark.mpi(where=lambda cell_2d: cell_2d == CELLS_2D[0])
def test_held_bodies_end_as_without_them(cell_2d):
    plain, steps = top_moves(cell_2d)
    steps.run()
    viscous, steps = top_moves(cell_2d, stabilize=True)
    steps.run()
    u = plain.u.x.array
    assert worst(viscous.u.x.array - u) <= 1e-8 * worst(u)


@pytest.mark.mpi(where=lambda size, E, **_: size == 1.0)
@pytest.mark.parametrize("size, E", [(1.0, 10.0), (1e-3, 2e11)])
@pytest.mark.parametrize("gap, steps", [(0.3, 1), (1.0, 4), (1.0, 1), (3.0, 2)])
def test_a_held_press_comes_through_air(gap, steps, size, E):
    """Loose bodies do not move until it meets them: no limit is theirs."""
    contact, path = under_a_press(gap, size=size, E=E, steps=steps)
    assert len(path.run()) == steps and path.halvings == 0
    forces = np.array([contact.resultant(zone).force for zone in (0, 1)]) / (E * size)
    assert worst(forces.sum(axis=0)) < 1e-6
    assert forces[0, 1] == pytest.approx(0.0245, rel=0.03)


@pytest.mark.mpi
def test_a_held_press_does_not_pass_what_is_loose():
    _, path = under_a_press(0.3, push=2.0, steps=1, max_halvings=0)
    with pytest.raises(ConvergenceError, match="a held body moves by 2.3 in this step"):
        path.run()


@pytest.mark.mpi
def test_a_body_over_nothing_falls_for_ever_and_says_so(monkeypatch):
    monkeypatch.setattr("raymortar.viscous.stabilization.MOST", 8)
    problem, steps, _ = resting("triangle", 50.0, stabilize=True, max_halvings=0)
    before = problem.contact.u.x.array.copy()
    with pytest.raises(ConvergenceError, match="a body that nothing holds"):
        steps.run()
    assert np.array_equal(problem.contact.u.x.array, before)


@pytest.mark.mpi
def test_apply_may_take_the_size_of_the_step():
    problem, steps = top_moves("triangle", steps=4)
    calls, apply = [], steps.apply

    def sized(t, dt):
        calls.append((t, dt))
        apply(t)

    def with_a_default(t, factor=3.0):
        assert factor == 3.0
        apply(t)

    LoadSteps(steps.solver, sized, 4, path=(0.2, 1.0)).run()
    np.testing.assert_allclose([dt for _, dt in calls], 0.2, rtol=1e-12)
    LoadSteps(steps.solver, with_a_default, 1, path=(1.0, 0.9)).run()


@pytest.mark.mpi
@pytest.mark.parametrize("stabilize", ["yes", -1.0, np.nan, [1.0]])
def test_nonsense_is_refused(stabilize):
    with pytest.raises(ContactError, match="stabilize must be True, False, None"):
        top_moves("triangle", stabilize=stabilize)


@pytest.mark.mpi
def test_a_history_with_records_takes_no_more_columns():
    problem, steps = top_moves("triangle", steps=1)
    history = History(problem.problem)
    LoadSteps(steps.solver, steps.apply, 1, history=history).run()
    with pytest.raises(ContactError, match="takes no more columns"):
        LoadSteps(steps.solver, steps.apply, 1, history=history, stabilize=True)


@pytest.mark.mpi
@pytest.mark.parametrize("aside, bears", [(0.4, False), (-0.4, False), (0.2, True)])
def test_an_error_says_that_friction_does_not_bear_a_load(aside, bears):
    """And nothing of the iterate at which the last solve ended."""
    _, steps, _ = resting("quadrilateral", 0.0, Coulomb(0.3), aside=aside)
    if bears:
        assert steps.run()
        return
    with pytest.raises(ConvergenceError) as caught:
        steps.run()
    text = str(caught.value)
    assert "(0.5, 1.5) goes on to move along x under viscous forces" in text
    assert (
        "nothing stops it, as contact, with friction, does not bear its load;" in text
    )
    for other in ("stabilize=True", "within reach", "control=", "("):
        assert other not in text.split("does not bear its load")[1]


@pytest.mark.mpi
@pytest.mark.parametrize(
    "friction, aside, gap, told",
    [
        (Coulomb(0.3), 0.4, 0.0, "contact, with friction, does not bear the load of"),
        (Coulomb(0.3), 0.2, 0.0, None),
        (None, 0.1, 0.0, "contact does not bear the load of"),
        (None, 0.0, 0.0, None),
        (Coulomb(0.3), 0.4, 0.1, None),  # it touches nothing yet
    ],
)
def test_loads_that_contact_does_not_bear_are_known_before_a_solve(
    friction, aside, gap, told
):
    problem, steps, _ = resting("quadrilateral", gap, friction, aside=aside)
    steps.apply(0.5)
    found = Stabilization(problem.snes_solver, 1.0).unborne()
    assert found == ([f"{told} the body around (0.5, 1.5)"] if told else [])
