"""Controls and bodies that nothing holds: what is named."""

import sys
from pathlib import Path

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, SOLVERS, build, fix
from snapping import on_bed

from meshes.scenes import two_blocks
from raymortar import ConvergenceError, LoadSteps
from raymortar.diagnose.lost_contact import loose_bodies
from raymortar.paths import ArcLength, DisplacementControl
from raymortar.paths.controls import mean_weights

sys.path.append(str(Path(__file__).parents[3] / "demos"))


@pytest.mark.mpi
def test_what_the_loads_do_not_move_cannot_lead():
    problem = on_bed("triangle", gap=0.3)
    bottom = lambda x: np.isclose(x[1], 0.0)  # noqa: E731
    control = DisplacementControl(bottom, 1, by=-1.0)
    steps = LoadSteps(problem.solver, problem.apply, control=control, max_halvings=0)
    with pytest.raises(ConvergenceError, match="the loads do not move|not converge"):
        steps.run()


def punch(kind, **options):
    """Steps of a loaded punch above a block, led by its top or by an arc, which nothing
    keeps from sliding and turning."""
    size = (0.4, 0.5)
    scene = two_blocks(COMM, 2, "quadrilateral", (6, 3), upper_size=size, gap=0.05)
    case = build(
        scene,
        material="neo-hookean",
        loaded=["top"],
        bcs=lambda V, s: [fix(V, s, "bottom")],
    )
    facets = scene.facet_tags.find(scene.tags["top"])
    top = fem.locate_dofs_topological(case.u.function_space, 1, facets)
    control = ArcLength(0.01) if kind == "arc" else DisplacementControl(top, 1, by=-0.2)

    def apply(t):
        case.load.value[:] = -100.0 * t * np.eye(2)

    solver = SOLVERS[0](case.problem)
    return LoadSteps(solver, apply, max_halvings=0, control=control, **options)


@pytest.mark.mpi
@pytest.mark.parametrize("kind, axes", [("displacement", "x"), ("arc", "x, y")])
def test_a_body_that_may_turn_is_named(kind, axes):
    """Neither the loads are blamed, nor what control excludes proposed."""
    with pytest.raises(ConvergenceError) as failure:
        punch(kind).run()
    text = str(failure.value)
    assert f"is held by nothing along {axes} and may turn" in text
    assert "a condition that holds it" in text
    assert "stabilize" not in text and "the loads" not in text


@pytest.mark.mpi
def test_loose_bodies_are_those_that_nothing_holds():
    """A point holds no turn, a second one does; springs hold."""
    flying = on_bed("quadrilateral", gap=0.3)
    (text,) = loose(flying.problem)
    assert text.endswith("is held by nothing along y")
    control = DisplacementControl(flying.top, 1, by=1.0)
    assert loose(flying.problem, mean_weights(control, flying.u)) == []
    scene = two_blocks(COMM, 2, "quadrilateral", (4, 2), (3, 2), gap=0.3)

    def held_at(*places):
        def conditions(V, s):
            found = [fix(V, s, "bottom")]
            for place in places:
                dofs = fem.locate_dofs_geometrical(V, at(place))
                found.append(fem.dirichletbc(np.zeros(2), dofs, V))
            return found

        return loose(build(scene, bcs=conditions).problem)

    (text,) = held_at()
    assert text.endswith("is held by nothing along x, y and may turn")
    (text,) = held_at((0.0, 2.3))
    assert text.endswith(") may turn")
    assert held_at((0.0, 2.3), (1.0, 2.3)) == []


def at(place):
    return lambda x: np.isclose(x[0], place[0]) & np.isclose(x[1], place[1])


def loose(problem, led=None):
    """Sentences on loose bodies at the start."""
    problem.contact.update()
    return loose_bodies(problem, led)
