"""Which points stick and which slip, and bodies on meshes of their own."""

from types import SimpleNamespace

import host_solutions
import hosts
import numpy as np
import pytest
import ufl
from problems import COMM

import raymortar
from raymortar import ContactError, Coulomb
from raymortar.plotting import maps
from raymortar.plotting.drawing import STATUSES
from raymortar.plotting.labels import AxisOptions
from raymortar.results import Status

pytest.importorskip("matplotlib")


def colours_at(axes, at):
    """Colours of a map at places (n, 2)."""
    (image,) = axes.images
    left, right, low, high = image.get_extent()
    rows, columns = image.get_array().shape[:2]
    k = ((at[:, 0] - left) / (right - left) * columns).astype(int)
    j = ((at[:, 1] - low) / (high - low) * rows).astype(int)
    return np.asarray(image.get_array())[j, k]


def test_a_map_has_the_status_of_the_nearest_point_of_a_facet():
    """Two facets in a plane, one of them covered up to x = 1.5."""
    from matplotlib.colors import to_rgba
    from matplotlib.figure import Figure

    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    facets = np.stack([square, square + [1.0, 0.0, 0.0]])
    part = square * [0.5, 1.0, 1.0] + [1.0, 0.0, 0.0]
    zero = np.zeros_like(facets)
    slaves = [facets, zero, zero, part[None], zero[:1], np.array([1])]
    random = np.random.default_rng(4)
    at = np.pad(random.uniform(0.0, 1.0, (30, 2)), ((0, 0), (0, 1)))
    at[15:] = at[15:] * [0.5, 1.0, 1.0] + [1.0, 0.0, 0.0]
    status = random.integers(Status.OPEN, Status.SLIP + 1, 30)
    points = {"x": at, "status": status, "facet": np.repeat([0, 1], 15)}
    points |= {"normal": np.tile([0.0, 0, 1], (30, 1)), "weight": np.ones(30)}
    axes = Figure().subplots()
    maps.draw_status(axes, slaves, points, AxisOptions())
    places = random.uniform(0.01, 0.99, (400, 2)) * [2.0, 1.0]
    own = (places[:, 0] > 1.0)[:, None] == points["facet"]
    ways = np.where(own, ((places[:, None] - at[:, :2]) ** 2).sum(axis=2), np.inf)
    first, second = np.sort(ways, axis=1)[:, :2].T
    clear = np.sqrt(second) - np.sqrt(first) > 0.01  # than a pixel
    clear &= np.abs(places[:, 0] - 1.5) > 0.01
    found = colours_at(axes, places[clear])
    covered = places[clear, 0] < 1.5
    assert (found[~covered, 3] == 0.0).all()
    nearest = status[ways[clear][covered].argmin(axis=1)]
    expected = np.array([to_rgba(STATUSES[Status(k)][0]) for k in nearest])
    np.testing.assert_allclose(found[covered], expected, atol=1e-12)


@pytest.fixture(scope="module")
def pushed():
    """Blocks on meshes of their own, with friction, and the same on one mesh."""
    found = hosts.apart(hosts.meshes(), friction=Coulomb(0.3))
    one = hosts.together(friction=Coulomb(0.3))
    for each in (found, one):
        host_solutions.solve(each, solver=raymortar.SNESSolver)
    return found, one


@pytest.mark.mpi
def test_friction_has_the_colour_of_its_status(pushed):
    contact = pushed[0].contact
    figure = raymortar.plot(contact, quantity="status")
    status = np.concatenate(COMM.allgather(contact.points()["status"]))
    if COMM.rank == 0:
        from matplotlib import pyplot

        shown = {
            line.get_label(): len(line.get_xdata()) for line in figure.axes[1].lines
        }
        expected = {"pressure": int((status >= Status.OPEN).sum())}
        for one, (_, name) in STATUSES.items():
            if (count := int((status == one).sum())) > 0:
                expected[f"friction, {name}"] = count
        assert shown == expected and len(shown) > 2
        pyplot.close(figure)


@pytest.mark.mpi
def test_bodies_on_meshes_of_their_own_are_drawn_as_on_one_mesh(pushed):
    drawn = []
    for found in pushed:
        parts = [d.u for d in found.contact.unknowns.displacements]
        fields = [ufl.det(ufl.Identity(2) + ufl.grad(u)) for u in parts]
        field = fields if len(fields) > 1 else fields[0]
        figure = raymortar.plot(found.contact, field=field)
        if COMM.rank == 0:
            from matplotlib import pyplot

            left, right = figure.axes[:2]
            values = np.sort(left.collections[0].get_array())
            cells = len(left.collections[1].get_paths())
            curve = np.sort(right.lines[0].get_ydata())
            limits = *left.get_xlim(), *left.get_ylim()
            drawn.append(
                SimpleNamespace(values=values, cells=cells, curve=curve, limits=limits)
            )
            pyplot.close(figure)
    if COMM.rank == 0:
        apart, together = drawn
        assert apart.cells == together.cells
        np.testing.assert_allclose(apart.curve, together.curve, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(apart.limits, together.limits, rtol=1e-9)
        np.testing.assert_allclose(apart.values, together.values, rtol=1e-7)


@pytest.mark.mpi
def test_what_cannot_be_drawn_is_refused(pushed):
    contact = pushed[0].contact
    u = contact.unknowns.displacements[0].u
    with pytest.raises(
        ContactError, match="on 2 meshes: field must be a list of one for each"
    ):
        raymortar.plot(contact, field=u)
    with pytest.raises(ContactError, match="another mesh than the displacement"):
        raymortar.plot(contact, field=[u, u])
    with pytest.raises(ContactError, match="quantity must be one of .*not 'slip'"):
        raymortar.plot(contact, quantity="slip")
