"""Meshes that lie in each other at the start are told, with pair, depth and place."""

import warnings

import pytest
from press_fits import press_fit, scene_of
from problems import COMM, build, fix

from meshes.scenes import two_blocks
from raymortar import ContactWarning, NonlinearProblem, Search, SNESSolver, Tie

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
