"""Units that are converted, names in legends, room of ticks, and zoom on contact."""

from types import SimpleNamespace

import numpy as np
import pytest
from interacting import Stack
from load_paths import blocks
from problems import COMM, fix, stack
from rigid_scenes import press, shapes
from squeezing import squeeze
from test_traction_curves import right_of

import raymortar
from raymortar import ContactError, rigid
from raymortar.plotting import drawing
from raymortar.plotting.frames import Ranges
from raymortar.plotting.labels import AxisOptions
from raymortar.plotting.picture import new_figure

matplotlib = pytest.importorskip("matplotlib")
SI = {"length": ("mm", 1e3), "stress": ("MPa", 1e-6), "field": ("kPa", 1e-3)}


@pytest.fixture(scope="module")
def ball():
    """A small ball on a block, in 2D; its force is carried by a part of the surface."""
    roller = rigid.Body(rigid.Circle((0.4, 1.13), 0.2), name="roller")
    found = press("triangle", roller, n=8)
    raymortar.SNESSolver(found.problem).solve()
    return found.contact


def limits(axes):
    return np.array([axes.get_xlim(), axes.get_ylim()])


@pytest.mark.mpi
def test_all_that_is_drawn_is_converted(ball):
    plain, shown = (raymortar.plot(ball, units=units) for units in (None, SI))
    if COMM.rank > 0:
        return
    (left, right), (scaled, over) = (f.axes[:2] for f in (plain, shown))
    np.testing.assert_allclose(limits(scaled), 1e3 * limits(left))
    for one, other in zip(left.lines, scaled.lines):
        np.testing.assert_allclose(other.get_xydata(), 1e3 * one.get_xydata())
    colours = [axes.collections[0].get_array() for axes in (left, scaled)]
    np.testing.assert_allclose(colours[1], 1e3 * colours[0])
    (x, p), (mm, mega) = (axes.lines[0].get_data() for axes in (right, over))
    np.testing.assert_allclose(mm, 1e3 * x)
    np.testing.assert_allclose(mega, 1e-6 * p)
    texts = scaled.get_xlabel(), over.get_xlabel(), over.get_ylabel()
    assert texts == ("x (mm)", "x (mm)", "contact pressure (MPa)")


@pytest.mark.quick
@pytest.mark.parametrize(
    "name, label",
    [
        ("stress", "stress (MPa)"),
        ("stress (MPa)", "stress (MPa)"),
        ("stress [MPa]", "stress [MPa]"),
        ("MPa", "MPa"),
        ("stress (Pa)", "stress (Pa) (MPa)"),
    ],
)
def test_a_label_has_its_unit_once(name, label):
    options = AxisOptions(units={"field": ("MPa", 1e-6)})
    assert options.label("field", name) == label
    assert AxisOptions().label("field", name) == name


@pytest.mark.mpi
def test_a_given_field_has_a_unit_of_its_own():
    problem, _, _ = squeeze(blocks("hexahedron"))
    problem.solve()
    plain, shown = (
        raymortar.plot(problem.contact, field=problem.u, label="s", units=units)
        for units in (None, SI)
    )
    if COMM.rank == 0:
        bars = [
            [a for a in f.axes if a.get_ylabel()[:1] == "s"] for f in (plain, shown)
        ]
        assert [bar.get_ylabel() for (bar,) in bars] == ["s", "s (kPa)"]
        tops = [bar.get_ylim()[1] for (bar,) in bars]
        assert tops[1] == pytest.approx(1e-3 * tops[0])
        maps = [f.axes[1].collections[0].get_array() for f in (plain, shown)]
        np.testing.assert_allclose(maps[1], 1e-6 * maps[0])


@pytest.mark.mpi
def test_angles_have_the_centre_in_the_meshs_unit(ball):
    angles = {"x": "angle", "centre": (0.4, 1.13)}
    figures = [raymortar.plot(ball, units=units, **angles) for units in (None, SI)]
    if COMM.rank == 0:
        one, other = (right_of(f).lines[0].get_xdata() for f in figures)
        np.testing.assert_allclose(one, other)
        assert -180.0 < one.min() and one.max() < 180.0


@pytest.mark.mpi
def test_zoom_shows_contact_and_what_is_next_to_it(ball):
    wide, near = (raymortar.plot(ball, zoom=zoom) for zoom in (False, True))
    points = ball.points()
    parts = COMM.gather(points["x"][points["status"] >= 2], root=0)
    if COMM.rank > 0:
        return
    at = np.concatenate(parts)
    for k, axes in enumerate(near.axes[:2]):
        shown = limits(axes)
        assert shown[0, 0] < at[:, 0].min() and at[:, 0].max() < shown[0, 1]
        assert np.ptp(shown[0]) < 0.6 * np.ptp(limits(wide.axes[k])[0])
    few, all_ = (len(f.axes[0].collections[-1].get_paths()) for f in (near, wide))
    assert 0 < few < 0.5 * all_


