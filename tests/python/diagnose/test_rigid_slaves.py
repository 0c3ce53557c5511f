"""Slaves that are prescribed throughout, on masters that are not."""

import warnings

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import locate_entities
from problems import COMM, DIMENSION, build, fix

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactWarning,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    tools,
)
from raymortar.core.errors import SetUpError

pytestmark = pytest.mark.quick
PUSH, STEPS = 0.05, 2


def pressed(cell, counts, degree=1, unit=1.0, gap=0.0, **options):
    """A rigid block over a soft one, with counts (lower, upper) of facets along x, both
    1 unit wide; and a function that moves it to a load factor."""
    size = (unit,) * DIMENSION[cell]
    scene = two_blocks(
        COMM, len(size), cell, *counts, lower_size=size, upper_size=size, gap=gap
    )
    down = fem.Constant(scene.mesh, np.zeros(len(size)))

    def bcs(V, scene):
        cells = scene.cell_tags.find(scene.bodies["upper"])
        dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim, cells)
        return [fix(V, scene, "bottom"), fem.dirichletbc(down, dofs, V)]

    case = build(scene, degree, "neo-hookean", bcs=bcs, **options)

    def move(t):
        down.value[-1] = -t * PUSH * unit

    return case, move


def force(case, move):
    """Contact force on the slave at the end of the path."""
    solver = SNESSolver(case.problem)
    for step in range(STEPS):
        move((step + 1) / STEPS)
        solver.solve()
        case.contact.advance()
    (found,) = case.contact.results.resultants()
    return found.force


def test_names_are_told():
    case, _ = pressed("quadrilateral", (4, 8), E=10.0, names={"lid": 3, "bed": 4})
    with pytest.raises(
        SetUpError, match=r"all of slave 'lid' \(tag 3\) is prescribed"
    ) as told:
        SNESSolver(case.problem)
    assert str(told.value).endswith("sides in the other order, pairs=[('bed', 'lid')]")


LAWS = {"frictionless": None, "friction": Coulomb(0.3)}


@pytest.mark.mpi(where=lambda law, **_: law == "friction")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("unit, E", [(1.0, 10.0), (1e-3, 2e11)])
@pytest.mark.parametrize("gap", [0.0, 4.0])
@pytest.mark.parametrize("counts", [(4, 6), (4, 8), (4, 16), (8, 12), (20, 21)])
def test_finer_slaves_are_refused_before_the_first_solve(counts, gap, unit, E, law):
    """As they fail, or find tractions that go to and fro; also where no ray hits yet."""
    options = dict(E=E, friction=LAWS[law])
    case, _ = pressed("quadrilateral", counts, unit=unit, gap=gap * unit, **options)
    tags = case.scene.tags
    with pytest.raises(SetUpError) as told:
        SNESSolver(case.problem)
    text = str(told.value)
    assert f"all of slave tag {tags['slave']} is prescribed" in text
    assert f"pairs=[({tags['master']}, {tags['slave']})]" in text


@pytest.mark.mpi(where=lambda law, degree, **_: (law, degree) == ("friction", 2))
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("degree", [1, 2])
def test_what_the_message_proposes_solves(degree, law):
    case, move = pressed(
        "quadrilateral", (4, 8), degree, E=10.0, friction=LAWS[law], swap=True
    )
    assert force(case, move)[1] < 0.0  # on the soft block, which is the slave


@pytest.mark.mpi(where=lambda law, **_: law == "friction")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("counts", [(8, 4), (8, 6), (8, 8)])
def test_coarser_and_equal_ones_solve(counts, degree, law):
    """And give the force of the sides in the other order, within the meshes' error."""
    options = dict(degree=degree, E=10.0, friction=LAWS[law])
    found = [
        force(*pressed("quadrilateral", counts, swap=swap, **options))
        for swap in (False, True)
    ]
    assert found[0][1] == pytest.approx(-found[1][1], rel=0.05)


