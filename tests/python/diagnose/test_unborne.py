"""Loads that nothing bears are refused before a solve."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION, build, fix

from meshes.scenes import two_blocks
from raymortar import Coulomb, LoadSteps, NewtonSolver, NonlinearProblem
from raymortar.core.errors import SetUpError
from raymortar.diagnose.unborne import unborne_loads


def pressed(cell, ends, **options):
    """Two blocks of equal width under pressure on some of their ends."""
    scene = two_blocks(COMM, DIMENSION[cell], cell, 3, 2, gap=0.01)
    return build(scene, material="neo-hookean", loaded=ends, load=-1.0, **options)


def clamped(V, scene):
    return [fix(V, scene, "bottom")]


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
def test_a_load_on_bodies_that_nothing_holds_is_told(cell):
    text = unborne_loads(pressed(cell, ["top"]).problem)
    assert "-1 along " + "xyz"[DIMENSION[cell] - 1] in text


@pytest.mark.parametrize("ends, bcs", [(["top", "bottom"], None), (["top"], clamped)])
def test_loads_that_cancel_or_that_a_condition_bears_are_not(cell, ends, bcs):
    assert unborne_loads(pressed(cell, ends, bcs=bcs).problem) is None


def test_springs_bear_loads(cell_2d):
    found = pressed(cell_2d, ["top"])
    (F, _), u = found.problem.forms, found.u
    v = ufl.TestFunction(u.function_space)
    on_springs = F + 1e-3 * ufl.inner(u, v) * ufl.dx
    assert unborne_loads(NonlinearProblem(on_springs, found.contact)) is None
    assert unborne_loads(NonlinearProblem(F, found.contact)) is not None


# Forces on all bodies against their displacement u, by a coefficient k that is zero at first
FOUNDATIONS = {
    "set late": lambda k, u: k * u,
    "weak": lambda k, u: 1e-10 * k * u,
    "cubic": lambda k, u: k * u**3,
    "pressed alone": lambda k, u: ufl.conditional(
        ufl.lt(u, -1e-2), k * (u + 1e-2), 0.0
    ),
}


@pytest.mark.mpi(where=lambda cell_2d, name: cell_2d == "triangle")
@pytest.mark.parametrize("name", FOUNDATIONS)
def test_foundations_bear_loads_as_they_are_at_present(cell_2d, name):
    found = pressed(cell_2d, ["top"])
    found.load.value *= 1e-4
    (F, _), u = found.problem.forms, found.u
    v = ufl.TestFunction(u.function_space)
    k = fem.Constant(found.scene.mesh, 0.0)
    on_foundation = F + FOUNDATIONS[name](k, u[1]) * v[1] * ufl.dx
    problem = NonlinearProblem(on_foundation, found.contact)
    assert "-0.0001 along y" in unborne_loads(problem)
    k.value = 1e3
    assert unborne_loads(problem) is None
    assert not u.x.array.any()


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
def test_a_path_does_not_begin(cell_2d, friction):
    found = pressed(cell_2d, ["top"], friction=friction)
    load, stress = found.load, np.array(found.load.value)

    def apply(t):
        load.value[:] = t * stress

    with pytest.raises(SetUpError, match="nothing bears the loads") as failure:
        LoadSteps(NewtonSolver(found.problem), apply, 4).run()
    assert "-0.25 along y" in str(failure.value)
    assert found.problem.tangents == 0


@pytest.mark.mpi
def test_a_path_goes_on_until_loads_do_not_cancel(cell_2d):
    """Loads cancel at first; then one of them is there alone."""
    found = pressed(cell_2d, ["top", "bottom"])
    one = fem.Constant(found.scene.mesh, np.zeros(2))
    push = ufl.inner(one, ufl.TestFunction(found.u.function_space)) * ufl.dx
    F, stress = found.problem.forms[0] - push, np.array(found.load.value)
    problem = NonlinearProblem(F, found.contact)

    def apply(t):
        found.load.value[:] = min(t, 0.5) * stress
        one.value[0] = max(t - 0.5, 0.0)

    factors = []
    with pytest.raises(SetUpError, match="nothing bears the loads.* along x"):
        for step in LoadSteps(NewtonSolver(problem), apply, 2):
            factors.append(step.factor)
    assert factors == [0.5]
