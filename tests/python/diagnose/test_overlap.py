"""Meshes that lie in each other at the start are told, with pair, depth and place."""

import warnings

import pytest
import ufl
from dolfinx import fem
from press_fits import press_fit, scene_of
from problems import COMM, build, fix

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import (
    Contact,
    ContactWarning,
    NonlinearProblem,
    Search,
    SNESSolver,
    Tie,
    rigid,
    tools,
)

pytestmark = [pytest.mark.quick, pytest.mark.mpi]
FACET = 0.25


def overlaps(make):
    """What is told of overlaps when something is made."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        make()
    return [str(w.message) for w in caught if " starts " in str(w.message)]


def told(gap, unit=1.0, before=lambda contact: None, thickness=1.0, n=4, **options):
    """What two solvers of two blocks tell of their start."""
    sizes = {"lower_size": (unit, thickness * unit), "upper_size": unit}
    scene = two_blocks(COMM, 2, "triangle", n, n, gap=gap * unit, **sizes)
    case = build(scene, bcs=lambda V, s: [fix(V, s, ["bottom", "top"])], **options)
    before(case.contact)
    return overlaps(lambda: [SNESSolver(case.problem) for _ in range(2)])


@pytest.mark.parametrize("unit, E", [(1.0, 1.0), (1e-3, 2e11)])
def test_depth_place_and_pair_are_told_once(unit, E):
    (text,) = told(-0.1, unit, E=E)
    assert text.startswith(f"slave tag 3 starts {0.1 * unit:.3g} deep in tag 4 at (")
    x, y = map(float, text.partition("at (")[2].partition(")")[0].split(", "))
    assert 0.0 <= x <= unit and y == pytest.approx(0.9 * unit)


def test_names_are_told():
    named = {"names": {"teeth": 3, "gear2": 4}}
    (text,) = told(-0.1, **named)
    assert text.startswith("slave 'teeth' starts 0.1 deep in 'gear2' at (")


@pytest.mark.parametrize("unit, E", [(1.0, 1.0), (1e-3, 2e11)])
@pytest.mark.parametrize(
    "overlap, swap, seen",
    [(0.3, False, True), (0.3, True, True), (2.0, False, False), (2.0, True, True)],
)
def test_thin_sheets_are_told(overlap, seen, swap, unit, E):
    """By their thickness, of which the facets are 100 times; also pierced ones."""
    t = 0.0025
    found = told(-overlap * t, unit, thickness=t, E=E, swap=swap)
    (text,) = found
    expected = f"starts {overlap * t * unit:.3g} deep in" if seen else "starts inside"
    assert expected in text


@pytest.mark.parametrize("unit", [1.0, 1e-3])
@pytest.mark.parametrize(
    "gap, n, options",
    [(-0.7, 8, {}), (-0.3, 8, {"search": Search(depth=1e-5)})],
)
def test_what_is_deeper_than_rays_are_followed_is_told(gap, n, options, unit):
    (text,) = told(gap, unit, n=n, names={"teeth": 3, "gear2": 4}, **options)
    assert text.startswith("slave 'teeth' starts inside 'gear2', or behind it, deeper ")
    assert f", {(1.0 + gap + 0.01 / n) * unit:.6g}), before" in text


@pytest.mark.parametrize("gap, tells", [(0.0, False), (-0.7, True)])
@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_the_same_in_space(cell, gap, tells):
    scene = two_blocks(COMM, 3, cell, 3, 6, gap=gap)
    found = overlaps(lambda: SNESSolver(build(scene).problem))
    assert [" inside tag 4, " in text for text in found] == [True] * tells


@pytest.mark.parametrize(
    "gap, options",
    [
        (0.0, {}),
        (-0.005 * FACET, {}),  # noise of nodes
        (-0.1, {"offset": 0.1}),  # the coordinates have a clearance too little
        (0.0, {"offset": -0.1}),  # an interference that is asked for
        (-0.02, {"before": lambda contact: contact.adjust(within=0.03)}),
    ],
)
def test_what_is_wanted_or_noise_is_not_told(gap, options):
    assert told(gap, **options) == []


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize(
    "degree, counts", [(1, (5, 8)), (1, (8, 5)), (2, (2, 8)), (2, (8, 2))]
)
def test_a_shaft_that_fills_its_hub_is_not_told(degree, counts, swap):
    """Of coarse and of fine facets: chords, or arcs that lie off the chords."""
    scene = scene_of(*counts, geometry_degree=degree)
    case = press_fit(scene, 1.0, 0.3, 0.0, degree, swap=swap)
    assert overlaps(lambda: SNESSolver(case.problem)) == []


def test_ties_are_not_told():
    """Their gaps are kept or closed."""
    scene = two_blocks(COMM, 2, "triangle", 4, 4, gap=-0.1)
    case = build(scene, bcs=lambda V, s: [fix(V, s, ["bottom", "top"])])
    tie = Tie(case.u, scene.facet_tags, [(3, 4)])
    problem = NonlinearProblem(case.problem.forms[0], tie, case.problem.bcs)
    assert overlaps(lambda: SNESSolver(problem)) == []


def in_tool(tool, dim=2, **options):
    """What is told of a block whose foot is at height 0.3, as a problem is made."""
    block = Block((4,) * dim, (0.0,) * (dim - 1) + (0.3,), (1.0,) * (dim - 1) + (1.3,),
                  tags={"bottom": 1, "top": 2})  # fmt: skip
    cell = {2: "quadrilateral", 3: "hexahedron"}[dim]
    mesh, _, facets = assemble_blocks(COMM, [block], cell)
    u = fem.Function(tools.vector_space(mesh, 1))
    energy = ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx
    residual = ufl.derivative(energy, u, ufl.TestFunction(u.function_space))
    contact = Contact(u, facets, [(1, tool)], names={"foot": 1}, **options)
    problem = NonlinearProblem(residual, contact)
    return overlaps(lambda: [SNESSolver(problem) for _ in range(2)])


def test_a_tool_that_a_slave_starts_in_is_told_once():
    (text,) = in_tool(rigid.Plane((0.0, 0.35), (0.0, 1.0)))
    assert text.startswith("slave 'foot' starts 0.05 deep in the rigid Plane at (")
    assert ", 0.3), before anything has moved: make the tool where" in text
    ball = rigid.Body(rigid.Sphere((0.5, 0.5, 0.1), 0.25), name="ball", free=("z",))
    (text,) = in_tool(ball, dim=3)
    assert "deep in the rigid ball at (" in text


def test_a_tool_deeper_than_rays_are_followed_is_told():
    plane = rigid.Plane((0.0, 1.2), (0.0, 1.0))
    (text,) = in_tool(plane, search=Search(depth=1e-3))
    assert "starts 0.9 deep in the rigid Plane" in text


def moved(way):
    body = rigid.Body(rigid.Plane((0.0, 0.3), (0.0, 1.0)))
    body.move(way)
    return body


@pytest.mark.parametrize(
    "tool, options",
    [
        (rigid.Plane((0.0, 0.3), (0.0, 1.0)), {}),
        (rigid.Plane((0.0, 0.301), (0.0, 1.0)), {}),  # noise of nodes
        (moved((0.0, 0.1)), {}),  # a load of the user's
        (rigid.Plane((0.0, 0.4), (0.0, 1.0)), {"offset": 0.1}),
        (rigid.Plane((0.0, 0.3), (0.0, 1.0)), {"offset": -0.1}),
        (rigid.Circle((0.5, 2.0), 0.2), {}),  # not in the way of any ray
    ],
)  # fmt: skip
def test_tools_that_are_wanted_or_touch_are_not_told(tool, options):
    assert in_tool(tool, **options) == []
