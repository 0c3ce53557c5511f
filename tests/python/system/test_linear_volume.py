"""Linear bodies: tangent and residual by a kept matrix are those of the forms."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from hosts import LOWER, UPPER, linear_pressure, meshes
from materials import MATERIALS
from problems import CELLS, DIMENSION, SOLVERS, build, fix, stack
from volumes import assert_as_assembled, counted, disturb, without_what_is_kept

import raymortar
from raymortar.core import compat
from raymortar.solvers import kept_forms


def pressed(cell, degree=1, material="linear", **options):
    """Two blocks, the upper one pressed down, under a load besides."""

    def held(V, scene):
        dim = DIMENSION[cell]
        push = np.array([0.003] * (dim - 1) + [-0.02])
        top = fix(V, scene, "top", value=lambda x: np.tile(push, (len(x), 1)))
        return [fix(V, scene, "bottom"), top]

    options.setdefault("bcs", held)
    return build(
        stack(cell, (2, 3)), degree, material, loaded=["left_0"], load=5.0, **options
    ).problem


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_residual_and_tangent_are_those_of_the_forms(cell, degree):
    problem = pressed(cell, degree)
    assert problem.volume.is_linear
    disturb(problem)
    assert_as_assembled(problem)


@pytest.mark.mpi
def test_of_several_unknowns_too():
    problem = linear_pressure()
    assert problem.volume.is_linear
    disturb(problem)
    assert_as_assembled(problem)


@pytest.mark.mpi
@pytest.mark.parametrize("curved", [None, 0, 1])
def test_bodies_on_meshes_of_their_own(curved):
    """Each has a form, and all have to be linear."""
    scenes, functions, forms, bcs = meshes(), [], [], []
    for k, scene in enumerate(scenes):
        V = compat.vector_space(scene.mesh, 1)
        u, v = fem.Function(V), ufl.TestFunction(V)
        law = MATERIALS["neo-hookean" if k == curved else "linear"][0]
        dx = ufl.dx(scene.mesh, metadata={"quadrature_degree": 2})
        forms.append(ufl.inner(law(ufl.grad(u), 800.0, 1200.0), ufl.grad(v)) * dx)
        functions.append(u)
        bcs.append(fix(V, scene, ("bottom", "top")[k], value=-0.02 * k))
    tags = [scene.facet_tags for scene in scenes]
    contact = raymortar.Contact(functions, tags, [(UPPER + 1, LOWER + 2)])
    problem = raymortar.NonlinearProblem(forms, contact, bcs, u=functions)
    assert problem.volume.is_linear == (curved is None)
    if curved is None:
        disturb(problem)
        assert_as_assembled(problem)


@pytest.mark.mpi
def test_changes_of_loads_moduli_conditions_and_places_are_seen():
    scene = stack("triangle", (2, 3))
    down = fem.Constant(scene.mesh, np.array([0.0, -0.02]))
    found = build(
        scene,
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=down)],
        loaded=["left_0"],
    )
    problem = found.problem
    disturb(problem)
    assert_as_assembled(problem)
    found.load.value[:] = 7.0 * np.eye(2)
    assert_as_assembled(problem)
    found.moduli[0].x.array[:] *= 3.0
    assert_as_assembled(problem)
    down.value[:] = 0.01, -0.03
    assert_as_assembled(problem)
    problem.bcs.append(fix(found.u.function_space, scene, "left_1", 0))
    assert_as_assembled(problem)
    x = scene.mesh.geometry.x
    x[np.abs(x[:, 1] - 1.0) > 0.1, 0] *= 1.1  # all but the surfaces of contact
    assert_as_assembled(problem)


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_solves_as_without_what_is_kept(solver):
    found = []
    for keeps in (True, False):
        problem = pressed("quadrilateral", method=raymortar.AugmentedLagrangian())
        if not keeps:
            problem.volume = without_what_is_kept(problem)
        assert problem.volume.is_linear == keeps
        iterations, _ = solver(problem).solve()
        found.append((iterations, problem.u.x.array.copy()))
    assert found[0][0] == found[1][0]
    assert found[0][1] == pytest.approx(found[1][1], abs=1e-13)


def test_the_tangent_is_assembled_once(monkeypatch):
    problem = pressed("triangle")
    calls = counted(monkeypatch)
    solver = raymortar.SNESSolver(problem)
    for _ in range(2):
        solver.solve()
        problem.contact.advance()
        disturb(problem)
    assert len(calls) == 1


@pytest.mark.mpi
def test_forms_of_one_structure_are_looked_into_once(monkeypatch):
    for material in ("linear", "neo-hookean"):
        pressed("triangle", material=material)
    monkeypatch.setattr(kept_forms, "derivative", None)
    assert not pressed("triangle", material="neo-hookean").volume.is_linear
    problem = pressed("triangle")
    assert problem.volume.is_linear
    disturb(problem)
    assert_as_assembled(problem)


@pytest.mark.mpi
def test_it_counts_which_function_of_a_form_is_the_unknown():
    V = compat.vector_space(stack("triangle", (2, 3)).mesh, 1)
    a, b = fem.Function(V), fem.Function(V)
    F = ufl.dot(b, b) * ufl.inner(ufl.grad(a), ufl.grad(ufl.TestFunction(V))) * ufl.dx
    for _ in range(2):
        of_residual, of_tangent = kept_forms.inputs_if_linear([F], [a])
        assert of_residual.functions == of_tangent.functions == [b]
        assert kept_forms.inputs_if_linear([F], [b]) is None
        assert kept_forms.inputs_if_linear([F], [a, b]) is None


def test_others_are_not_kept():
    assert not pressed("triangle", material="neo-hookean").volume.is_linear
    # A given tangent may be another's
    linear = pressed("triangle")
    given = raymortar.NonlinearProblem(
        linear.forms[0], linear.contact, linear.bcs, linear.forms[1]
    )
    assert not given.volume.is_linear


def test_a_part_of_the_unknown_under_another_name_is_no_constant():
    """A form may read u through a second Function of the same values."""
    problem = pressed("triangle")
    V = problem.u.function_space
    same = fem.Function(V, problem.u.x)
    F = problem.forms[0] + ufl.inner(same, ufl.TestFunction(V)) * ufl.dx
    other = raymortar.NonlinearProblem(F, problem.contact, problem.bcs)
    assert not other.volume.is_linear


def jumps(u, v):
    """Loads that jump with u; their derivatives are zero wherever there are any."""
    energy = ufl.max_value(-u[1] - 0.002, 0.0)
    strain = ufl.variable(u[0])
    return {
        "condition": ufl.conditional(ufl.gt(u[0], 0.0), 1.0, -1.0) * v[0],
        "sign": ufl.sign(u[0]) * v[0],
        "energy": ufl.derivative(energy * ufl.dx, u, v),
        "diff": ufl.diff(abs(strain), strain) * v[0],
    }


@pytest.mark.parametrize("name", ["condition", "sign", "energy", "diff"])
def test_a_load_that_jumps_with_the_unknown_is_not_linear(name):
    problem = pressed("triangle")
    u, v = problem.u, ufl.TestFunction(problem.u.function_space)
    load = jumps(u, v)[name]
    F = problem.forms[0] + (load if name == "energy" else load * ufl.dx)
    other = raymortar.NonlinearProblem(F, problem.contact, problem.bcs)
    assert not other.volume.is_linear
