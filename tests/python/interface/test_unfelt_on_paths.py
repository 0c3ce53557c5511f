"""Friction of sides that are led along the surface, and of those that are held where a
load has pushed them [theory (5.21), (5.22)]."""

import numpy as np
import pytest
from condensing import newton
from dolfinx import fem
from held_sides import KINDS, LAWS, PRESS, blocks, pressed
from problems import COMM, DIMENSION, build, fix, residual, worst

from meshes.scenes import two_blocks
from raymortar import CondensedProblem, Coulomb, LoadSteps, SNESSolver

PUSH = 0.05 * PRESS  # along the surface

# Blocks that are led along the surface


def led(cell, degree, law, friction=0.2, **options):
    """A block under a load, and the Constant that leads its slave nodes along x."""
    scene = blocks(cell, (2, 2))
    x = fem.Constant(scene.mesh, 0.0)
    held = range(DIMENSION[cell] - 1)
    case = pressed(cell, degree, law, held, friction, scene, {0: x}, **options)
    return case, x


@pytest.mark.mpi(
    where=lambda cell, degree, law, **_: (cell, law) == ("hexahedron", "points")
)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell, degree", [*KINDS, ("tetrahedron", 2)])
def test_a_slide_and_its_reversal_have_the_friction_of_the_law(cell, degree, law):
    """In one step each, however far, in few iterations."""
    case, x = led(cell, degree, law)
    solver = SNESSolver(case.problem)
    solver.solve()
    case.contact.advance()
    for place in (0.3, -0.3, 0.3):
        sign = np.sign(place - x.value)
        x.value = place
        iterations, _ = solver.solve()
        assert iterations <= 8
        force = case.contact.resultant(0).force
        assert force[-1] == pytest.approx(PRESS, rel=1e-9)
        assert force[0] == pytest.approx(-sign * 0.2 * PRESS, rel=2e-3)
        case.contact.advance()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("friction", [0.2, 0.9])
@pytest.mark.parametrize("count", [1, 3])
def test_one_cell_is_led_in_few_tangents(count, friction, law):
    """Its lower side is prescribed along y, its upper one held along x (CalculiX,
    friction2)."""
    scene = two_blocks(COMM, 3, "hexahedron", 1, count, lower_size=(3.0, 4.0, 1.0))
    y = fem.Constant(scene.mesh, 0.0)

    def bcs(V, scene):
        plate = [fix(V, scene, name) for name in ("bottom", "master")]
        return [*plate, fix(V, scene, "slave", 1, y), fix(V, scene, "top", 0)]

    load = np.zeros((3, 3))
    load[2, 2] = -100.0
    case = build(
        scene,
        method=LAWS[law],
        friction=Coulomb(friction),
        bcs=bcs,
        E=210000.0,
        loaded=["top"],
        load=load,
    )
    solver = SNESSolver(case.problem)
    assert solver.solve()[0] <= 4
    assert case.contact.resultant(0).force[2] == pytest.approx(100.0, rel=1e-9)
    case.contact.advance()
    for place in (1.0, -1.0, 1.0):
        start = float(y.value)

        def lead(t):
            y.value = start + (place - start) * t

        (step,) = LoadSteps(solver, lead, 1, progress=False)
        assert step.tangents <= 8
        # The cells' own stiffness times the motion, and not that of a wild traction
        assert max(case.problem.history) < 1e6
        force = case.contact.resultant(0).force
        assert force[2] == pytest.approx(100.0, rel=1e-9)
        assert force[1] == pytest.approx(-np.sign(place) * friction * 100.0, rel=1e-3)


# History


def held_where_it_is(law):
    """A block that a load has pushed along x, and that is held there along x since, its
    solver, and nodal tractions of the push. Contact is closed throughout, as where it
    opens the surface tilts, and pressure has a part along x."""
    load = -PRESS * np.eye(2)
    load[0, 1] = PUSH
    case = pressed("quadrilateral", 1, law, [], load=load)
    SNESSolver(case.problem).solve()
    case.contact.advance()
    force = case.contact.resultant(0).force
    assert force[0] == pytest.approx(-PUSH, rel=1e-9)
    part = case.u.function_space.sub(0)
    W, places = part.collapse()
    stay = fem.Function(W)
    stay.x.array[:] = case.u.x.array[places]
    facets = case.scene.facet_tags.find(case.scene.tags["slave"])
    dofs = fem.locate_dofs_topological((part, W), 1, facets)
    case.problem.bcs.append(fem.dirichletbc(stay, dofs, part))
    return case, SNESSolver(case.problem), tractions(case).copy()


def tractions(case):
    """Tractions at the nodes of the multiplier, (nodes, d)."""
    return case.contact.multiplier.x.array.reshape(-1, case.u.ufl_shape[0])


@pytest.mark.parametrize("law", LAWS)
def test_accepted_friction_is_kept_where_the_sides_are_held_then(law):
    """Pushed along x by a load, then held there and pressed more, with more push: the
    friction at each node is that of the push, as its bound does not fall anywhere."""
    case, solver, accepted = held_where_it_is(law)
    load = case.load.value.copy()
    for factor in (1.0, 2.0):
        case.load.value[:] = factor * load
        solver.solve()
        force = case.contact.resultant(0).force
        assert force[1] == pytest.approx(factor * PRESS, rel=1e-9)
        assert force[0] == pytest.approx(-PUSH, rel=1e-9)
        assert worst(tractions(case)[:, 0] - accepted[:, 0]) < 1e-9 * PRESS
        case.contact.advance()


@pytest.mark.parametrize("law", ["nodes", "dual"])
@pytest.mark.parametrize("factor", [0.3, 0.1])
def test_accepted_friction_falls_with_its_bound(factor, law):
    """Held along x, and pressed less: each node keeps the lesser one of its accepted
    traction and its bound."""
    case, solver, accepted = held_where_it_is(law)
    case.load.value[:] = -factor * PRESS * np.eye(2)
    solver.solve()
    now, bound = tractions(case), 0.3 * np.abs(tractions(case)[:, 1])
    expected = np.clip(accepted[:, 0], -bound, bound)
    assert worst(now[:, 0] - expected) < 1e-9 * PRESS
    assert worst(expected - accepted[:, 0]) > 0.01 * PRESS


# The condensed problem


@pytest.mark.mpi(where=lambda cell, degree: (cell, degree) == ("hexahedron", 1))
@pytest.mark.parametrize(
    "cell, degree", [("triangle", 1), ("quadrilateral", 2), ("hexahedron", 1)]
)
def test_condensed_slides_have_the_iterates_of_coupled_ones(cell, degree):
    """Pressed, led along x and back; forces, tractions and numbers of iterations."""
    found = []
    for condense in (False, True):
        case, x = led(cell, degree, "dual")
        problem = case.problem
        if condense:
            form, _, load = residual(case.scene, case.u, loaded=["top"])
            load.value[:] = case.load.value
            problem = CondensedProblem(form, case.u, case.contact, problem.bcs)
        solver, rows = None if condense else SNESSolver(problem), []
        for place in (0.0, 0.3, -0.3):
            x.value = place
            iterations = len(newton(problem)) - 1 if condense else solver.solve()[0]
            rows += [(iterations, case.contact.resultant(0).force, tractions(case))]
            rows[-1] = tuple(map(np.copy, rows[-1]))
            case.contact.advance()
        found.append(rows)
    for coupled, condensed in zip(*found):
        assert condensed[0] <= coupled[0] + 1
        for one, other in zip(coupled[1:], condensed[1:]):
            assert worst(one - other) < 1e-8 * PRESS