@pytest.mark.parametrize(
    "options",
    [
        dict(method=Penalty()),
        dict(method=AugmentedLagrangian(degree=1), degree=2, counts=(4, 4)),
        dict(swap=True),
    ],
)
def test_what_is_not_over_constrained_is_let_pass(options):
    """A penalty, a multiplier of a lower degree than the master, the free slave."""
    case, _ = pressed("quadrilateral", **{"counts": (4, 8), "E": 10.0, **options})
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        SNESSolver(case.problem)


def test_in_space(cell_3d):
    case, _ = pressed(cell_3d, (2, 4), E=10.0)
    with pytest.raises(SetUpError, match="are 2 times as close as those of its"):
        SNESSolver(case.problem)
    SNESSolver(pressed(cell_3d, (3, 3), E=10.0)[0].problem)


# Slaves that are prescribed along the surface alone

AT = {
    "points": AugmentedLagrangian(),
    "nodes": AugmentedLagrangian(condition="nodes"),
    "dual": AugmentedLagrangian(condition="nodes", multiplier="dual"),
}


def led(
    cell, counts, law, held, degree=1, on=("slave",), width=1.5, more=(), **options
):
    """A block on a wider one, under a load; components of some of its surfaces are held,
    the first one led by the Constant that is returned with it, and `more` by name."""
    size = (1.0,) * DIMENSION[cell]
    scene = two_blocks(
        COMM, len(size), cell, *counts, lower_size=(width, *size[1:]), upper_size=size
    )
    x = fem.Constant(scene.mesh, 0.0)

    def bcs(V, scene):
        values = [x, *[0.0 for _ in held[1:]]]
        own = [
            fix(V, scene, name, i, value)
            for name in on
            for i, value in zip(held, values)
        ]
        also = [fix(V, scene, name, i) for name, i in more]
        return [fix(V, scene, "bottom"), *own, *also]

    case = build(
        scene,
        degree,
        method=AT[law],
        bcs=bcs,
        loaded=["top"],
        **({"load": -4.0, "friction": Coulomb(0.3)} | options),
    )
    return case, x


@pytest.mark.mpi(
    where=lambda cell, degree, law, **_: (cell, degree, law) == ("triangle", 1, "nodes")
)
@pytest.mark.parametrize("law", AT)
@pytest.mark.parametrize(
    "cell, degree, counts",
    [
        ("triangle", 1, (4, 8)),
        ("quadrilateral", 1, (4, 9)),
        ("quadrilateral", 2, (3, 5)),
        ("hexahedron", 1, (2, 4)),
        ("tetrahedron", 1, (2, 4)),
    ],
)
def test_slaves_led_along_the_surface_are_refused(cell, degree, counts, law):
    """With finer facets than the free master's; in the other order they are dragged."""
    case, _ = led(cell, counts, law, range(DIMENSION[cell] - 1), degree)
    with pytest.raises(SetUpError, match="is prescribed along x") as told:
        SNESSolver(case.problem)
    assert "give the sides in the other order, pairs=[(" in str(told.value)
    case, x = led(cell, counts, law, range(DIMENSION[cell] - 1), degree, swap=True)
    solver = SNESSolver(case.problem)
    for place in (0.0, 0.002, 0.004):
        x.value = place
        iterations, _ = solver.solve()
        assert iterations <= 8
        (found,) = case.contact.results.resultants()
        assert found.force[-1] == pytest.approx(-4.0, rel=1e-9)
        case.contact.advance()
    assert found.force[0] == pytest.approx(0.3 * 4.0, rel=2e-2)


