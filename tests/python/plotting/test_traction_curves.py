"""Tractions in 2D: what they are drawn over, by which colours and within what limits."""

import numpy as np
import pytest
import revolution
from interacting import Stack
from load_paths import blocks
from problems import COMM, build, fix, stack
from squeezing import squeeze

import raymortar
from meshes.scenes import two_blocks
from raymortar import ContactError
from raymortar.plotting.drawing import arc_lengths, over_angle

pytest.importorskip("matplotlib")


def right_of(figure):
    """The axes of the tractions."""
    return next(axes for axes in figure.axes if "pressure" in axes.get_ylabel())


def test_lengths_go_along_chains_however_facets_are_listed():
    # Three sides of a square of size 2, and a loop further on
    corners = np.array([[0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    chain = np.stack([corners[:-1], corners[1:]], axis=1)
    loop = 5.0 + np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    facets = np.concatenate([chain, loop])
    random = np.random.default_rng(1)
    order = random.permutation(len(facets))
    shuffled = facets[order]
    turned = random.random(len(facets)) < 0.5
    shuffled[turned] = shuffled[turned][:, ::-1]
    found = arc_lengths(shuffled, 3.0 * shuffled)
    ordered = np.sort(found, axis=1)
    np.testing.assert_allclose(ordered[:, 1] - ordered[:, 0], 6.0)
    of_chain = np.sort(ordered[order < 3, 0])
    np.testing.assert_allclose(of_chain, [0.0, 6.0, 12.0])
    np.testing.assert_allclose(
        np.sort(ordered[order >= 3, 0]), 18.0 + 6.0 * np.arange(4)
    )
    # It begins where x is smallest: at the end at (0, 0), or (0, 2)
    begin = facets[order[(found == 0.0).any(axis=1)][0]]
    assert begin[:, 0].min() == 0.0


@pytest.mark.parametrize("centre", [None, (1.0, -2.0)])
def test_angles_have_no_jump_within_a_surface(centre):
    t = np.radians(np.linspace(100.0, 260.0, 33))
    x = np.array([1.0, -2.0]) + 3.0 * np.column_stack([np.cos(t), np.sin(t)])
    found = over_angle(x, centre)
    np.testing.assert_allclose(np.diff(found), 5.0, rtol=1e-9)
    np.testing.assert_allclose(found % 360.0, np.degrees(t), rtol=1e-9)


@pytest.fixture
def pressed():
    """A uniform state in 2D, whose slave surface is as long as it is wide."""
    problem, _, P = squeeze(blocks("quadrilateral"))
    problem.solve()
    return problem, -P[-1, -1]


@pytest.mark.mpi
def test_points_of_all_ranks_are_on_their_facets(pressed):
    problem, pressure = pressed
    straight, arc = (raymortar.plot(problem.contact, x=x) for x in ("x", "arc"))
    if COMM.rank > 0:
        return
    x, along = (right_of(f).lines[0].get_xdata() for f in (straight, arc))
    # The surface is straight: both are the same from its end on
    np.testing.assert_allclose(along - along.min(), x - x.min(), atol=1e-9)
    assert right_of(arc).get_xlabel() == "length along the surface"
    np.testing.assert_allclose(right_of(arc).lines[0].get_ydata(), pressure, rtol=1e-6)


@pytest.mark.mpi
def test_pairs_have_colours_and_names_of_their_own():
    scene = stack("quadrilateral", (2, 3, 2), widths=(1.2, 1.0, 1.1))
    tower = Stack(scene, ["bottom_0"], ["top_2"])
    pairs = [("bottom_1", "top_0"), ("bottom_2", "top_1")]
    problem = tower.problem([tower.contact(*pairs)])
    tower.move(0.5)
    V = problem.u.function_space
    problem.bcs += [fix(V, scene, "left_1", 0)]
    raymortar.SNESSolver(problem).solve()
    figure = raymortar.plot(problem.contact)
    if COMM.rank == 0:
        lines = right_of(figure).lines
        assert len({line.get_color() for line in lines}) == len(lines) == 2
        names = [line.get_label() for line in lines]
        assert names == [f"{pair} pressure" for pair in problem.contact.pairs]


@pytest.mark.mpi
def test_limits_cut_no_dot_and_labels_have_units(pressed):
    problem, pressure = pressed
    figure = raymortar.plot(problem.contact, units=("mm", "MPa"))
    if COMM.rank == 0:
        axes = right_of(figure)
        lower, upper = axes.get_ylim()
        assert lower < -0.03 * pressure and upper > 1.03 * pressure
        assert axes.get_xlabel() == "x (mm)"
        assert axes.get_ylabel() == "contact pressure (MPa)"
        assert "displacement (mm)" in {a.get_ylabel() for a in figure.axes}


def test_axes_of_solids_of_revolution_are_r_and_z():
    scene = two_blocks(COMM, 2, "triangle", 2, 2)
    found = revolution.build(
        scene, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top")]
    )
    found.contact.update()
    for over, name in ((None, "r"), ("x", "r"), ("y", "z")):
        figure = raymortar.plot(found.contact, x=over, units=("mm", "MPa"))
        left, right = figure.axes[0], right_of(figure)
        assert (left.get_xlabel(), left.get_ylabel()) == ("r (mm)", "z (mm)")
        assert right.get_xlabel() == f"{name} (mm)"


def apart(dim, ahead):
    """Two blocks that do not touch, and meet each other's rays or not."""
    cell = {2: "triangle", 3: "hexahedron"}[dim]
    problem = build(blocks(cell, gap=0.1 if ahead else 50.0)).problem
    problem.contact.update()
    return problem.contact


@pytest.mark.mpi
@pytest.mark.parametrize("ahead", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_no_contact_is_said(dim, ahead, folder):
    figure = raymortar.plot(apart(dim, ahead), folder / "apart.png")
    if COMM.rank == 0:
        texts = [text.get_text() for axes in figure.axes for text in axes.texts]
        assert texts == ["no contact"]


@pytest.mark.mpi
@pytest.mark.parametrize(
    "options, message",
    [
        ({"x": "z"}, "x must be one of"),
        ({"centre": (0.0, 0.0)}, "centre belongs to angles"),
        ({"x": "angle", "centre": (0.0, 0.0, 1.0)}, "centre must be"),
        ({"units": "mm"}, "units must be"),
        ({"units": ("mm", 1)}, "units must be"),
    ],
)
def test_what_cannot_be_drawn_is_refused(pressed, options, message):
    with pytest.raises(ContactError, match=message):
        raymortar.plot(pressed[0].contact, **options)