@pytest.mark.mpi
def test_zoom_without_contact_shows_all(folder):
    roller = rigid.Body(shapes(2)["circle"])
    roller.move((0.0, 0.2))
    contact = press("triangle", roller).contact
    contact.update()
    figures = [raymortar.plot(contact, zoom=zoom) for zoom in (False, True)]
    if COMM.rank == 0:
        np.testing.assert_allclose(*(limits(f.axes[0]) for f in figures))


def test_legends_have_names():
    scene = stack("quadrilateral", (2, 3, 2), widths=(1.2, 1.0, 1.1))
    tower = Stack(scene, ["bottom_0"], ["top_2"])
    tags = scene.tags
    pairs = [("upper", "lower"), (tags["bottom_2"], tags["top_1"])]
    named = {"upper": tags["bottom_1"], "lower": tags["top_0"]}
    contact = raymortar.Contact(tower.u, scene.facet_tags, pairs, names=named)
    problem = tower.problem([contact])
    tower.move(0.5)
    problem.bcs += [fix(problem.u.function_space, scene, "left_1", 0)]
    raymortar.SNESSolver(problem).solve()
    names = [line.get_label() for line in right_of(raymortar.plot(contact)).lines]
    assert names == ["upper on lower pressure", f"{contact.pairs[1]} pressure"]


@pytest.mark.parametrize(
    "name, shown",
    [("u", " u"), ("f_12", ""), ("w_0", ""), ("displacement", "")],
)
def test_the_colour_bar_says_displacement(ball, name, shown):
    """With the name of the unknown, where a user gave it one."""
    before, ball.u.name = ball.u.name, name
    labels = {axes.get_ylabel() for axes in raymortar.plot(ball, units=SI).axes}
    ball.u.name = before
    assert f"displacement{shown} (mm)" in labels


@pytest.mark.parametrize("height", [0.15, 1.0, 6.0])
def test_labels_of_ticks_do_not_touch(height):
    """Of a flat body, a square and a tall one in metres, which are a few mm wide."""
    figure = new_figure(False)
    with matplotlib.rc_context(drawing.LOOK):
        x = 8e-3 * np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, height], [0.0, height]]])
        left, right = figure.subplots(1, 2)
        colours = drawing.draw_field(left, x - 9.99e-3, np.ones((1, 4, 1)))
        right.plot(x[0, :, 0] - 1e-2, 1e8 * x[0, :, 1])
        figure.colorbar(colours, ax=left, label="displacement (m)", shrink=0.85)
        for axes in (left, right):
            axes.set(xlabel="x (m)", ylabel="contact pressure (Pa)")
        drawing.fit_ticks(figure)
        figure.draw_without_rendering()
    for axes in (left, right):
        for axis, k in ((axes.xaxis, 0), (axes.yaxis, 1)):
            low, high = sorted(axis.get_view_interval())
            ticks = [t for t in axis.get_major_ticks() if low <= t.get_loc() <= high]
            boxes = [tick.label1.get_window_extent() for tick in ticks]
            ends = sorted((box.min[k], box.max[k]) for box in boxes)
            assert all(a[1] < b[0] for a, b in zip(ends, ends[1:]))
    assert len(left.get_xticks()) >= 2 <= len(left.get_yticks())


BAD = [
    ({"units": {"length": "mm"}}, "a text and a positive factor of each of"),
    ({"units": {"length": ("mm", 0.0)}}, "a text and a positive factor"),
    ({"units": {"force": ("N", 1.0)}}, r"not \('N', 1.0\) of 'force'"),
    ({"units": 3}, "units must be .length, stress. or units and factors"),
    ({"zoom": "contact"}, "zoom = 'contact' must be True or False"),
]


@pytest.mark.mpi
@pytest.mark.parametrize("options, message", BAD)
def test_units_and_zoom_that_cannot_be_are_refused(ball, options, message):
    with pytest.raises(ContactError, match=message):
        raymortar.plot(ball, **options)


@pytest.mark.parametrize(
    "values, range_",
    [
        ([1.0, 3.0], (0.0, 3.0)),
        ([-2.0, 3.0], (-2.0, 3.0)),
        ([300.0, 301.6], (300.0, 301.6)),
        ([2.0, 2.0], (0.0, 2.0)),
        ([], (0.0, 0.0)),
    ],
)
def test_colours_begin_at_zero_where_values_do_not_lie_far_off(values, range_):
    frame = SimpleNamespace(bodies=(None, None, np.array(values)), slaves=())
    assert Ranges.of([frame]).field == range_