@pytest.mark.mpi(where=lambda law, **_: law == "nodes")
@pytest.mark.parametrize("law", AT)
def test_slaves_led_along_one_axis_are_refused(law):
    """Free along the other axis, in which friction holds the slave."""
    case, _ = led("hexahedron", (2, 4), law, [0])
    with pytest.raises(SetUpError, match="is prescribed along x, and"):
        SNESSolver(case.problem)
    case, x = led("hexahedron", (2, 4), law, [0], swap=True)
    solver = SNESSolver(case.problem)
    for place in (0.0, 0.02, -0.02):
        sign = np.sign(place - x.value)
        x.value = place
        iterations, _ = solver.solve()
        assert iterations <= 8
        (found,) = case.contact.results.resultants()
        assert found.force[2] == pytest.approx(-4.0, rel=1e-9)
        assert found.force[0] == pytest.approx(sign * 0.3 * 4.0, rel=1e-2)
        assert abs(found.force[1]) < 1e-9 * 4.0
        case.contact.advance()


@pytest.mark.mpi(where=lambda law, **_: law == "nodes")
@pytest.mark.parametrize("law", AT)
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
@pytest.mark.parametrize(
    "cell, counts", [("quadrilateral", (4, 8)), ("hexahedron", (2, 3))]
)
def test_slaves_led_along_the_normal_are_refused(cell, counts, friction, law):
    """In the other order they are pressed in few iterations."""
    last = DIMENSION[cell] - 1
    options = dict(friction=friction, width=1.0, more=[("top", i) for i in range(last)])
    case, _ = led(cell, counts, law, [last], **options)
    with pytest.raises(SetUpError, match="is prescribed along [yz], and"):
        SNESSolver(case.problem)
    case, y = led(cell, counts, law, [last], swap=True, **options)
    solver = SNESSolver(case.problem)
    for place in (-0.01, -0.02):
        y.value = place
        iterations, _ = solver.solve()
        assert iterations <= 8
        case.contact.advance()
    (found,) = case.contact.results.resultants()
    assert found.force[-1] < -1.0


@pytest.mark.parametrize("law", AT)
@pytest.mark.parametrize(
    "cell, counts, friction, held, on",
    [
        # Symmetry at the edge
        ("quadrilateral", (4, 8), 0.3, (0,), ("upper_left",)),
        # Rollers without friction
        ("hexahedron", (2, 4), None, (0, 1), ("slave",)),
        # The master is held there, too
        ("hexahedron", (2, 4), 0.3, (1,), ("slave", "master")),
    ],
)
def test_slaves_are_let_pass_where_they_or_no_side_balance(
    cell, counts, friction, held, on, law
):
    friction = None if friction is None else Coulomb(friction)
    case, _ = led(cell, counts, law, held, on=on, friction=friction)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        SNESSolver(case.problem)


@pytest.mark.mpi
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("gap", [0.0, 3.0])
def test_coarse_facets_that_are_never_met_refuse_nothing(gap, law):
    """A layer led along the normal, with free sides, far above a block whose facets are
    as fine as its own below it, and far coarser beside."""
    places = np.concatenate([[0.0, 0.2], np.linspace(0.4, 0.6, 9), [0.8, 1.0]])
    blocks = [
        Block((4, 2), (-0.5, gap), (0.5, gap + 0.5), tags={"bottom": 1, "top": 2}),
        Block((12, 4), (-3.0, -1.0), (3.0, 0.0), grading=(places, None),
              tags={"bottom": 3, "top": 4}),
    ]  # fmt: skip
    mesh, _, facets = assemble_blocks(COMM, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v, led = fem.Function(V), ufl.TestFunction(V), fem.Constant(mesh, 0.0)
    F = ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx
    layer = locate_entities(mesh, 2, lambda x: x[1] > gap - 1e-9)
    dofs = fem.locate_dofs_topological(V.sub(1), 2, layer)
    bcs = [
        fem.dirichletbc(led, dofs, V.sub(1)),
        tools.prescribe(V, facets.find(3)),
        tools.prescribe(V, facets.find(2), component=0),
    ]
    contact = Contact(u, facets, [(1, 4)], friction=LAWS[law])
    problem = NonlinearProblem(F, contact, bcs)

    def press(t):
        led.value = -(gap + 0.02) * t

    steps = LoadSteps(problem.snes_solver, press, 3).run()
    assert max(step.iterations for step in steps) <= 8
    assert contact.resultant().force[1] > 0.02
